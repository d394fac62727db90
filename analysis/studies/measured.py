"""What a measure returns, as values of columns whose types do not depend on the run."""

from __future__ import annotations

import types
import typing
from collections.abc import Callable, Mapping
from functools import lru_cache
from numbers import Integral, Real

import numpy as np

from teamsight.core import checks

#: What a column holds: "int", "number", "flag" or "text"; None where it is not known.
Kind = str | None

_KINDS: dict[object, Kind] = {int: "int", float: "number", bool: "flag", str: "text"}
#: What a column holds, in words.
WORDS = {"int": "a whole number", "number": "a number", "flag": "True or False", "text": "a text"}
_MOST_INT = 2**63


class Measured(typing.NamedTuple):
    """The values of one run by column, and what each column holds."""

    values: dict[str, object]
    kinds: dict[str, Kind]


def measured_of(found: object, taken: frozenset[str], measure: Callable[..., object]) -> Measured:
    """Return the columns that a measure returned.

    Parameters
    ----------
    found : object
        A NamedTuple or a mapping of columns.
    taken : frozenset of str
        Names of the other columns.
    measure : callable
        The function that returned it; its annotation names the types of a mapping.

    Raises
    ------
    TypeError, ValueError
        If it is something else, or a value is no number, text, True, False or None.
    """
    if isinstance(found, tuple) and hasattr(found, "_asdict"):
        declared = _declared(type(found))
        found = found._asdict()
    else:
        declared = _returned(measure)
    if not isinstance(found, Mapping):
        raise TypeError(f"measure returned {type(found).__name__}: must be a NamedTuple or a mapping of columns")
    if not taken.isdisjoint(found):
        name = next(name for name in found if name in taken)
        raise ValueError(f"measure returned {name!r}: the table has this column; take another name")
    values: dict[str, object] = {}
    kinds: dict[str, Kind] = {}
    for name, value in found.items():
        if type(name) is not str or not name or not name.isascii():
            _check_name(name)
        kind = declared.get(name)
        if type(value) is float and kind in (None, "number"):  # the usual case
            values[name], kinds[name] = value, "number"
        else:
            values[name], kinds[name] = _value(name, value, kind)
    return Measured(values, kinds)


def _check_name(name: object) -> None:
    """Raise an error unless a file can hold the name of a column."""
    given = f"measure returned the name {checks.shown(name)}"
    if not isinstance(name, str) or not name:
        raise TypeError(f"{given}: must be a text, such as 'distance'")
    try:
        name.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{given}: has half a character, which no file can hold; leave it out") from None


def _value(name: object, value: object, kind: Kind) -> tuple[object, Kind]:
    """Return a value as its column holds it, and what the column holds."""
    if isinstance(value, (np.generic, np.ndarray)) and value.ndim == 0:
        value = value.item()
    if value is None:
        return None, kind
    if isinstance(value, str) and kind in (None, "text"):
        return value.encode("utf-8", "backslashreplace").decode(), "text"
    if kind == "flag" and isinstance(value, bool):
        return value, kind
    if kind == "int" and isinstance(value, Integral) and -_MOST_INT <= int(value) < _MOST_INT:
        return int(value), kind
    if kind in (None, "number") and isinstance(value, Real):
        return float(value), "number"
    wanted = "a number, a text, True, False or None" if kind is None else f"{WORDS[kind]}, as it is annotated"
    cure = "give its parts as columns of their own" if kind is None else "correct the annotation or the value"
    raise TypeError(f"measure returned {name}={checks.shown(value)}: must be {wanted}; {cure}")


@lru_cache(maxsize=64)
def _declared(kind: type) -> dict[str, Kind]:
    """Return what the fields of a NamedTuple or a TypedDict hold by their annotations."""
    try:
        hints = typing.get_type_hints(kind)
    except Exception:  # annotations may name what only a type checker imports
        hints = {}
    return {name: found for name, hint in hints.items() if (found := _KINDS.get(_without_none(hint))) is not None}


@lru_cache(maxsize=64)
def _returned(measure: Callable[..., object]) -> dict[str, Kind]:
    """Return what the columns hold by the annotation of a function's result."""
    hint = _result(measure)
    return _declared(hint) if hint is not None else {}


def declared_columns(measure: Callable[..., object]) -> dict[str, Kind] | None:
    """Return the columns that a measure returns by its annotation, and what each holds; None if it does not say.

    Parameters
    ----------
    measure : callable
        A function whose result is annotated as a NamedTuple or a TypedDict, or another.
    """
    hint = _result(measure)
    if hint is None or not (hasattr(hint, "_fields") or typing.is_typeddict(hint)):
        return None
    return dict.fromkeys(hint.__annotations__) | _declared(hint)


def _result(measure: Callable[..., object]) -> type | None:
    """Return the class that a function returns by its annotation; None if it does not say."""
    found = getattr(measure, "__annotations__", {}).get("return")
    if isinstance(found, str):
        # Alone: the annotations of its parameters may name what only a type checker imports.
        alone = types.SimpleNamespace(__annotations__={"return": found})
        try:
            found = typing.get_type_hints(alone, getattr(measure, "__globals__", {}))["return"]
        except Exception:
            return None
    return found if isinstance(found, type) and hasattr(found, "__annotations__") else None


def _without_none(hint: object) -> object:
    """Return T for ``T | None``."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        rest = [one for one in typing.get_args(hint) if one is not type(None)]
        return rest[0] if len(rest) == 1 else hint
    return hint
