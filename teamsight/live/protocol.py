"""The messages between the page and the server.

The server sends frames as binary messages and all else as JSON with a ``type``; the page sends JSON only. A message of
the page names one of `KINDS`, has exactly its fields, and each has a value that its check accepts.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

from teamsight.core import checks
from teamsight.core.references import said
from teamsight.live.interventions import MOST_CORNERS

#: The longest message of a page [bytes].
MOST_BYTES = 8192
#: The fastest simulation that can be asked for [steps/s]; None stands for as fast as possible.
LEAST_RATE, MOST_RATE = 0.1, 10_000.0
#: Of how many steps one is drawn, at most.
MOST_EVERY = 10_000
#: Runs of each world in a band, and ticks of each run.
LEAST_RUNS, MOST_RUNS, MOST_TICKS = 8, 64, 100_000
#: Characters of a link, at most.
MOST_LINK = 4000
#: Coordinates of what a page draws, at most [length].
MOST_PLACE = 1e9
_FRAME, _HISTORY = 1, 2
_HEAD = struct.Struct("<BBHI")


class Message(NamedTuple):
    """A message of a page: one of `KINDS`, and its other fields, which have been checked."""

    type: str
    fields: dict[str, Any]


def _name(name: str, value: Any, what: str = "a control") -> str:
    if not isinstance(value, str):
        raise TypeError(f"{name}={checks.shown(value)}: must be a text, the name of {what}")
    return value


def _or_none(check: Callable[..., Any], **limits: Any) -> Callable[[str, Any], Any]:
    return lambda name, value: None if value is None else check(name, value, **limits)


def _points(name: str, value: Any) -> list[tuple[float, float]]:
    """Return corners that a page has drawn; a circle has its centre and a point on it."""
    if not isinstance(value, list) or not 2 <= len(value) <= MOST_CORNERS:
        raise ValueError(f"{name}={checks.shown(value)}: must be a list of 2 to {MOST_CORNERS} points; draw it simpler")
    pairs = [one if isinstance(one, list) and len(one) == 2 else [None, None] for one in value]
    return [(_coordinate(name, x), _coordinate(name, y)) for x, y in pairs]


def _short(name: str, value: Any) -> str:
    """Return the text of a link; it is read where the controls are known."""
    if not isinstance(value, str) or len(value) > MOST_LINK:
        raise ValueError(f"{name}={checks.shown(value)}: must be a text of at most {MOST_LINK:,} characters")
    return value


_coordinate = partial(checks.number, least=-MOST_PLACE, most=MOST_PLACE)
_BODY = partial(checks.count, least=0, most=2**53)
# Where it was done, in worlds that were built when, and whether to both.
_WHERE: dict[str, Callable[[str, Any], Any]] = {
    "track": partial(checks.count, least=0, most=1), "both": checks.flag, "run": partial(_name, what="a run"),
}  # fmt: skip
_TICK = _or_none(checks.count, least=0, most=2**53)
# Of worlds that were built when, from which tick to which; None for the newest frames.
_TICKS: dict[str, Callable[[str, Any], Any]] = {"run": _WHERE["run"], "first": _TICK, "last": _TICK}

#: The messages of pages, and for each field its check; a control checks its value itself.
KINDS: dict[str, dict[str, Callable[[str, Any], Any]]] = {
    "ack": {"frame": partial(checks.count, least=0, most=2**32 - 1)},
    "run": {},
    "pause": {},
    "step": {},
    "reset": {},
    "set": {"name": _name, "value": lambda name, value: value, "track": _or_none(checks.count, least=0, most=1)},
    "rate": {"value": _or_none(checks.number, least=LEAST_RATE, most=MOST_RATE)},
    "every": {"value": partial(checks.count, most=MOST_EVERY)},
    "compare": {"on": checks.flag},
    "chart": {"name": partial(_name, what="a measure"), "on": checks.flag},
    "band": {
        "runs": partial(checks.count, least=LEAST_RUNS, most=MOST_RUNS),
        "ticks": _or_none(checks.count, most=MOST_TICKS),
    },
    "drop": {},
    "save": {},
    # What a film of these ticks would be; such a film; and no film, after all.
    "reel": _TICKS,
    "film": _TICKS,
    "cancel": {},
    "move": {**_WHERE, "body": _BODY, "x": _coordinate, "y": _coordinate},
    "switch": {**_WHERE, "body": _BODY, "on": checks.flag},
    "remove": {**_WHERE, "body": _BODY},
    "add": {**_WHERE, "group": partial(checks.count, least=0, most=1000), "x": _coordinate, "y": _coordinate},
    "obstruct": {
        **_WHERE, "shape": lambda name, value: checks.choice(name, value, ("circle", "polygon")), "points": _points,
    },
    "clear": _WHERE,
    "open": {"link": _short},
    "task": {"name": _name},
    "preset": {"name": _name},
    "row": {"run": _name},
    "copy": {"form": lambda name, value: checks.choice(name, value, ("command", "Python", "link"))},
}  # fmt: skip
#: Those that change bodies or obstacles.
INTERVENTIONS = ("move", "switch", "remove", "add", "obstruct", "clear")


def parsed(data: str | bytes, kinds: Mapping[str, Mapping[str, Callable[[str, Any], Any]]] = KINDS) -> Message:
    """Return the message that a page has sent.

    Parameters
    ----------
    data : str or bytes
        The message.
    kinds : mapping
        The messages that there are, as `KINDS`.

    Raises
    ------
    TypeError, ValueError
        If it is no such message.
    """
    if not isinstance(data, str):
        raise TypeError(f"a binary message of {len(data)} bytes: pages send JSON")
    try:
        found = json.loads(data, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{checks.shown(data)}: is not JSON ({type(error).__name__})") from None
    if not isinstance(found, dict):
        raise TypeError(f"{checks.shown(data)}: must be an object with a type")
    kind = checks.choice("type", found.pop("type", None), kinds)
    fields = kinds[kind]
    if found.keys() != fields.keys():
        have, want = (", ".join(sorted(names)) or "no fields" for names in (found, fields))
        raise ValueError(f"{kind}: must have {want}, not {checks.shown(have)}")
    return Message(kind, {name: check(name, found[name]) for name, check in fields.items()})


def _refuse(text: str) -> Any:
    raise ValueError(f"{text} is not a number of JSON")


def text(kind: str, **fields: Any) -> str:
    """Return a message of the server; numbers that are not finite become null."""
    return json.dumps({"type": kind, **_finite(fields)}, separators=(",", ":"), allow_nan=False)


def refusal(error: BaseException, labels: Mapping[str, str] = MappingProxyType({}), kind: str = "") -> str:
    """Return the message for an error, in the words of the page.

    Parameters
    ----------
    error : BaseException
        The error.
    labels : mapping of str to str
        What the page calls the arguments that it may name.
    kind : str
        Before it: which message of the page it answers.
    """
    return text("error", message=checks.in_words(" ".join(f"{kind}{said(error)}".split()), labels))


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if value - value == 0.0 else None
    if isinstance(value, dict):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(one) for one in value]
    return value


def frame_message(track: int, number: int, block: bytes) -> bytes:
    """Return the binary message of a frame: its head, then the raw block of `teamsight.view`.

    Parameters
    ----------
    track : int
        0, or 1 for the world on the right.
    number : int
        The number of the frame since the server has started; the page acknowledges it.
    block : bytes
        The frame.
    """
    return _HEAD.pack(_FRAME, track, 0, number % 2**32) + block


def history_message(track: int, blocks: list[bytes]) -> bytes:
    """Return the binary message of the frames before, the oldest first: their number; each with its size before it."""
    sized = (len(block).to_bytes(4, "little") + block for block in blocks)
    return _HEAD.pack(_HISTORY, track, 0, len(blocks)) + b"".join(sized)
