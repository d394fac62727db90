"""The values of an axis: a list, or a range with a step or a count, linear or logarithmic."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Context, Decimal
from fractions import Fraction

import numpy as np

from teamsight.analysis.studies.definition import keys
from teamsight.analysis.studies.definition.values import frozen
from teamsight.core import checks

#: Settings of a study: each has an id of 8 bytes.
MOST_SETTINGS = 10_000_000

# Digits of logarithms: enough that 0.01, 0.1, 1 come out exactly, on every machine.
_PRECISE = Context(prec=34)

Values = tuple[object, ...]


def axis_values(name: str, given: object) -> Values:
    """Return the values of an axis.

    Parameters
    ----------
    name : str
        Its parameter.
    given : object
        A list, tuple, range or array of values; or a table with ``from``, ``to`` and either ``step`` or ``count``, and
        optionally ``scale``: "linear" or "log". Both ends belong to the axis, if a step reaches the second. Ranges are
        computed in decimal numbers: 0.1 to 0.5 by 0.1 has 0.3, not 0.30000000000000004.

    Raises
    ------
    TypeError, ValueError
        If there are no values, too many, or a key is wrong.
    """
    where = f"axes.{name}"
    if isinstance(given, Mapping):
        return _range(where, given)
    is_scalar = isinstance(given, np.ndarray) and given.ndim == 0
    if is_scalar or not isinstance(given, (list, tuple, range, np.ndarray)):
        raise TypeError(
            f"{where}={checks.shown(given)}: must be a list of values, or a table such as "
            "{from = 1, to = 5, step = 1}; one value for all runs belongs in fixed"
        )
    if len(given) > MOST_SETTINGS:
        raise ValueError(f"{where}: has {len(given):,} values, at most {MOST_SETTINGS:,}; give fewer")
    if not len(given):
        raise ValueError(f"{where}=[]: has no values; give at least one, or remove the axis")
    values: Values = frozen(where, given)
    return values


def check_ends(where: str, table: Mapping[str, object]) -> tuple[int | float, int | float]:
    """Return ``from`` and ``to`` of a table.

    Raises
    ------
    TypeError, ValueError
        If they are missing, no numbers, or not in this order.
    """
    for key in ("from", "to"):
        if key not in table:
            raise ValueError(f"{where}: has no {key!r}; give from and to, or a list of values")
    first, last = (_number(f"{where}.{key}", table[key]) for key in ("from", "to"))
    if first >= last:
        raise ValueError(f"{where}: from={first!r} must be less than to={last!r}; exchange them")
    return first, last


def check_log(where: str, first: float) -> None:
    """Raise an error if a log scale begins at 0 or below.

    Raises
    ------
    ValueError
        If it does.
    """
    if first <= 0:
        raise ValueError(f"{where}: from={first!r} must be greater than 0 on a log scale; give scale = 'linear'")


def _range(where: str, table: Mapping[str, object]) -> Values:
    for key in table:
        checks.choice(f"{where}: key", key, keys.RANGE)
    first, last = check_ends(where, table)
    if ("step" in table) == ("count" in table):
        raise ValueError(f"{where}: must have either step or count; give one of them")
    is_log = checks.choice(f"{where}.scale", table.get("scale", "linear"), keys.SCALES) == "log"
    if "step" in table:
        if is_log:
            raise ValueError(f"{where}.step={table['step']!r}: a log scale has no step; give count")
        return _by_step(where, first, last, _number(f"{where}.step", table["step"]))
    count = checks.count(
        f"{where}.count", table["count"], least=2, most=MOST_SETTINGS, cure="write few values as a list, or give fewer"
    )
    if is_log:
        check_log(where, first)
        return _distinct(where, count, _logarithmic(first, last, count))
    start, end = _exact(first), _exact(last)
    return _distinct(where, count, _arithmetic(start, (end - start) / (count - 1), count, (first, last)))


def _by_step(where: str, first: float, last: float, step: float) -> Values:
    if step <= 0:
        raise ValueError(f"{where}.step={step!r}: must be greater than 0; give a positive one")
    start, end, width = map(_exact, (first, last, step))
    count = (end - start) // width + 1
    if count > MOST_SETTINGS:
        raise ValueError(f"{where}: has {large(count)} values, at most {MOST_SETTINGS:,}; give a larger step")
    return _distinct(where, count, _arithmetic(start, width, count, (first, last, step)))


def _arithmetic(start: Fraction, width: Fraction, count: int, given: tuple[float, ...]) -> Values:
    """Return values of equal differences: integers, if all are whole and were given as such; else nearest floats."""
    whole = math.lcm(start.denominator, width.denominator)
    first, step = int(start * whole), int(width * whole)
    numerators = range(first, first + count * step, step)
    if whole == 1 and all(isinstance(one, int) for one in given):
        return tuple(numerators)
    return tuple(each / whole for each in numerators)


def _logarithmic(first: float, last: float, count: int) -> Values:
    """Return values of equal ratios; the ends are exact."""
    low, high = (_PRECISE.ln(Decimal(repr(value))) for value in (first, last))
    width = _PRECISE.divide(_PRECISE.subtract(high, low), Decimal(count - 1))
    logarithms = (_PRECISE.add(low, _PRECISE.multiply(width, Decimal(i))) for i in range(1, count - 1))
    values = [float(first), *(float(_PRECISE.exp(each)) for each in logarithms), float(last)]
    if isinstance(first, int) and isinstance(last, int) and all(value.is_integer() for value in values):
        return tuple(map(int, values))
    return tuple(values)


def large(number: int) -> str:
    """Return a whole number as errors show it, by its power of ten if it is too long to read."""
    return f"{number:,}" if number < 10**15 else f"about 10^{int(math.log10(number))}"


def _exact(value: float) -> Fraction:
    """Return a number as it is written, not as the binary number nearest to that."""
    return Fraction(Decimal(repr(value)))


def _distinct(where: str, count: int, values: Values) -> Values:
    """Refuse values so near to each other that floats do not tell them apart."""
    if len(set(values)) < count:
        raise ValueError(f"{where}: {count:,} values are too near to each other to differ; give fewer, or wider ends")
    return values


def _number(where: str, value: object) -> int | float:
    checks.number(where, value)
    found: int | float = frozen(where, value)
    return found
