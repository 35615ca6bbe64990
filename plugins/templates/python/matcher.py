"""A matcher: how well does one view of the map fit the photo? The host makes the candidate poses, renders and searches.

Build: python3 -m resurvey_plugin build matcher.py
Check: resurvey plugins check resurvey-plugin-my-plugin
"""

from resurvey_plugin import VOID, Failed, Plugin, main


class MyMatcher(Plugin):
    NAME = "my-plugin"
    VERSION = "0.1.0"
    SUMMARY = "Share of the pixels whose class is the same in photo and view"
    SETTINGS = {
        "void": {"type": "integer", "default": VOID, "minimum": 0, "maximum": 255,
                 "description": "class of the photo that is not compared"},
    }

    def score(self, photo, view):
        """From 0 to 1, higher is better; photo and view have one size."""
        compared = photo != self.settings.void
        if not compared.any():
            raise Failed("expected labels in the photo, found only void")
        return (photo == view.labels)[compared].mean()


if __name__ == "__main__":
    main(MyMatcher)
