"""Values of parameters as a study holds them: texts, numbers, booleans, null, lists and tables, all immutable."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import Any, NoReturn

import numpy as np

from teamsight.analysis.runs.seeds import canonical
from teamsight.analysis.studies.definition.components import described
from teamsight.core import checks

#: Whole numbers are kept as 64-bit integers.
MOST_INTEGER = 2**63 - 1
#: Lists and tables within each other.
MOST_LEVELS = 16
#: Characters of a text.
MOST_CHARACTERS = 10_000

_SCALARS = frozenset({int, float, bool, str})


class Table(dict[str, Any]):
    """A mapping that cannot be changed."""

    def _refuse(self, *_: object, **__: object) -> NoReturn:
        raise TypeError("a study cannot be changed; make another one, as with dataclasses.replace(study, steps=100)")

    __setitem__ = __delitem__ = __ior__ = _refuse  # type: ignore[assignment]
    clear = pop = popitem = setdefault = update = _refuse  # type: ignore[assignment]

    def __reduce__(self) -> tuple[type[Table], tuple[dict[str, Any]]]:
        return Table, (dict(self),)


def frozen(name: str, value: object, level: int = 0) -> Any:
    """Return a value as a study holds it: lists as tuples, tables as `Table`, components as references.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : object
        A text, number, boolean or None; a list, array or mapping of such; or a component.
    level : int
        How many lists and tables this value is in.

    Raises
    ------
    TypeError, ValueError
        If a study cannot hold the value.
    """
    if level > MOST_LEVELS:
        raise ValueError(f"{name}: has more than {MOST_LEVELS} lists and tables within each other; make it flatter")
    if value is None or isinstance(value, (bool, np.bool_)):
        return value if value is None else bool(value)
    if isinstance(value, str):
        return _text(name, str(value))
    if isinstance(value, Integral):
        return _integer(name, int(value))
    if isinstance(value, Real):
        return checks.number(name, value, cure="give one, or remove it")
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"{name}: the key {checks.shown(key)} must be a text")
        return Table({str(key): frozen(f"{name}.{key}", one, level + 1) for key, one in value.items()})
    if isinstance(value, np.ndarray):
        return frozen(name, value.tolist(), level)
    if isinstance(value, (list, tuple, range)) and not hasattr(value, "_fields"):
        plain = _plain(value)
        return tuple(frozen(f"{name}[{i}]", one, level + 1) for i, one in enumerate(value)) if plain is None else plain
    return frozen(name, described(name, value), level)


def _plain(values: Sequence[object]) -> tuple[Any, ...] | None:
    """Return a tuple of valid numbers and booleans, of which there may be millions, at once; None for any other."""
    kinds = set(map(type, values))
    if not kinds <= {int, float, bool}:
        return None
    found: tuple[Any, ...] = tuple(values)
    if int in kinds and not -MOST_INTEGER <= min(found) <= max(found) <= MOST_INTEGER:
        return None
    return found if float not in kinds or all(map(math.isfinite, found)) else None


def _integer(name: str, value: int) -> int:
    if not -MOST_INTEGER <= value <= MOST_INTEGER:
        raise ValueError(f"{name}={checks.shown(value)}: must be between -(2^63 - 1) and 2^63 - 1; give a smaller one")
    return value


def _text(name: str, value: str) -> str:
    if len(value) > MOST_CHARACTERS:
        raise ValueError(f"{name}={checks.shown(value)}: must have at most {MOST_CHARACTERS} characters; shorten it")
    try:
        value.encode()
    except UnicodeEncodeError as error:  # half a character, as in "\ud800"
        raise ValueError(f"{name}={checks.shown(value)}: is no valid text; remove odd characters") from error
    return value


def thawed(value: object) -> Any:
    """Return a value of a study with lists and dictionaries, as JSON and models have them."""
    if isinstance(value, dict):
        return {name: thawed(one) for name, one in value.items()}
    if not isinstance(value, tuple):
        return value
    return list(value) if set(map(type, value)) <= _SCALARS else [thawed(one) for one in value]


def text_of(value: object) -> str:
    """Return one text for equal values: 2 and 2.0 give the same, also within lists and tables."""
    return canonical(thawed(value) if isinstance(value, (dict, tuple)) else value)


def are_equal(one: object, other: object) -> bool:
    """Whether two values of a study are equal; 2 and 2.0 are, True and 1 are not."""
    return one is other or (one == other and text_of(one) == text_of(other))


def check_distinct(name: str, values: Sequence[object]) -> None:
    """Refuse values of a parameter that results could not tell apart, as 1 and "1" in a column of texts.

    Raises
    ------
    ValueError
        If there are such values.
    """
    texts = {value for value in values if isinstance(value, str)}
    if not texts:
        return
    for value in values:
        if not isinstance(value, str) and stored(thawed(value), "text") in texts:
            text = checks.shown(stored(thawed(value), "text"))
            same = f"{checks.shown(value)} and the text {text}"
            raise ValueError(f"{name}: has {same}, which are the same in results; give one")


def stored(value: object, kind: str) -> int | float | bool | str:
    """Return a value as a column of results holds it.

    Parameters
    ----------
    value : object
        A value of a parameter, JSON-like.
    kind : str
        The type of its column: "int", "number", "flag" or "text". In a column of texts, what is not a text is JSON.
    """
    if kind == "text":
        return value if isinstance(value, str) else json.dumps(value, sort_keys=True, ensure_ascii=False)
    made = {"int": int, "number": float, "flag": bool}[kind]
    result: int | float | bool = made(value)  # type: ignore[arg-type]
    return result
