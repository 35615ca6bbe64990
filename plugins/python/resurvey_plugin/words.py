"""Records to JSON and back, as docs/plugin-wire.md writes them."""

import json
import math

import numpy as np

from .records import (
    Alignment,
    Camera,
    ClassInfo,
    DynamicDescriptor,
    Estimate,
    MaterialDescriptor,
    Place,
    Pose,
    Prior,
    Reject,
    Remove,
)


def line(name, value):
    """A message as it goes over the wire."""
    return json.dumps({name: value}, separators=(",", ":"), allow_nan=False).encode() + b"\n"


def text(value, most_bytes):
    """A text, cut to whole characters; a message holds no half of a surrogate pair, as names of files may."""
    return str(value).encode("utf-8", "replace")[:most_bytes].decode("utf-8", "ignore")


def number(value):
    """A number; JSON has no NaN and no infinity, null stands for them."""
    value = float(value)
    return value if math.isfinite(value) else None


def numbers(values, *shape):
    """Numbers of a fixed shape, as lists."""
    array = np.asarray(values, dtype=float)
    if array.shape != shape:
        raise ValueError(f"expected {' × '.join(map(str, shape))} numbers, found an array of shape {array.shape}")
    return _listed(array)


def _listed(array):
    return [number(value) if array.ndim == 1 else _listed(value) for value in array]


def camera(words):
    return Camera(**{**words, "distortion": tuple(words["distortion"])})


def prior(words):
    return Prior(**{**words, "pose": Pose(*words["pose"])})


def classes(words):
    return [ClassInfo(item["index"], item["name"], tuple(item["colour"]), item["kind"], item.get("size_m"))
            for item in words]


def estimate(words):
    told = words["alignment"]
    alignment = told and Alignment(np.array(told["covariance"]), told["map_sigma_m"], told["label_sigma_px"])
    return Estimate(Pose(*words["pose"]), np.array(words["covariance"]), words["height_sigma_m"],
                    words["tilt_sigma_rad"], alignment)


def localization(found):
    words = {
        "pose": numbers(found.pose, 6),
        "score": number(found.score),
        "covariance": numbers(found.covariance, 3, 3),
        "candidates": int(found.candidates),
        "skipped": int(found.skipped),
    }
    if found.alignment is not None:
        words["alignment"] = {
            "covariance": numbers(found.alignment.covariance, 6, 6),
            "map_sigma_m": number(found.alignment.map_sigma_m),
            "label_sigma_px": number(found.alignment.label_sigma_px),
        }
    if found.runner_up is not None:
        words["runner_up"] = {
            "distance_m": number(found.runner_up.distance_m),
            "score_ratio": number(found.runner_up.score_ratio),
        }
    return words


def descriptor_from(words):
    (kind, parts), = words.items()
    if kind == "material":
        return MaterialDescriptor(parts["class"], np.array(parts["corners"]), np.array(parts["normal"]),
                                  parts.get("sigma"))
    return DynamicDescriptor(parts["class"], np.array(parts["position"]), np.array(parts["size_m"]),
                             parts.get("yaw_rad"), parts.get("sigma"))


def descriptor(record):
    sigma = None if record.sigma is None else [None if part is None else float(part) for part in record.sigma]
    if isinstance(record, MaterialDescriptor):
        return {"material": {"class": int(record.class_index), "corners": numbers(record.corners, 4, 3),
                             "normal": numbers(record.normal, 3), "sigma": sigma}}
    return {"dynamic": {"class": int(record.class_index), "position": numbers(record.position, 3),
                        "size_m": numbers(record.size_m, 3),
                        "yaw_rad": None if record.yaw_rad is None else float(record.yaw_rad), "sigma": sigma}}


def proposal(record, regions):
    index = int(record.region)
    if isinstance(record, Place):
        return {"place": {"region": index, "descriptor": descriptor(record.descriptor)}}
    if isinstance(record, Remove):
        return {"remove": {"region": index, "class": int(record.class_index), "near": numbers(record.near, 3),
                           "sigma_m": number(record.sigma_m)}}
    if not 0 <= index < len(regions):
        raise ValueError(f"expected the index of one of {len(regions)} regions, found {index}")
    region = regions[index]
    return {"reject": {"region": index, "class_before": region.class_before, "class_after": region.class_after,
                       "pixels": region.pixels, "requirement": record.requirement, "measured": number(record.measured),
                       "limit": number(record.limit), "unit": record.unit}}
