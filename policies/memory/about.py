"""The description of a memory's table: numbers of inputs, names of facts, settings of the exploration."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from typing import Any

from teamsight.core import checks


def check_about(own: Any, added: Any, facts: Any, settings: Any) -> None:
    """Raise an error if the description of a memory is invalid; for its parts see `LazyMemory`.

    Raises
    ------
    TypeError, ValueError
        If a part has a wrong type or is outside its limits.
    """
    checks.count("own", own)
    checks.count("added", added, least=0)
    if not all(isinstance(name, str) for name in facts):
        raise TypeError(f"facts={checks.shown(facts)}: the name of a fact must be a string")
    if any(one >= other for one, other in itertools.pairwise(facts)):
        raise ValueError(f"facts={checks.shown(facts)}: must be distinct and in alphabetical order")
    try:
        "".join(facts).encode()
    except UnicodeEncodeError:
        raise ValueError(f"facts={checks.shown(facts)}: must be strings that UTF-8 can encode") from None
    if not isinstance(settings, Mapping):
        raise TypeError(f"settings={checks.shown(settings)}: must be a mapping")


def from_json(about: Mapping[str, Any]) -> tuple[int, int, tuple[str, ...], dict[str, Any]]:
    """Return own, added, facts and settings from the metadata of a file.

    Raises
    ------
    KeyError
        If one is missing.
    ValueError
        If there are others, or one has a wrong type.
    """
    names = ("own", "added", "facts", "settings")
    own, added, facts, settings = (about[name] for name in names)
    if others := sorted(set(about) - set(names)):
        raise ValueError(f"there are unknown entries, {checks.shown(others)}")
    if type(own) is not int or type(added) is not int:
        raise ValueError(f"own={checks.shown(own)}, added={checks.shown(added)}: must be whole numbers")
    if not isinstance(facts, list):
        raise ValueError(f"facts={checks.shown(facts)}: must be a list of strings")
    return own, added, tuple(facts), settings


def json_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of settings as JSON holds them.

    Raises
    ------
    ValueError
        If JSON cannot hold them.
    """
    try:
        text = json.dumps(dict(settings), ensure_ascii=False, allow_nan=False)
        text.encode()
        return dict(json.loads(text))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"settings: cannot be written as JSON ({error}); give numbers, strings and lists") from None
