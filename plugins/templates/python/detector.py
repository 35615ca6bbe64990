"""A change detector: in which regions do photo and view differ?

Build: python3 -m resurvey_plugin build detector.py
Check: resurvey plugins check resurvey-plugin-my-plugin
"""

import numpy as np

from resurvey_plugin import VOID, Plugin, Region, main


class MyDetector(Plugin):
    NAME = "my-plugin"
    VERSION = "0.1.0"
    SUMMARY = "Connected regions in which photo and view differ"
    SETTINGS = {
        "least_px": {"type": "integer", "default": 100, "minimum": 1, "maximum": 1_000_000,
                     "description": "smallest region, pixels"},
    }

    def detect(self, comparison, host):
        photo, view = comparison.photo, comparison.view.labels
        # One number for each pair of class before and class after; -1 where nothing changed.
        pairs = np.where((photo != view) & (photo != VOID), view.astype(int) * 256 + photo, -1)
        for pixels in connected(pairs, host):
            if len(pixels) >= self.settings.least_px:
                mask = np.zeros(photo.size, dtype=bool)
                mask[pixels] = True
                first = pixels[0]
                yield Region.of(mask.reshape(photo.shape), view.flat[first], photo.flat[first])


def connected(pairs, host):
    """Lists of the flat indices of pixels that hang together by their sides and have one number, not -1."""
    width, flat = pairs.shape[1], pairs.ravel()
    left = dict.fromkeys(np.flatnonzero(flat >= 0).tolist())
    numbers = {index: int(flat[index]) for index in left}
    while left:
        start, _ = left.popitem()
        pixels = [start]
        for count, index in enumerate(pixels):
            if count % 4096 == 0:  # A large region takes longer than 200 ms.
                host.check_cancelled()
            beside = [index - width, index + width]
            beside += [index - 1] if index % width else []
            beside += [index + 1] if (index + 1) % width else []
            for near in beside:
                if near in left and numbers[near] == numbers[start]:
                    del left[near]
                    pixels.append(near)
        yield pixels


if __name__ == "__main__":
    main(MyDetector)
