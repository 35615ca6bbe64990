"""A segmenter: which class is each pixel of a photo? This one takes the class whose colour is nearest, which reads pictures
in class colours and no photographs: put a network in its place.

Build: python3 -m resurvey_plugin build segmenter.py
Check: resurvey plugins check resurvey-plugin-my-plugin
"""

import numpy as np

from resurvey_plugin import VOID, Plugin, main


class MySegmenter(Plugin):
    NAME = "my-plugin"
    VERSION = "0.1.0"
    SUMMARY = "The class with the nearest colour, for pictures in class colours"
    SETTINGS = {
        "reach": {"type": "integer", "default": 60, "minimum": 0, "maximum": 765,
                  "description": "largest difference of a colour from that of its class, sum over red, green and blue"},
        # The weights of a network: {"type": "string", "format": "file", "default": ""}; the host records their SHA-256.
    }

    def segment(self, photo, host):
        """`photo` is `uint8` [rows, columns, 3]: red, green, blue (sRGB). Whole numbers [rows, columns] go back: the index of
        a class of `host.classes`, or VOID."""
        indices = np.array([one.index for one in host.classes])
        colours = np.array([one.colour for one in host.classes])
        labels = np.empty(photo.shape[:2], dtype=np.uint8)
        for row, pixels in enumerate(photo.astype(int)):
            host.check_cancelled()
            off = np.abs(pixels[:, None] - colours).sum(axis=-1)
            nearest = off.argmin(axis=1)
            labels[row] = np.where(off.min(axis=1) <= self.settings.reach, indices[nearest], VOID)
        return labels


if __name__ == "__main__":
    main(MySegmenter)
