"""What the host does for a plugin during a call."""

from __future__ import annotations

from typing import Iterable, List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike

from . import words
from .plugin import Cancelled, Failed
from .records import ClassInfo, Descriptor, Pose, View

_ANSWER_BYTES = 64 << 20
_LOG_BYTES = 16 << 10
_LEVELS = ("warning", "info", "debug")


class Host:
    """The services. Positions, poses, pixels and rays go in as arrays with a row for each; what comes back is yours to
    keep. A service that has no answer raises `Failed`."""

    def __init__(self, link, call):
        self._link = link
        self._scratch = call["scratch"]
        self.classes: List[ClassInfo] = words.classes(call["classes"])
        """The class table of the map, by rising index."""
        self.slots = max((item.index for item in self.classes), default=-1) + 1
        """One more than the highest class index."""

    def class_named(self, name: str) -> ClassInfo:
        """The class that the map calls so, such as banner."""
        return class_named(self.classes, name)

    def render(self, poses: ArrayLike, stride: int = 1, with_descriptors: bool = True) -> List[View]:
        """A list with one `View` per pose, with every `stride`-th pixel of the camera of the call. All are kept: ask for as
        many at a time as there is memory for."""
        poses = _rows(poses, 6)
        found = []
        while len(found) < len(poses):
            wanted = poses[len(found):len(found) + max(1, self._scratch["bytes"] // 48)]
            answer = self._ask("render", stride=int(stride), with_descriptors=bool(with_descriptors),
                               poses=self._sent(wanted))
            # The next request takes the memory back.
            found += [_copied(view) for view in views(self._link, answer["views"])]
        return found

    def compare_views(self, poses: ArrayLike, stride: int = 1, ignored_in_photo: Iterable[int] = (),
                      ignored_in_view: Iterable[int] = (), boundary_tolerance_px: float = 0.0) -> np.ndarray:
        """`uint32` [poses, classes, 7]: pixels of every class in photo and view, in the order of `CLASS_COUNTS`."""
        return self._by_rows("compare_views", "poses", _rows(poses, 6), 28 * self.slots, (self.slots, 7),
                             stride=int(stride), ignored_in_photo=class_set(ignored_in_photo),
                             ignored_in_view=class_set(ignored_in_view),
                             boundary_tolerance_px=float(boundary_tolerance_px))

    def compare_panoramas(self, positions: ArrayLike, *, columns: int, yaw_count: int, yaw_step_columns: int = 1,
                          first_yaw_rad: float = 0.0, pitch_rad: float = 0.0, roll_rad: float = 0.0,
                          ignored_in_photo: Iterable[int] = (), ignored_in_view: Iterable[int] = ()) -> np.ndarray:
        """`uint32` [positions, headings, classes, 7]: as `compare_views`, with boundary counts of zero; one panorama of
        `columns` per position, headings as shifts by `yaw_step_columns`."""
        return self._by_rows("compare_panoramas", "positions", _rows(positions, 3), 28 * self.slots * int(yaw_count),
                             (int(yaw_count), self.slots, 7), pitch_rad=float(pitch_rad), roll_rad=float(roll_rad),
                             first_yaw_rad=float(first_yaw_rad), yaw_step_columns=int(yaw_step_columns),
                             yaw_count=int(yaw_count), columns=int(columns),
                             ignored_in_photo=class_set(ignored_in_photo), ignored_in_view=class_set(ignored_in_view))

    def inside_solid(self, points: ArrayLike) -> np.ndarray:
        """`bool` [points]: inside a solid building."""
        return self._by_rows("inside_solid", "points", _rows(points, 3), 1, ()).astype(bool)

    def pixel_rays(self, pose: Pose, pixels: ArrayLike) -> np.ndarray:
        """Unit directions [pixels, 3] of the rays through pixel coordinates u, v of the camera at `pose`."""
        return self._by_rows("pixel_rays", "pixels", _rows(pixels, 2), 24, (3,), pose=words.numbers(pose, 6))

    def project(self, pose: Pose, points: ArrayLike) -> np.ndarray:
        """Pixel coordinates [points, 2] of points; NaN behind the camera or outside its model."""
        return self._by_rows("project", "points", _rows(points, 3), 16, (2,), pose=words.numbers(pose, 6))

    def cast_rays(self, origin: ArrayLike, directions: ArrayLike, limit_m: Optional[float] = None,
                  with_descriptors: bool = True) -> np.ndarray:
        """What each ray hits first: fields `point`, `range_m`, `normal`, `fid`, `hit`, `has_fid`, `class`."""
        return self._by_rows("cast_rays", "directions", _rows(directions, 3), 72, (), origin=words.numbers(origin, 3),
                             limit_m=None if limit_m is None else words.number(limit_m),
                             with_descriptors=bool(with_descriptors))

    def descriptors_near(self, point: ArrayLike, radius_m: float) -> List[Tuple[int, Descriptor]]:
        """List of feature id and descriptor, by rising id, whose anchor is within `radius_m`."""
        answer = self._ask("descriptors_near", point=words.numbers(point, 3), radius_m=words.number(radius_m))
        return [(near["fid"], words.descriptor_from(near["descriptor"])) for near in answer.get("features") or []]

    def ground_height(self, point: ArrayLike) -> Optional[float]:
        """Height of the first surface of the base map below `point`; `None` where there is none."""
        return self._ask("ground_height", point=words.numbers(point, 3)).get("height_m")

    def grid_from_wgs84(self, position: ArrayLike) -> np.ndarray:
        """Easting, northing, height of latitude °, longitude °, ellipsoidal height m."""
        return np.array(self._ask("grid_from_wgs84", position=words.numbers(position, 3))["position"])

    def wgs84_from_grid(self, point: ArrayLike) -> np.ndarray:
        """Latitude °, longitude °, ellipsoidal height m of easting, northing, height."""
        return np.array(self._ask("wgs84_from_grid", point=words.numbers(point, 3))["position"])

    def log(self, text: str, level: str = "info") -> None:
        """A line for the host's log, cut after 16 KiB; `level` is warning, info or debug."""
        if level not in _LEVELS:
            raise ValueError(f"expected a level of {', '.join(_LEVELS)}, found {level!r}")
        self._link.send("log", {"level": level, "text": words.text(text, _LOG_BYTES)})

    def progress(self, fraction: float) -> None:
        """Tells the user how far the call is, 0 to 1."""
        self._link.send("progress", words.number(fraction))

    def cancelled(self) -> bool:
        """Whether the host wants the call to end: return within 200 ms."""
        return self._link.cancelled()

    def check_cancelled(self) -> None:
        """Ends the call with `Cancelled` when the host wants it to end."""
        if self.cancelled():
            raise Cancelled

    def _ask(self, request, **words_of_request):
        return ask(self._link, request, words_of_request)

    def _sent(self, array):
        return self._link.put(array, self._scratch["offset"])[0]

    def _by_rows(self, request, field, rows, answer_bytes, shape, **others):
        """Asks for as many rows at a time as fit into scratch and answer."""
        most = max(1, min(self._scratch["bytes"] // (rows.shape[1] * 8), _ANSWER_BYTES // max(1, answer_bytes)))
        parts = []
        for start in range(0, max(1, len(rows)), most):
            answer = self._ask(request, **{**others, field: self._sent(rows[start:start + most])})
            parts.append(self._link.lent(answer["values"]).copy())
        found = parts[0] if len(parts) == 1 else np.concatenate(parts)
        return found.reshape((len(rows), *shape)) if shape else found


def ask(link, request, value):
    """Sends a request and waits for its answer."""
    link.send(request, value)
    name, answer = link.receive()
    if name == "error":
        raise Failed(answer["text"])
    if name != "served":
        raise ValueError(f"expected served or error, found {name}")
    link.grown_to(answer["memory"])
    return answer


def views(link, stack):
    """The views of a stack, one after the other."""
    table = link.lent(stack["feature_table"])
    rasters = (link.lent(stack[name]) for name in ("origins", "labels", "range_m", "points", "features"))
    for origin, labels, range_m, points, features in zip(*rasters):
        yield View(origin, labels, range_m, points, features, table)


def class_named(classes, name):
    """The one of the classes that is called so."""
    for one in classes:
        if one.name == name:
            return one
    raise Failed(f"expected a map with a class {name}, found {', '.join(one.name for one in classes)}")


def class_set(classes):
    """Class indices as four words of 64 bits."""
    bits = 0
    for index in classes:
        if not 0 <= int(index) < 255:
            raise ValueError(f"expected indices of classes from 0 to 254, found {index}")
        bits |= 1 << int(index)
    return [bits >> (64 * word) & 0xFFFF_FFFF_FFFF_FFFF for word in range(4)]


def _copied(view):
    return View(*(part.copy() for part in view))


def _rows(values, columns):
    if isinstance(values, Pose):
        values = [values]
    array = np.asarray(list(values) if not isinstance(values, np.ndarray) else values, dtype="<f8")
    if not array.size:
        return np.empty((0, columns))
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"expected rows of {columns} numbers, found an array of shape {array.shape}")
    return array
