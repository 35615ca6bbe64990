"""A toy world for tests without a map: painted walls, boxes, a flat ground and descriptors, ray cast exactly for a pinhole
camera, one ray per pixel. Seen exactly as by `resurvey_plugin::toy` of the Rust SDK: the oracle, not the renderer.

    host = toy.street()
    photo = host.photo(toy.POSE)
    assert Agreement(toy.settings(Agreement)).score(photo.labels, host.view(toy.POSE)) == 1.0
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Optional, Tuple, Type

import numpy as np
from numpy.typing import ArrayLike

from .host import class_named
from .plugin import Cancelled, Failed, Plugin, Settings
from .records import (
    RAY_HIT,
    VIEW_FEATURE,
    Camera,
    ClassInfo,
    Comparison,
    Descriptor,
    DynamicDescriptor,
    Estimate,
    MaterialDescriptor,
    Photo,
    Pose,
    Prior,
    View,
)

STONE, GLASS, METAL, BANNER, PEDESTRIAN, CHAIR, SKY, FOLIAGE, OTHERS = range(9)
CLASSES = [
    ClassInfo(STONE, "stone", (0, 0, 255), "material"),
    ClassInfo(GLASS, "glass", (0, 255, 0), "material"),
    ClassInfo(METAL, "metal", (255, 165, 0), "material"),
    ClassInfo(BANNER, "banner", (165, 42, 42), "material"),
    ClassInfo(PEDESTRIAN, "pedestrian", (255, 0, 0), "dynamic", (0.5, 0.5, 1.7)),
    ClassInfo(CHAIR, "chair", (255, 192, 203), "dynamic", (0.5, 0.5, 0.9)),
    ClassInfo(SKY, "sky", (0, 0, 0), "ignored"),
    ClassInfo(FOLIAGE, "foliage", (255, 255, 0), "ignored"),
    ClassInfo(OTHERS, "others", (173, 216, 230), "ignored"),
]
POSE = Pose(835_000.0, 817_000.0, 5.6)
"""Where the photos of `street` are taken: eye height, looking north at its wall."""

_STAND_OFF_M = 0.02
_NEAREST = 1e-9


@dataclass(frozen=True)
class _Face:
    corners: np.ndarray
    class_index: int
    fid: int = 0


@dataclass
class Scene:
    """What stands in the toy world."""

    ground: Optional[Tuple[float, int]] = None
    """Height in metres and class of the endless flat ground."""
    faces: list = field(default_factory=list)
    descriptors: Dict[int, Descriptor] = field(default_factory=dict)
    """Feature id → descriptor."""

    def add_wall(self, start: ArrayLike, end: ArrayLike, heights_m: Tuple[float, float], class_index: int) -> None:
        """A vertical wall over the plan segment `start`–`end` (easting, northing; seen from outside left to right)."""
        low, high = heights_m
        corners = [(*start, low), (*end, low), (*end, high), (*start, high)]
        self.faces.append(_Face(np.array(corners, dtype=float), class_index))

    def add_box(self, position: ArrayLike, size_m: ArrayLike, class_index: int) -> None:
        """An upright box that stands on `position`."""
        self.faces += _box(DynamicDescriptor(class_index, position, size_m), 0)

    def add_descriptor(self, descriptor: Descriptor) -> int:
        """Puts a descriptor on the map; gives its feature id."""
        fid = max(self.descriptors, default=0) + 1
        self.descriptors[fid] = descriptor
        return fid

    def _faces(self, with_descriptors):
        faces = list(self.faces)
        for fid, descriptor in sorted(self.descriptors.items()) if with_descriptors else ():
            if isinstance(descriptor, MaterialDescriptor):
                corners = np.asarray(descriptor.corners) + _STAND_OFF_M * np.asarray(descriptor.normal)
                faces.append(_Face(corners, descriptor.class_index, fid))
            else:
                faces += _box(descriptor, fid)
        return faces


class ToyHost:
    """The services of `resurvey_plugin.host.Host` on a toy world. It has no map projection: WGS84 is an error."""

    def __init__(self, scene: Scene, camera: Camera):
        self.scene = scene
        self.camera = camera
        self.classes = list(CLASSES)
        self.slots = 9
        self.lines: List[Tuple[str, str]] = []
        """What was logged: level and text."""
        self.fractions: List[float] = []
        """What progress was told."""
        self.is_cancelled = False
        """Set it to see what a plugin makes of a cancel."""
        self._photo: Optional[np.ndarray] = None

    def view(self, pose: Pose, stride: int = 1, with_descriptors: bool = True) -> View:
        """What the map looks like at `pose`."""
        camera = self.camera
        u, v = (np.arange(0, size, stride) + 0.5 for size in (camera.width, camera.height))
        rays = _rays(camera, pose, np.stack(np.meshgrid(u, v), axis=-1))
        shape, rays = rays.shape[:2], rays.reshape(-1, 3)
        times, face_of, faces = self._cast(pose.position, rays, with_descriptors)
        classes = np.array([face.class_index for face in faces] + [SKY], dtype="u1")
        fids = sorted(self.scene.descriptors)
        features = np.array([fids.index(face.fid) + 1 if face.fid else 0 for face in faces] + [0], dtype="u4")
        points = rays * np.where(np.isfinite(times), times, np.nan)[:, None]
        table = np.zeros(len(fids), VIEW_FEATURE)
        table["fid"] = fids
        table["class"] = [self.scene.descriptors[fid].class_index for fid in fids]
        return View(pose.position, classes[face_of].reshape(shape),
                    (times * np.linalg.norm(rays, axis=-1)).astype("f4").reshape(shape),
                    points.astype("f4").reshape((*shape, 3)), features[face_of].reshape(shape), table)

    def picture(self, pose: Pose) -> np.ndarray:
        """What a camera at `pose` would take in the colours of the classes: red, green, blue (`uint8` [rows, columns, 3])."""
        colours = np.zeros((256, 3), dtype="u1")
        for item in self.classes:
            colours[item.index] = item.colour
        return colours[self.view(pose).labels]

    def placeless(self):
        """The host that a segmenter has: the class table, log, progress and cancellation. Every other service is `Failed`."""
        return _Placeless(self)

    def photo(self, pose: Pose, prior: Optional[Prior] = None) -> Photo:
        """A photo of this world taken at `pose`; the comparisons of this host are with the last one."""
        prior = prior or Prior(pose, 5.0, 0.5, 0.1, 0.02)
        self._photo = self.view(pose).labels
        return Photo(self._photo, self.camera, prior)

    def comparison(self, photo: np.ndarray, pose: Pose) -> Comparison:
        """Labels of a photo beside the view of this map at `pose`, for a detector or an estimator."""
        estimate = Estimate(pose, np.diag([0.01, 0.01, 1e-6]), 0.05, 0.002)
        return Comparison(photo, self.view(pose), self.camera, estimate)

    def class_named(self, name: str) -> ClassInfo:
        return class_named(self.classes, name)

    def render(self, poses: ArrayLike, stride: int = 1, with_descriptors: bool = True) -> List[View]:
        return [self.view(Pose(*pose), stride, with_descriptors) for pose in poses]

    def compare_views(self, poses: ArrayLike, stride: int = 1, ignored_in_photo: Iterable[int] = (),
                      ignored_in_view: Iterable[int] = (), boundary_tolerance_px: float = 0.0) -> np.ndarray:
        if self._photo is None:
            raise Failed("the toy host has no photo: call photo first")
        photo = self._photo[::stride, ::stride]
        takes_part = ~np.isin(photo, [*ignored_in_photo, 255])
        counts = np.zeros((len(poses), self.slots, 7), dtype="u4")
        for count, view in zip(counts, self.render(poses, stride)):
            compared = takes_part & (photo < self.slots) & (view.labels < self.slots)
            compared &= ~np.isin(view.labels, [*ignored_in_view])
            for index in range(self.slots):
                in_photo, in_view = compared & (photo == index), compared & (view.labels == index)
                count[index, :3] = in_photo.sum(), in_view.sum(), (in_photo & in_view).sum()
                if boundary_tolerance_px > 0:
                    edges = [np.argwhere(_boundary(labels == index) & takes_part) for labels in (photo, view.labels)]
                    near = _near(edges, boundary_tolerance_px / stride)
                    count[index, 3:] = len(edges[0]), near.any(axis=1).sum(), len(edges[1]), near.any(axis=0).sum()
        return counts

    def compare_panoramas(self, positions: ArrayLike, *, columns: int, yaw_count: int, yaw_step_columns: int = 1,
                          first_yaw_rad: float = 0.0, pitch_rad: float = 0.0, roll_rad: float = 0.0,
                          ignored_in_photo: Iterable[int] = (), ignored_in_view: Iterable[int] = ()) -> np.ndarray:
        """Compares a view at every heading: it counts pixels where the host counts cells of a panorama; shares are alike."""
        step_rad = 2 * np.pi / columns
        yaws = step_rad * (np.round(first_yaw_rad / step_rad) + yaw_step_columns * np.arange(yaw_count))
        poses = [(*position, yaw, pitch_rad, roll_rad) for position in positions for yaw in yaws]
        counts = self.compare_views(poses, 1, ignored_in_photo, ignored_in_view)
        return counts.reshape(len(positions), yaw_count, self.slots, 7)

    def inside_solid(self, points: ArrayLike) -> np.ndarray:
        return np.zeros(len(points), dtype=bool)

    def pixel_rays(self, pose: Pose, pixels: ArrayLike) -> np.ndarray:
        rays = _rays(self.camera, pose, np.asarray(pixels, dtype=float))
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def project(self, pose: Pose, points: ArrayLike) -> np.ndarray:
        right, down, forward = _axes(pose)
        offsets = np.asarray(points, dtype=float) - pose.position
        depth = offsets @ forward
        depth = np.where(depth > _NEAREST, depth, np.nan)
        camera = self.camera
        return np.stack([camera.fx * (offsets @ right) / depth + camera.cx,
                         camera.fy * (offsets @ down) / depth + camera.cy], axis=-1)

    def cast_rays(self, origin: ArrayLike, directions: ArrayLike, limit_m: Optional[float] = None,
                  with_descriptors: bool = True) -> np.ndarray:
        origin, directions = np.asarray(origin, dtype=float), np.asarray(directions, dtype=float)
        times, face_of, faces = self._cast(origin, directions, with_descriptors)
        ranges = times * np.linalg.norm(directions, axis=-1)
        hits = np.zeros(len(directions), RAY_HIT)
        for index in np.flatnonzero(ranges <= (np.inf if limit_m is None else limit_m)):
            if not np.isfinite(ranges[index]):
                continue
            face = faces[face_of[index]]
            normal = np.array([0.0, 0.0, 1.0]) if face.corners is None else _normal(face.corners)
            hit = hits[index]
            hit["point"] = origin + times[index] * directions[index]
            hit["range_m"], hit["hit"], hit["class"] = ranges[index], 1, face.class_index
            hit["normal"] = -normal if normal @ directions[index] > 0 else normal
            hit["fid"], hit["has_fid"] = face.fid, bool(face.fid)
        return hits

    def descriptors_near(self, point: ArrayLike, radius_m: float) -> List[Tuple[int, Descriptor]]:
        def anchor(descriptor):
            is_material = isinstance(descriptor, MaterialDescriptor)
            return np.mean(descriptor.corners, axis=0) if is_material else np.asarray(descriptor.position, dtype=float)

        return [(fid, descriptor) for fid, descriptor in sorted(self.scene.descriptors.items())
                if np.linalg.norm(anchor(descriptor) - np.asarray(point)) <= radius_m]

    def ground_height(self, point: ArrayLike) -> Optional[float]:
        hit = self.cast_rays(point, [[0.0, 0.0, -1.0]], with_descriptors=False)[0]
        return float(hit["point"][2]) if hit["hit"] else None

    def grid_from_wgs84(self, position: ArrayLike) -> np.ndarray:
        raise Failed("the toy host does not offer grid_from_wgs84")

    def wgs84_from_grid(self, point: ArrayLike) -> np.ndarray:
        raise Failed("the toy host does not offer wgs84_from_grid")

    def log(self, text: str, level: str = "info") -> None:
        self.lines.append((level, text))

    def progress(self, fraction: float) -> None:
        self.fractions.append(fraction)

    def cancelled(self) -> bool:
        return self.is_cancelled

    def check_cancelled(self) -> None:
        if self.is_cancelled:
            raise Cancelled

    def _cast(self, origin, rays, with_descriptors):
        """For each ray how many times its length the first face is away (infinite: none), which face, and the faces."""
        faces = self.scene._faces(with_descriptors)
        nearest = np.full(len(rays), np.inf)
        face_of = np.full(len(rays), len(faces) + (self.scene.ground is not None))
        with np.errstate(divide="ignore", invalid="ignore"):
            if self.scene.ground is not None:
                height_m, class_index = self.scene.ground
                _take(nearest, face_of, (height_m - origin[2]) / rays[:, 2], len(faces))
            for index, face in enumerate(faces):
                _take(nearest, face_of, _meet(face.corners, origin, rays), index)
        if self.scene.ground is not None:
            faces = [*faces, _Face(None, class_index)]
        return nearest, face_of, faces


class _Placeless:
    """A `ToyHost` before anybody knows where the photo was taken."""

    _KEPT = ("classes", "class_named", "slots", "lines", "fractions", "is_cancelled", "log", "progress", "cancelled",
             "check_cancelled")

    def __init__(self, host):
        self._host = host

    def __getattr__(self, name):
        found = getattr(self._host, name)
        if name in self._KEPT:
            return found
        raise Failed("a segmenter has no map: nobody knows yet where the photo was taken")


def camera(width: int = 320, height: int = 240, diagonal_fov_deg: float = 90.0) -> Camera:
    """A centred pinhole with square pixels."""
    focal = np.hypot(width, height) / 2 / np.tan(np.radians(diagonal_fov_deg) / 2)
    return Camera("pinhole", width, height, focal, focal, width / 2, height / 2)


def street(width: int = 320, height: int = 240) -> ToyHost:
    """A host of a street seen from `POSE`: 10 m ahead a stone wall with windows and a shop front, at its ends other houses."""
    scene = Scene(ground=(4.0, OTHERS))
    east, north = POSE.easting_m, POSE.northing_m + 10.0
    scene.add_wall((east - 9.0, north), (east + 9.0, north), (4.0, 11.0), STONE)
    for left, bottom, size in ((-7.0, 8.6, (2.0, 1.5)), (-2.5, 8.6, (1.5, 1.5)), (4.0, 8.6, (3.0, 1.5))):
        scene.add_wall((east + left, north - 0.05), (east + left + size[0], north - 0.05), (bottom, bottom + size[1]), GLASS)
    scene.add_wall((east + 1.0, north - 0.05), (east + 7.0, north - 0.05), (4.0, 7.0), METAL)
    scene.add_wall((east - 16.0, north + 6.0), (east - 9.0, north + 6.0), (4.0, 13.0), METAL)
    scene.add_wall((east + 9.0, north - 3.0), (east + 15.0, north - 3.0), (4.0, 10.0), GLASS)
    return ToyHost(scene, camera(width, height))


def banner() -> MaterialDescriptor:
    """A banner of 3 m × 1 m for the wall of `street`: `street().scene.add_descriptor(banner())`."""
    east, north = POSE.easting_m - 6.0, POSE.northing_m + 10.0
    corners = [(east, north, 7.0), (east + 3.0, north, 7.0), (east + 3.0, north, 8.0), (east, north, 8.0)]
    return MaterialDescriptor(BANNER, np.array(corners), np.array([0.0, -1.0, 0.0]))


def settings(plugin: Type[Plugin], **changed) -> Settings:
    """The settings of a plugin with their defaults, but for those named."""
    return Settings({**{name: schema["default"] for name, schema in plugin.SETTINGS.items()}, **changed})


def _axes(pose):
    sin_y, cos_y = np.sin(pose.yaw_rad), np.cos(pose.yaw_rad)
    sin_p, cos_p = np.sin(pose.pitch_rad), np.cos(pose.pitch_rad)
    sin_r, cos_r = np.sin(pose.roll_rad), np.cos(pose.roll_rad)
    forward = np.array([sin_y * cos_p, cos_y * cos_p, sin_p])
    right0 = np.array([cos_y, -sin_y, 0.0])
    down0 = np.cross(forward, right0)
    return cos_r * right0 + sin_r * down0, cos_r * down0 - sin_r * right0, forward


def _rays(camera, pose, pixels):
    """One unit deep along the optical axis."""
    right, down, forward = _axes(pose)
    x = (pixels[..., 0:1] - camera.cx) / camera.fx
    y = (pixels[..., 1:2] - camera.cy) / camera.fy
    return forward + x * right + y * down


def _normal(corners):
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    return normal / np.linalg.norm(normal)


def _meet(corners, origin, rays):
    """How many times each ray the rectangle is away; not a number where it is missed."""
    along, up, to_corner = corners[1] - corners[0], corners[3] - corners[0], corners[0] - origin
    normal = _normal(corners)
    times = (normal @ to_corner) / (rays @ normal)
    inside = rays * times[:, None] - to_corner
    s, t = inside @ along / (along @ along), inside @ up / (up @ up)
    return np.where((s >= 0) & (s <= 1) & (t >= 0) & (t <= 1), times, np.nan)


def _boundary(inside):
    """Pixels of a mask with a neighbour by their side, inside the image, that is outside of it."""
    wide = np.pad(inside, 1, constant_values=True)
    return inside & ~(wide[:-2, 1:-1] & wide[2:, 1:-1] & wide[1:-1, :-2] & wide[1:-1, 2:])


def _near(edges, tolerance_px):
    """Which pixels of the one list are within the tolerance of which of the other."""
    between = edges[0][:, None, :] - edges[1][None, :, :]
    return (between**2).sum(axis=-1) <= tolerance_px**2


def _take(nearest, face_of, times, index):
    nearer = np.isfinite(times) & (times > _NEAREST) & (times < nearest)
    nearest[nearer], face_of[nearer] = times[nearer], index


def _box(descriptor, fid):
    along_m, across_m, up_m = descriptor.size_m
    sin_y, cos_y = np.sin(descriptor.yaw_rad or 0.0), np.cos(descriptor.yaw_rad or 0.0)

    def corner(along, across, height_m):
        front, side = along * along_m / 2, across * across_m / 2
        offset = (front * sin_y + side * cos_y, front * cos_y - side * sin_y, height_m)
        return np.asarray(descriptor.position, dtype=float) + offset

    turn = [(-1, -1), (-1, 1), (1, 1), (1, -1)]
    faces = [[corner(*ends, up_m) for ends in turn]]
    for (a, b), (c, d) in zip(turn, turn[1:] + turn[:1]):
        faces.append([corner(a, b, 0.0), corner(c, d, 0.0), corner(c, d, up_m), corner(a, b, up_m)])
    return [_Face(np.array(corners), descriptor.class_index, fid) for corners in faces]
