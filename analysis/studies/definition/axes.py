"""The values of an axis: a list, or a range with a step or a count, linear or logarithmic."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from decimal import Context, Decimal
from fractions import Fraction

import numpy as np

from teamsight.analysis.studies.definition.values import Table, frozen, text_of
from teamsight.core import checks

#: Settings of a study: each has an id, 8 bytes, and its place in the plan.
MOST_SETTINGS = 10_000_000

SCALES = ("linear", "log")
_KEYS = ("from", "to", "step", "count", "scale")
# Digits of the logarithms: enough that 0.01, 0.1, 1 are exact, on every machine.
_PRECISE = Context(prec=34)

Values = tuple[object, ...]


def axis_values(name: str, given: object) -> Values:
    """Return the values of an axis.

    Parameters
    ----------
    name : str
        Its parameter.
    given : object
        A list, tuple, range or array of different values; or a table with ``from``, ``to`` and either ``step`` or
        ``count``, and optionally ``scale``: "linear" or "log". Both ends belong to the axis, if a step reaches the
        second. Ranges are exact: 0.1 to 0.5 by 0.1 has 0.3, not 0.30000000000000004.

    Raises
    ------
    TypeError, ValueError
        If there are no values, two are equal, or a key is wrong.
    """
    where = f"axes.{name}"
    if isinstance(given, Mapping):
        return _range(where, given)
    if isinstance(given, range) and len(given) > MOST_SETTINGS:
        raise ValueError(f"{where}: has {len(given)} values, at most {MOST_SETTINGS}; give fewer")
    if isinstance(given, str) or not isinstance(given, (list, tuple, range, np.ndarray)):
        raise TypeError(
            f"{where}={checks.shown(given)}: must be a list of values, or a table such as "
            "{from = 1, to = 5, step = 1}; one value for all runs belongs in fixed"
        )
    values: Values = frozen(where, given)
    if not len(values):
        raise ValueError(f"{where}=[]: has no values; give at least one, or remove the axis")
    return values


def check_distinct(where: str, texts: Iterable[str], show: Callable[[int], object]) -> None:
    """Raise an error if two of the texts of values are equal."""
    first: dict[str, int] = {}
    for place, text in enumerate(texts):
        if first.setdefault(text, place) != place:
            raise ValueError(f"{where}: {checks.shown(show(place))} occurs twice; keep one, and raise replicates instead")


def _range(where: str, table: Mapping[str, object]) -> Values:
    for key in table:
        checks.choice(f"{where}: key", key, _KEYS)
    for key in ("from", "to"):
        if key not in table:
            raise ValueError(f"{where}: has no {key!r}; give from, to and step or count")
    if ("step" in table) == ("count" in table):
        raise ValueError(f"{where}: needs either step or count; give one of them")
    scale = checks.choice(f"{where}.scale", table.get("scale", "linear"), SCALES)
    first, last = (_number(f"{where}.{key}", table[key]) for key in ("from", "to"))
    if first >= last:
        raise ValueError(f"{where}: from={_shown(first)} must be less than to={_shown(last)}; exchange them")
    if "step" in table:
        if scale == "log":
            raise ValueError(f"{where}: a log scale has no step; give count")
        return _by_step(where, first, last, _number(f"{where}.step", table["step"]))
    cure = "a single value is written as a list" if table["count"] == 1 else "give fewer values"
    count = checks.count(f"{where}.count", table["count"], least=2, most=MOST_SETTINGS, cure=cure)
    if scale == "log":
        return logarithmic(where, first, last, count)
    ends = Fraction(Decimal(repr(first))), Fraction(Decimal(repr(last)))
    return _exact([ends[0] + (ends[1] - ends[0]) * i / (count - 1) for i in range(count)], first, last)


def _by_step(where: str, first: float, last: float, step: float) -> Values:
    if step <= 0:
        raise ValueError(f"{where}.step={_shown(step)}: must be greater than 0; give a positive one")
    start, end, width = (Fraction(Decimal(repr(value))) for value in (first, last, step))
    count = (end - start) // width + 1
    if count > MOST_SETTINGS:
        raise ValueError(f"{where}: has {count:.1e} values, at most {MOST_SETTINGS}; give a larger step")
    return _exact([start + i * width for i in range(count)], first, last, step)


def logarithmic(where: str, first: float, last: float, count: int) -> Values:
    """Return values whose ratios are equal; the ends are exact."""
    check_log(where, first)
    low, high = (_PRECISE.ln(Decimal(repr(value))) for value in (first, last))
    between = (
        _PRECISE.exp(low + _PRECISE.multiply(high - low, _PRECISE.divide(Decimal(i), Decimal(count - 1))))
        for i in range(1, count - 1)
    )
    # 12 digits, so that 1 is not 1.0000000000000000000000000001.
    return _exact([Fraction(Decimal(repr(first))), *(Fraction(f"{x:.12g}") for x in between), Fraction(Decimal(repr(last)))], first, last)


def check_log(where: str, first: float) -> None:
    """Raise an error if a log scale begins at 0 or below."""
    if first <= 0:
        raise ValueError(f"{where}: from={_shown(first)} must be greater than 0 on a log scale; give scale = 'linear'")


def _exact(values: list[Fraction], *given: float) -> Values:
    """Return whole numbers as integers, if all that was given are integers; otherwise the nearest floats."""
    if all(isinstance(one, int) for one in given) and all(value.denominator == 1 for value in values):
        return tuple(map(int, values))
    return tuple(map(float, values))


def _number(where: str, value: object) -> int | float:
    checks.number(where, value)
    found: int | float = frozen(where, value)
    return found


def _shown(value: float) -> str:
    return checks.shown(value)


def as_table(value: object) -> Table:
    """Return a mapping as a study holds it."""
    found: Table = frozen("table", value)
    return found


def texts_of(values: Values) -> list[str]:
    """Return the canonical text of each value."""
    return [text_of(value) for value in values]
