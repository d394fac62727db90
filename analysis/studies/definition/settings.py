"""The settings of a study as a product: axes, zipped axes, points and samples, crossed with each other.

An axis is a list, or a range with a step or a count; points list settings one by one; a sample is a Sobol sequence or a
Latin hypercube. The keys of their tables are declared here, for the checks and for the JSON Schema.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING
from decimal import Context, Decimal
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple, TypeGuard

import numpy as np

from teamsight.analysis.studies.definition.values import Table, frozen, stored, text_of, thawed
from teamsight.core import checks
from teamsight.core.component import Allowed, Declared

#: Settings of a study: each has an id of 8 bytes.
MOST_SETTINGS = 10_000_000

# Digits of logarithms: enough that 0.01, 0.1, 1 come out exactly, on every machine.
_PRECISE = Context(prec=34)

Values = tuple[Any, ...]


def _number(name: str, value: object, above: float | None = None) -> Any:
    """Return a number as it was given: a whole one makes whole values."""
    checks.number(name, value, above=above)
    return frozen(name, value)


def _keys(*declared: Declared) -> Mapping[str, Declared]:
    return {one.name: one for one in declared}


_NUMBER, _ABOVE_0 = Allowed(check=_number), Allowed(above=0, check=partial(_number, above=0))
_SCALE = Allowed(choices=("linear", "log"))
_FEWER = ("write few values as a list", "give fewer")

#: The keys of an axis that is a range.
RANGE = _keys(
    Declared("from", "number", MISSING, _NUMBER, "The first value."),
    Declared("to", "number", MISSING, _NUMBER, "The last value, if the step reaches it."),
    Declared("step", "number", None, _ABOVE_0, "The distance between two values; in place of count."),
    Declared(
        "count", "integer", None, Allowed(least=2, most=MOST_SETTINGS, cure=_FEWER),
        "The number of values; in place of step.",
    ),
    Declared("scale", "choice", "linear", _SCALE, "Whether differences or ratios of values are equal."),
)  # fmt: skip
#: The keys of an axis of a sample.
SAMPLE_AXIS = _keys(
    Declared("from", "number", MISSING, _NUMBER, "The smallest value."),
    Declared("to", "number", MISSING, _NUMBER, "The largest value."),
    Declared("scale", "choice", "linear", _SCALE, "Whether values or their logarithms are uniform."),
    Declared("integer", "flag", False, Allowed(), "Whether values are whole numbers."),
)
#: The keys of a sample.
SAMPLE = _keys(
    Declared(
        "method", "choice", MISSING, Allowed(choices=("sobol", "latin-hypercube")),
        "A scrambled Sobol sequence, or a Latin hypercube.",
    ),
    Declared(
        "count", "integer", MISSING, Allowed(least=1, most=MOST_SETTINGS, cure=("remove the sample", "give fewer")),
        "The number of settings; a power of 2 for sobol.",
    ),
    Declared(
        "seed", "integer", 0, Allowed(least=0, most=checks.MOST_SEED),
        "The seed of the sample; it has nothing to do with that of the runs.",
    ),
    Declared("axes", "mapping", MISSING, Allowed(), "The parameters that are sampled."),
)  # fmt: skip


def table_of(where: str, given: object, known: Mapping[str, Declared]) -> dict[str, Any]:
    """Return the values of a table of a study, those that are not given by default.

    Parameters
    ----------
    where : str
        Its name in errors.
    given : object
        The table.
    known : mapping of str to Declared
        The keys that it may have; those without a default must be given.

    Raises
    ------
    TypeError, ValueError
        If it is no table, or a key or a value is wrong.
    """
    needed = [name for name, one in known.items() if one.default is MISSING]
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a table with {' and '.join(needed or known)}")
    for key in given:
        checks.choice(f"{where}: key", key, known)
    for name in needed:
        if name not in given:
            raise ValueError(f"{where}: has no {name!r}; give {' and '.join(needed)}")
    return {
        name: one.checked(given[name], f"{where}.{name}") if name in given else one.default
        for name, one in known.items()
    }


def _ends(where: str, table: Mapping[str, Any]) -> tuple[Any, Any, bool]:
    """Return both ends of a range, and whether its scale is logarithmic."""
    first, last, is_log = table["from"], table["to"], table["scale"] == "log"
    if first >= last:
        raise ValueError(f"{where}: from={first!r} must be less than to={last!r}; exchange them")
    if is_log and first <= 0:
        raise ValueError(f"{where}: from={first!r} must be greater than 0 on a log scale; give scale = 'linear'")
    return first, last, is_log


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
    other = "a table such as {from = 1, to = 5, step = 1}; one value for all runs belongs in fixed"
    return _column(where, given, other)


def _column(where: str, given: object, other: str) -> Values:
    """Return listed values; what is no list could be `other`."""
    if not _is_list(given):
        raise TypeError(f"{where}={checks.shown(given)}: must be a list of values, or {other}")
    _check_count(where, len(given), "give fewer")
    if not len(given):
        raise ValueError(f"{where}=[]: has no values; give at least one, or remove it")
    values: Values = frozen(where, given)
    return values


def _is_list(given: object) -> TypeGuard[Sequence[object]]:
    return isinstance(given, (list, tuple, range)) or (isinstance(given, np.ndarray) and given.ndim > 0)


def _check_count(where: str, count: int, cure: str) -> None:
    if count > MOST_SETTINGS:
        raise ValueError(f"{where}: has {large(count)} values, at most {MOST_SETTINGS:,}; {cure}")


def _range(where: str, given: Mapping[str, object]) -> Values:
    table = table_of(where, given, RANGE)
    first, last, is_log = _ends(where, table)
    step, count = table["step"], table["count"]
    if (step is None) == (count is None):
        raise ValueError(f"{where}: must have either step or count; give one of them")
    if is_log and step is not None:
        raise ValueError(f"{where}.step={step!r}: a log scale has no step; give count")
    # Numbers as they are written, not the binary numbers nearest to them.
    start, end, width = (Fraction(Decimal(repr(one))) for one in (first, last, step or 0))
    if count is None:
        count = (end - start) // width + 1
        _check_count(where, count, "give a larger step")
    else:
        width = (end - start) / (count - 1)
    if is_log:
        values = _logarithmic(first, last, count)
    else:
        whole = math.lcm(start.denominator, width.denominator)
        low, wide = int(start * whole), int(width * whole)
        values = tuple(range(low, low + count * wide, wide))
        if whole > 1 or not all(isinstance(one, int) for one in (first, last, step or 0)):
            values = tuple(each / whole for each in values)
    # So near to each other that floats do not tell them apart.
    if len(set(values)) < count:
        raise ValueError(f"{where}: {count:,} values are too near to each other to differ; give fewer, or wider ends")
    return values


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


def columns_of(where: str, given: Any) -> Table:
    """Return settings that are listed one by one, as columns of equal lengths: tuples by name.

    Parameters
    ----------
    where : str
        The name used in errors.
    given : object
        A mapping of names to lists, or a DataFrame of pandas or polars.

    Raises
    ------
    TypeError, ValueError
        If it is not, has no rows, columns of different lengths, or a value that no study can hold, such as NaN.
    """
    if isinstance(given, str):
        raise TypeError(f"{where}={checks.shown(given)}: is read in study files only; give pandas.read_csv(…) here")
    if hasattr(given, "columns"):
        names = list(given.columns)
        if len(set(names)) < len(names):
            raise ValueError(f"{where}: the table has a column twice; keep one")
        given = {name: np.asarray(given[name]).tolist() for name in names}
    if not isinstance(given, Mapping):
        raise TypeError(f"{where}={checks.shown(given)}: must be a mapping of parameters to lists, or a DataFrame")
    if not given:
        raise ValueError(f"{where}: has no rows; give at least one, or remove it")
    check_names(where, given)
    lengths = {name: len(values) for name, values in given.items() if _is_list(values)}
    if len(set(lengths.values())) > 1:
        raise ValueError(
            f"{where}: columns have different lengths, {checks.shown(lengths)}; give as many values in each"
        )
    return Table({name: _column(f"{where}.{name}", values, "a DataFrame") for name, values in given.items()})


def check_names(where: str, given: Mapping[Any, object]) -> None:
    """Refuse a table of parameters of which a name is no text."""
    for name in given:
        if not isinstance(name, str):
            raise TypeError(f"{where}: the name {checks.shown(name)} must be a text, such as 'robots'")


def sample_of(given: object) -> Table | None:
    """Return the columns of a sample: those given, or those that its method draws.

    Parameters
    ----------
    given : mapping, optional
        ``method``, ``count``, ``seed`` (0 by default) and ``axes``, of which each has ``from`` and ``to``, and may have
        ``scale`` and ``integer``; or the columns themselves.

    Raises
    ------
    TypeError, ValueError
        If a key or a value is wrong.
    """
    if given is None:
        return None
    if isinstance(given, Mapping) and given and all(map(_is_list, given.values())):
        return columns_of("sample", given)
    sample = table_of("sample", given, SAMPLE)
    count = sample["count"]
    if not sample["axes"]:
        raise ValueError("sample.axes={}: has no axes; give some, as radius = {from = 2, to = 9}")
    axes = {str(name): table_of(f"sample.axes.{name}", one, SAMPLE_AXIS) for name, one in sample["axes"].items()}
    if sample["method"] == "sobol" and count & (count - 1):
        below = 1 << (count.bit_length() - 1)
        raise ValueError(f"sample.count={count}: must be a power of 2 for method 'sobol'; give {below} or {2 * below}")
    from scipy.stats import qmc

    kind = qmc.Sobol if sample["method"] == "sobol" else qmc.LatinHypercube
    ranges = {name: (*_ends(f"sample.axes.{name}", axis), axis["integer"]) for name, axis in axes.items()}
    generator = np.random.default_rng(sample["seed"])
    try:
        engine = kind(len(axes), rng=generator)
    except TypeError:  # before scipy 1.15
        engine = kind(len(axes), seed=generator)
    unit = np.asarray(engine.random(count), np.float64)
    columns = {name: _scaled(name, unit[:, i], *one) for i, (name, one) in enumerate(ranges.items())}
    distinct = max(len(set(column)) for column in columns.values())
    if distinct < count:
        distinct = len(set(zip(*columns.values(), strict=True)))
    if distinct < count:
        raise ValueError(
            f"sample.count={count}: gives only {distinct} different settings, because axes are integer; give fewer, or "
            "wider axes"
        )
    return columns_of("sample", columns)


def _scaled(name: str, unit: Any, low: float, high: float, is_log: bool, is_integer: bool) -> list[Any]:
    """Return the values of an axis at some places between 0 and 1."""
    if is_integer and not (isinstance(low, int) and isinstance(high, int)):
        raise ValueError(
            f"sample.axes.{name}: from={low} and to={high} must be whole numbers if integer = true; round them"
        )
    end = high + is_integer
    if is_log:
        logarithms = math.log(low) + (math.log(end) - math.log(low)) * unit
        # Logarithms differ in the last digits between machines; the settings, and so their ids, must not.
        values = np.array([float(f"{value:.12g}") for value in np.exp(logarithms).tolist()])
    else:
        values = low + (end - low) * unit
    found: list[Any] = np.clip(np.floor(values) if is_integer else values, low, high).tolist()
    return list(map(int, found)) if is_integer else found


class Block(NamedTuple):
    """Parameters that advance together: one axis, a group of zipped axes, points or a sample.

    Attributes
    ----------
    where : str
        Its name in errors.
    columns : mapping of str to tuple
        Values of each parameter, of equal lengths.
    """

    where: str
    columns: Mapping[str, Values]

    @property
    def size(self) -> int:
        """How many values each parameter has."""
        return len(next(iter(self.columns.values())))


def blocks_of(
    axes: Mapping[str, Values],
    zipped: Sequence[Sequence[str]],
    points: Mapping[str, Values] | None,
    sample: Mapping[str, Values] | None,
) -> tuple[Block, ...]:
    """Return what is crossed, in order: the last varies fastest. A group of zipped axes has the place of its first.

    Raises
    ------
    ValueError
        If a group names an unknown axis, or axes of unequal lengths.
    """
    group_of: dict[str, Sequence[str]] = {name: (name,) for name in axes}
    for group in zipped:
        for name in group:
            if not axes:
                raise ValueError(f"zip={checks.shown(group)}: there are no axes; give some, or remove zip")
            checks.choice("zip", name, axes)
            if len(group_of[name]) > 1 or group.count(name) > 1:
                raise ValueError(f"zip: {name!r} occurs twice; keep it in one group")
        if len({len(axes[name]) for name in group}) > 1:
            text = ", ".join(f"{name} has {len(axes[name])}" for name in group)
            raise ValueError(f"zip: {text} values; axes that advance together must have equally many")
        group_of |= dict.fromkeys(group, group)
    groups = dict.fromkeys(tuple(group_of[name]) for name in axes)
    blocks = [Block(f"axes.{'+'.join(group)}", {one: axes[one] for one in group}) for group in groups]
    blocks += [Block(where, each) for where, each in (("points", points), ("sample", sample)) if each is not None]
    return tuple(blocks)


def check_blocks(blocks: Sequence[Block], fixed: Iterable[str]) -> int:
    """Return the number of settings, which are not built.

    Raises
    ------
    ValueError
        If a parameter is given twice, there are too many settings, or two are equal.
    """
    places = dict.fromkeys(fixed, "fixed")
    for block in blocks:
        for name in block.columns:
            if name in places:
                raise ValueError(f"{block.where}: {name!r} is also in {places[name]}; give it in one of them")
            places[name] = block.where
    settings = math.prod(block.size for block in blocks)
    if settings > MOST_SETTINGS:
        sizes = " × ".join(str(block.size) for block in blocks)
        raise ValueError(f"axes: {sizes} = {large(settings)} settings, at most {MOST_SETTINGS:,}; give fewer values")
    for block in blocks:
        for name, values in block.columns.items():
            # Values that results could not tell apart, as 1 and "1" in a column of texts.
            known = {value for value in values if isinstance(value, str)}
            for value in values if known else ():
                if not isinstance(value, str) and (text := stored(thawed(value), "text")) in known:
                    same = f"{checks.shown(value)} and the text {checks.shown(text)}"
                    raise ValueError(f"{name}: has {same}, which are the same in results; give one")
        _check_distinct(block)
    return settings


def _check_distinct(block: Block) -> None:
    columns = tuple(block.columns.values())
    try:
        # Quickly, for millions of rows; True and 1 are one value here and two below.
        if any(len(set(rows)) == block.size for rows in (*columns, zip(*columns, strict=True))):
            return
    except TypeError:  # tables cannot be in sets
        pass
    first: dict[tuple[str, ...], int] = {}
    for row, texts in enumerate(zip(*(map(text_of, column) for column in columns), strict=True)):
        if first.setdefault(texts, row) != row:
            shown = {name: column[row] for name, column in block.columns.items()}
            raise ValueError(
                f"{block.where}: {checks.shown(shown)} occurs twice (as value {first[texts] + 1} and {row + 1}); keep "
                "one, and raise replicates if more runs are wanted"
            )
