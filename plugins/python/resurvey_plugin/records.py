"""Plain values that go into a call and come out of it.

Metres and radians. A position is easting, northing, height; a pose adds yaw (clockwise from grid north), pitch (up) and
roll (right side down). Pixel (i, j) has its centre at (i + 0.5, j + 0.5), the origin is the top-left corner.
"""

from dataclasses import dataclass, field
from typing import NamedTuple, Optional, Tuple, Union

import numpy as np

CLASS_COUNTS = ("photo", "view", "both", "photo_boundary", "photo_boundary_matched", "view_boundary",
                "view_boundary_matched")
"""What the last axis of the host's comparisons counts, pixels of one class."""

VIEW_FEATURE = np.dtype({"names": ["fid", "class"], "formats": ["<u8", "u1"], "offsets": [0, 8], "itemsize": 16})
RAY_HIT = np.dtype({
    "names": ["point", "range_m", "normal", "fid", "hit", "has_fid", "class"],
    "formats": [("<f8", 3), "<f8", ("<f8", 3), "<u8", "u1", "u1", "u1"],
    "offsets": [0, 24, 32, 56, 64, 65, 66],
    "itemsize": 72,
})


class Pose(NamedTuple):
    """Position and orientation of a camera."""

    easting_m: float
    northing_m: float
    height_m: float
    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rad: float = 0.0

    @property
    def position(self) -> np.ndarray:
        """Easting, northing, height."""
        return np.array(self[:3])


class ClassInfo(NamedTuple):
    """A class of the map; `kind` is material, dynamic or ignored, `size_m` along, across, up of a dynamic one."""

    index: int
    name: str
    colour: Tuple[int, int, int]
    kind: str
    size_m: Optional[Tuple[float, float, float]] = None


@dataclass(frozen=True)
class Camera:
    """Intrinsics in pixels; `model` is pinhole, brown (k1 k2 p1 p2 k3) or fisheye (k1 k2 k3 k4)."""

    model: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: Tuple[float, ...] = (0.0,) * 5


@dataclass(frozen=True)
class Prior:
    """The phone's rough pose, 1 sigma each."""

    pose: Pose
    position_sigma_m: float
    height_sigma_m: float
    yaw_sigma_rad: float
    tilt_sigma_rad: float


@dataclass(frozen=True)
class Alignment:
    """What aligning contours told: covariance over easting, northing, yaw, height, pitch, roll, and how far walls stand
    off the map and contours of the labels wander, 1 sigma each."""

    covariance: np.ndarray
    map_sigma_m: float
    label_sigma_px: float


@dataclass(frozen=True)
class Estimate:
    """Where a photo was taken; the covariance is over easting, northing, yaw."""

    pose: Pose
    covariance: np.ndarray
    height_sigma_m: float
    tilt_sigma_rad: float
    alignment: Optional[Alignment] = None


PoseEstimate = Estimate
"""The name that Rust and C have for it."""


@dataclass(frozen=True)
class Photo:
    """Labels of a photo (`uint8` [rows, columns]), its camera and the phone's prior."""

    labels: np.ndarray
    camera: Camera
    prior: Prior


class View(NamedTuple):
    """The map as seen from a pose: what one ray per pixel hits first. Arrays are [rows, columns]."""

    origin: np.ndarray
    """Where the offsets in `points` start."""
    labels: np.ndarray
    """`uint8`: class; sky where nothing is hit."""
    range_m: np.ndarray
    """`float32`: distance along the ray; infinite where nothing is hit."""
    points: np.ndarray
    """`float32` [rows, columns, 3]: offset from `origin`; NaN where nothing is hit."""
    features: np.ndarray
    """`uint32`: 0, or 1 + index into `feature_table`."""
    feature_table: np.ndarray
    """Fields `fid` and `class`: the descriptors of the scene."""


@dataclass(frozen=True)
class Comparison:
    """Photo (`uint8` labels) and view of one pose."""

    photo: np.ndarray
    view: View
    camera: Camera
    estimate: Estimate


@dataclass(frozen=True)
class RunnerUp:
    """The second-best place: how far away, and its likelihood over that of the best, 0 to 1."""

    distance_m: float
    score_ratio: float


@dataclass
class Localization:
    """The answer of a search: the pose, its score (0 to 1) and its covariance over easting, northing, yaw."""

    pose: Pose
    score: float
    covariance: np.ndarray
    alignment: Optional[Alignment] = None
    runner_up: Optional[RunnerUp] = None
    candidates: int = 0
    skipped: int = 0
    heat: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    """Rows of easting, northing, best score there."""


@dataclass
class Region:
    """Pixels in which photo and view differ: `mask` covers the box from column `left` and row `top`."""

    class_before: int
    """In the view."""
    class_after: int
    """In the photo."""
    left: int
    top: int
    mask: np.ndarray

    @classmethod
    def of(cls, mask: np.ndarray, class_before: int, class_after: int) -> "Region":
        """The region of the pixels that are not 0 in `mask`, an image as large as the photo."""
        mask = np.asarray(mask) != 0
        if mask.ndim != 2:
            raise ValueError(f"expected a mask of rows and columns, found an array of shape {mask.shape}")
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if not rows.size:
            raise ValueError("expected a mask with at least one pixel, found none")
        box = mask[rows[0]:rows[-1] + 1, columns[0]:columns[-1] + 1]
        return cls(int(class_before), int(class_after), int(columns[0]), int(rows[0]), box.astype(np.uint8))

    @property
    def pixels(self) -> int:
        """Number of pixels."""
        return int(np.count_nonzero(self.mask))

    @property
    def rows_and_columns(self) -> Tuple[slice, slice]:
        """Slices that cut the box out of an image: `view.points[region.rows_and_columns]`."""
        height, width = self.mask.shape
        return slice(self.top, self.top + height), slice(self.left, self.left + width)


@dataclass
class MaterialDescriptor:
    """A quadrilateral on a surface: corners bottom-left, bottom-right, top-right, top-left as seen from outside, and the
    unit normal away from the surface; 1 sigma of position (m), size (m) and area (m²), the first is needed."""

    class_index: int
    corners: np.ndarray
    normal: np.ndarray
    sigma: Optional[Tuple[float, Optional[float], Optional[float]]] = None


@dataclass
class DynamicDescriptor:
    """An object that stands at `position`, `size_m` along, across, up; `yaw_rad` where its front is known."""

    class_index: int
    position: np.ndarray
    size_m: np.ndarray
    yaw_rad: Optional[float] = None
    sigma: Optional[Tuple[float, Optional[float], Optional[float]]] = None


Descriptor = Union[MaterialDescriptor, DynamicDescriptor]


@dataclass
class Place:
    """Put a descriptor on the map; `region` is the index of the region it comes from, as in all proposals."""

    region: int
    descriptor: Descriptor


@dataclass
class Remove:
    """Take the descriptor of a class off that stood near a point, 1 sigma of which is `sigma_m`."""

    region: int
    class_index: int
    near: np.ndarray
    sigma_m: float


@dataclass
class Reject:
    """Leave the map alone: a requirement (a short stable name) was missed by what was measured, in `unit`."""

    region: int
    requirement: str
    measured: float
    limit: float
    unit: str
