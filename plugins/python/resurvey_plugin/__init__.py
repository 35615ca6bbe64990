"""Plugins for resurvey in Python: a matcher, a change detector, a descriptor estimator or a segmenter is one class.

    class Agreement(Plugin):
        NAME, VERSION, SUMMARY = "agreement", "1.0.0", "Share of pixels whose class is the same"

        def score(self, photo, view):
            return float((photo == view.labels).mean())

    if __name__ == "__main__":
        main(Agreement)

It runs in a process of its own and speaks the wire of docs/plugin-wire.md. NumPy is needed: images are arrays.
`resurvey_plugin.toy` is a small world for tests without a map; `python3 -m resurvey_plugin build FILE` makes the one file
that the host runs.
"""

from .host import Host
from .plugin import Cancelled, Failed, Plugin, Settings, declaration
from .records import (
    CLASS_COUNTS,
    Alignment,
    Camera,
    ClassInfo,
    Comparison,
    Descriptor,
    DynamicDescriptor,
    Estimate,
    Localization,
    MaterialDescriptor,
    Photo,
    Place,
    Pose,
    PoseEstimate,
    Prior,
    Region,
    Reject,
    Remove,
    RunnerUp,
    View,
)
from .serve import main

VOID = 255
"""Class of a pixel that is not labelled; it is never compared."""

__version__ = "0.1.0"
__all__ = [
    "CLASS_COUNTS", "VOID", "Alignment", "Camera", "Cancelled", "ClassInfo", "Comparison", "Descriptor", "DynamicDescriptor",
    "Estimate", "Failed", "Host", "Localization", "MaterialDescriptor", "Photo", "Place", "Plugin", "Pose", "PoseEstimate", "Prior",
    "Region", "Reject", "Remove", "RunnerUp", "Settings", "View", "declaration", "main",
]
