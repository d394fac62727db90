"""Links: the task, the settings, the seed and the tick of a page, as its address has them after the #.

A link is read on the server, where each of its values is checked by its control; it names no file and no module.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Any, NamedTuple
from urllib.parse import parse_qsl

from teamsight.core import checks
from teamsight.core.component import number_in
from teamsight.live.controls import Control

#: The version of links; a page reads its own only.
VERSION = "1"
#: The latest tick to which a link leads.
MOST_TICK = 1_000_000
_MOST_FIELDS = 200
_OWN = ("v", "task", "seed", "tick", "two")
_RIGHT = "right."


class Link(NamedTuple):
    """What a link says.

    Attributes
    ----------
    task : str
        The name of the task or model.
    fields : dict of str to str
        All else, as texts.
    """

    task: str
    fields: dict[str, str]


def read(text: str) -> Link:
    """Return what a link says.

    Raises
    ------
    ValueError
        If it is damaged, or of another version.
    """
    try:
        pairs = parse_qsl(text, keep_blank_values=True, strict_parsing=True, max_num_fields=_MOST_FIELDS)
    except ValueError as error:
        raise ValueError(f"it is damaged ({error})") from None
    fields = dict(pairs)
    if len(fields) < len(pairs) or "v" not in fields or "task" not in fields:
        raise ValueError("it is damaged: it must have v and task, and each name once")
    if fields["v"] != VERSION:
        raise ValueError(f"it is of version {checks.shown(fields['v'])}, and this page reads {VERSION}; copy it again")
    del fields["v"]
    return Link(fields.pop("task"), fields)


def settings_of(
    link: Link, controls: Mapping[str, Control], given: Mapping[str, Any]
) -> tuple[list[dict[str, Any]], int | None, int]:
    """Return the arguments of each world, the seed, and the tick of a link.

    What it does not name has its default; of the given arguments only those stay that no page can set.

    Raises
    ------
    TypeError, ValueError
        If a name is no control, or its control refuses the value.
    """
    fields = dict(link.fields)
    seed = int(controls["seed"].checked(fields.pop("seed"))) if "seed" in controls and "seed" in fields else None
    tick = checks.count("tick", number_in(fields.pop("tick", "0")), least=0, most=MOST_TICK)
    is_pair = checks.choice("two", fields.pop("two", "no"), ("no", "yes")) == "yes"
    left = {name: one for name, one in given.items() if name not in controls or not _has_default(controls[name])}
    right: dict[str, Any] = {}
    for key, text in fields.items():
        name = key.removeprefix(_RIGHT)
        control = controls[checks.choice("link", name, tuple(controls))]
        if "." in name or name in _OWN or (key != name and not is_pair):
            raise ValueError(f"link={checks.shown(key)}: cannot be set by a link; leave it out")
        (right if key != name else left)[name] = control.checked(_value(control, text))
    return [left, {**left, **right}] if is_pair else [left], seed, tick


def _has_default(control: Control) -> bool:
    return control.declared.default is not MISSING


def _value(control: Control, text: str) -> Any:
    """Return a text as its control takes it."""
    if control.kind == "flag":
        return {"true": True, "false": False}.get(text, text)
    return number_in(text) if control.kind in ("integer", "number") else text
