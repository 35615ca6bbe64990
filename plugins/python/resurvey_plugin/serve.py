"""The conversation of docs/plugin-wire.md: calls of the host become calls of the author's class."""

import json
import os
import stat
import sys
import traceback
from typing import Type

import numpy as np

from . import words
from .host import Host, ask, views
from .link import Ended, Link
from .plugin import Cancelled, Failed, Plugin, Settings, hello
from .records import Comparison, Localization, Photo, Place, Region, Reject, Remove

_REGIONS_IN_A_MESSAGE = 500
_TEXT_BYTES = 10_000
_OWN = os.path.dirname(os.path.abspath(__file__))


def main(plugin: Type[Plugin]) -> None:
    """Serves `plugin` to the host that started this process; returns when the host is done."""
    words_of_plugin = hello(plugin)
    if not stat.S_ISSOCK(os.fstat(1).st_mode):
        raise SystemExit(f"{plugin.NAME} is a plugin: the host starts it. Try resurvey plugins check {sys.argv[0]}")
    serve(plugin, words_of_plugin, Link.of_this_process())


def serve(plugin, words_of_plugin, link):
    """Serves over `link` until it ends."""
    try:
        link.send("hello", words_of_plugin)
        instance = None
        while True:
            call, value = link.receive()
            instance = _answer(link, plugin, instance, call, value)
    except Ended:
        return


def _answer(link, plugin, instance, call, value):
    """Answers one call; gives the instance for the next."""
    link.grown_to(value.get("memory") or value.get("comparison", {}).get("memory", 0))
    done = {}
    try:
        if call == "create":
            instance = plugin(Settings(json.loads(value["settings"] or "{}")))
        elif call == "destroy":
            instance = None
        elif call in _SERVED:
            done = _SERVED[call](link, instance, value)
        else:
            raise ValueError(f"expected a call of wire 1, found {call}")
    except Ended:
        raise
    except Cancelled:
        link.send("cancelled", {})
    except Failed as failure:
        if link.cancelled():
            link.send("cancelled", {})
        else:
            link.send("failed", {"text": words.text(failure, _TEXT_BYTES)})
    except BaseException as error:  # A SystemExit of the author is a bug as well, and is told as one.
        traceback.print_exc()
        link.send("panicked", {"text": _told(error)})
    else:
        link.send("done", done)
    return instance


def _told(error):
    """The error, and the line of the author's file it came through last."""
    text = "".join(traceback.format_exception_only(type(error), error)).strip()
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if os.path.dirname(os.path.abspath(frame.filename)) != _OWN]
    place = f" ({os.path.basename(own[-1].filename)}:{own[-1].lineno})" if own else ""
    return words.text(text, _TEXT_BYTES) + place


def _score(link, instance, value):
    photo, scores = link.lent(value["photo"]), link.place(value["scores"])
    for index, view in enumerate(views(link, value["views"])):
        if link.cancelled():
            raise Cancelled
        scores[index] = _number(instance.score(photo, view))
        link.scored_one()
    return {}


def _number(score):
    if isinstance(score, np.ndarray) and score.ndim:
        raise TypeError(f"expected score to return a number from 0 to 1, found an array of shape {score.shape}")
    if score is None or isinstance(score, (str, bytes)):
        raise TypeError(f"expected score to return a number from 0 to 1, found {type(score).__name__}")
    return float(score)


def _listed(found, call, *records):
    """The records that a call returned, one after the other or as a list."""
    names = " or ".join(record.__name__ for record in records)
    if not hasattr(found, "__iter__"):
        raise TypeError(f"expected {call} to return a list of {names}, found {type(found).__name__}; [] is none")
    listed = list(found)
    for one in listed:
        if not isinstance(one, records):
            raise TypeError(f"expected {call} to return a list of {names}, found {type(one).__name__} in it")
    return listed


def _search(link, instance, value):
    photo = Photo(link.lent(value["photo"]), words.camera(value["camera"]), words.prior(value["prior"]))
    found = instance.search(photo, Host(link, value))
    if not isinstance(found, Localization):
        raise TypeError(f"expected search to return a Localization, found {type(found).__name__}")
    heat = np.asarray(found.heat, dtype="<f8").reshape(-1, 3)
    most = max(1, value["scratch"]["bytes"] // 24)
    for start in range(0, len(heat), most):
        cells, _ = link.put(heat[start:start + most], value["scratch"]["offset"])
        ask(link, "heat", {"cells": cells})
    return {"localization": words.localization(found)}


def _detect(link, instance, value):
    regions = _listed(instance.detect(_comparison(link, value), Host(link, value)), "detect", Region)
    rows, columns = value["photo"]["shape"]
    for region in regions:
        shape = np.shape(region.mask)
        if len(shape) != 2 or shape[0] > rows or shape[1] > columns:
            found = " × ".join(map(str, shape)) or "one value"
            raise ValueError(f"expected a mask within the photo of {rows} × {columns} pixels, found {found}")
    start, scratch = 0, value["scratch"]
    while start < len(regions):
        offset, message = scratch["offset"], []
        for region in regions[start:start + _REGIONS_IN_A_MESSAGE]:
            mask = (np.asarray(region.mask) != 0).astype("u1")
            if message and offset + mask.nbytes > scratch["offset"] + scratch["bytes"]:
                break
            words_of_mask, offset = link.put(mask, offset)
            message.append(_region(region, mask, words_of_mask))
        ask(link, "regions", message)
        start += len(message)
    return {}


def _region(region, mask, words_of_mask):
    left, top = int(region.left), int(region.top)
    bounds = [left, top, left + mask.shape[1], top + mask.shape[0]]
    return {"class_before": int(region.class_before), "class_after": int(region.class_after), "bounds": bounds,
            "pixels": int(np.count_nonzero(mask)), "mask": words_of_mask}


def _estimate(link, instance, value):
    comparison = value["comparison"]
    regions = [Region(item["class_before"], item["class_after"], item["bounds"][0], item["bounds"][1],
                      link.lent(item["mask"])) for item in value["regions"]]
    found = instance.estimate(_comparison(link, comparison), regions, Host(link, comparison))
    proposals = [words.proposal(one, regions) for one in _listed(found, "estimate", Place, Remove, Reject)]
    for start in range(0, len(proposals), _REGIONS_IN_A_MESSAGE):
        ask(link, "proposals", proposals[start:start + _REGIONS_IN_A_MESSAGE])
    return {}


def _comparison(link, value):
    view, = views(link, value["views"])
    return Comparison(link.lent(value["photo"]), view, words.camera(value["camera"]), words.estimate(value["estimate"]))


def _segment(link, instance, value):
    photo = link.lent(value["photo"])
    rows, columns, _ = photo.shape
    labels = np.asarray(instance.segment(photo, Host(link, value)))
    if labels.shape != (rows, columns) or labels.dtype.kind not in "iu":
        raise TypeError(f"expected segment to return {rows} × {columns} whole numbers, found an array of shape "
                        f"{labels.shape} and type {labels.dtype}")
    # Another one would wrap to a class: 256 to stone, and -1, as some networks call what they ignore, to VOID by chance.
    if labels.size and (labels.min() < 0 or labels.max() > 255):
        raise ValueError(f"expected labels from 0 to 255, found {labels.min()} to {labels.max()}; what is no class is VOID")
    link.place(value["labels"])[...] = labels
    return {}


_SERVED = {"score": _score, "search": _search, "detect": _detect, "estimate": _estimate, "segment": _segment}
