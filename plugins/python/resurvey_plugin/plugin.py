"""What every plugin has, and how it says that there is no answer."""

import json
import re
from typing import Any, Dict, Type

WIRE = 1
_CALLS = {"score": "matcher", "search": "matcher", "detect": "detector", "estimate": "estimator", "segment": "segmenter"}


class Failed(Exception):
    """There is no answer; the text says what was expected and what was found, and is shown to the user."""


class Cancelled(Exception):
    """The host wants the call to end."""


class Settings(dict):
    """The settings, checked and completed by the host: `settings.void` and `settings["void"]` are the same, also where a
    setting is called `items` or `values`."""

    def __getattribute__(self, name: str) -> Any:
        return self[name] if dict.__contains__(self, name) else super().__getattribute__(name)

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no setting {name!r} in SETTINGS; there are {', '.join(self) or 'none'}") from None


class Plugin:
    """Base of a plugin: `score`, `search`, `detect`, `estimate` or `segment` makes it one of a kind.

    An instance lives for a run and is called by one thread at a time. It has `settings` before its `__init__(self, settings)`
    begins, which is where weights are loaded.
    """

    NAME: str = ""
    VERSION: str = ""
    SUMMARY: str = ""
    SETTINGS: Dict[str, Dict[str, Any]] = {}
    """Name of a setting → its flat JSON schema: `type`, `default`, and where it helps `minimum`, `maximum`, `enum`,
    `description` (say the unit)."""

    settings: Settings

    def __new__(cls, settings: Settings):
        instance = super().__new__(cls)
        instance.settings = settings
        return instance

    def __init__(self, settings: Settings):
        pass


def hello(plugin):
    """What the class says of itself, as the wire has it."""
    calls = [call for call in _CALLS if callable(getattr(plugin, call, None))]
    kinds = sorted({_CALLS[call] for call in calls})
    if len(kinds) != 1:
        found = " and ".join(calls) or "none of them"
        raise TypeError(f"{plugin.__name__} needs score, search, detect, estimate or segment, found {found}")
    if not re.fullmatch(r"[a-z0-9-]{1,47}", plugin.NAME):
        raise ValueError(f"{plugin.__name__}.NAME: expected up to 47 of a-z, 0-9 and dashes, found {plugin.NAME!r}")
    for field, most in (("VERSION", 23), ("SUMMARY", 159)):
        text = getattr(plugin, field)
        if not text or not text.isprintable() or len(text.encode()) > most:
            raise ValueError(f"{plugin.__name__}.{field}: expected one line of up to {most} bytes, found {text!r}")
    words = {
        "wire": WIRE,
        "kind": kinds[0],
        "name": plugin.NAME,
        "version": plugin.VERSION,
        "summary": plugin.SUMMARY,
        "settings_schema": _schema(plugin.SETTINGS),
    }
    if kinds == ["matcher"]:
        words["form"] = "search" if "search" in calls else "score"
    return words


def declaration(plugin: Type[Plugin]) -> str:
    """The line that the file of the plugin holds, so that the host knows it without running it."""
    words = {key: value for key, value in hello(plugin).items() if key in ("wire", "kind", "name", "version", "summary")}
    return "# resurvey-plugin: " + json.dumps(words)


def _schema(settings):
    if not settings:
        return ""
    return json.dumps({"type": "object", "additionalProperties": False, "properties": settings})
