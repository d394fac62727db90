"""What the numbers of a memory mean: how many inputs there are, the names of the facts, the settings behind them."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping
from typing import Any

from teamsight.core import checks


def check_about(own: Any, added: Any, facts: Any, settings: Any) -> None:
    """Refuse what no memory is about.

    Parameters
    ----------
    own, added : int
        Components of a situation.
    facts : tuple of str
        Names in alphabetical order.
    settings : mapping
        What made the pairs.

    Raises
    ------
    TypeError, ValueError
        If one is of another type or outside its limits.
    """
    checks.count("own", own)
    checks.count("added", added, least=0)
    if not all(isinstance(name, str) for name in facts):
        raise TypeError(f"facts={checks.shown(facts)}: the name of a fact must be a text")
    if any(one >= other for one, other in itertools.pairwise(facts)):
        raise ValueError(f"facts={checks.shown(facts)}: must be distinct and in alphabetical order")
    try:
        "".join(facts).encode()
    except UnicodeEncodeError:
        raise ValueError(f"facts={checks.shown(facts)}: must be texts that UTF-8 can hold") from None
    if not isinstance(settings, Mapping):
        raise TypeError(f"settings={checks.shown(settings)}: must be a mapping")


def from_json(about: Mapping[str, Any]) -> tuple[int, int, tuple[str, ...], dict[str, Any]]:
    """Return own, added, facts and settings, as the metadata of a file tell them.

    Raises
    ------
    KeyError
        If one is missing.
    ValueError
        If there is anything else, or a number is no integer or the facts are no list.
    """
    own, added, facts, settings = (about[name] for name in ("own", "added", "facts", "settings"))
    if len(about) > 4:
        raise ValueError(f"holds also {checks.shown(sorted(set(about) - {'own', 'added', 'facts', 'settings'}))}")
    if type(own) is not int or type(added) is not int:
        raise ValueError(f"own={checks.shown(own)}, added={checks.shown(added)}: must be whole numbers")
    if not isinstance(facts, list):
        raise ValueError(f"facts={checks.shown(facts)}: must be a list of texts")
    return own, added, tuple(facts), settings


def json_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of what JSON can hold.

    Raises
    ------
    ValueError
        If it cannot.
    """
    try:
        text = json.dumps(dict(settings), ensure_ascii=False, allow_nan=False)
        text.encode()
        return dict(json.loads(text))
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"settings: cannot be kept as JSON ({error}); give numbers, texts and lists") from None
