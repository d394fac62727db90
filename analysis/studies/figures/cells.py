"""What a picture shows: settings by dimension, along which direction, their statistics, how a measure is written."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies.figures import KINDS
from teamsight.analysis.studies.summary import summarise
from teamsight.core import checks
from teamsight.core.component import number_in

# Values that an error lists.
_MOST_LISTED = 8
# Characters of a value that a picture shows.
_LONGEST_TEXT = 26
# A logarithmic scale is used from this ratio of the largest to the smallest value on.
_LEAST_RATIO = 8.0
# Digits of a quantity whose intervals are unknown.
_DIGITS = 3
_MOST_DECIMALS = 6
# Relative to the mean.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Dimension:
    """An axis, or axes that advance together, as levels: numbers in ascending order, texts in that of the study.

    Attributes
    ----------
    names : tuple of str
        The axes.
    texts : tuple of str
        What is written at each level.
    numbers : ndarray of float64, shape (levels,), or None
        The value of the first axis at each level; None if these are texts, or not different.
    levels : ndarray of int64, shape (settings,)
        The level of each setting.
    values : tuple of tuple
        The values of all axes at each level.
    """

    names: tuple[str, ...]
    texts: tuple[str, ...]
    numbers: NDArray[np.float64] | None
    levels: NDArray[np.int64]
    values: tuple[tuple[object, ...], ...]

    def __len__(self) -> int:
        return len(self.texts)

    @property
    def label(self) -> str:
        """The names of the axes as a picture writes them."""
        return ", ".join(name.replace("_", " ") for name in self.names)

    @property
    def is_logarithmic(self) -> bool:
        """Whether the numbers are spread more evenly on a logarithmic scale."""
        numbers = self.numbers
        if numbers is None or len(numbers) < 3 or numbers[0] <= 0 or numbers[-1] < _LEAST_RATIO * numbers[0]:
            return False
        return _unevenness(np.log(numbers)) < 0.5 * _unevenness(numbers)

    @property
    def places(self) -> NDArray[np.float64]:
        """Where each level is drawn: its number, or for texts 0, 1, 2, …."""
        return np.arange(len(self), dtype=float) if self.numbers is None else self.numbers

    def among(self, settings: NDArray[np.bool_]) -> Dimension:
        """Return the dimension of some settings; levels that none of them has are left out."""
        kept, levels = np.unique(self.levels[settings], return_inverse=True)
        return replace(
            self,
            texts=tuple(self.texts[level] for level in kept),
            numbers=None if self.numbers is None else self.numbers[kept],
            levels=levels,
            values=tuple(self.values[level] for level in kept),
        )


def dimension_of(settings: pd.DataFrame, names: Sequence[str]) -> Dimension:
    """Return the dimension of some axes of a table with one row for each setting."""
    levels = settings.groupby(list(names), sort=False, dropna=False).ngroup().to_numpy().astype(np.int64)
    values = list(settings[list(names)].drop_duplicates().itertuples(index=False, name=None))
    numbers = None
    if values and all(_is_number(value[0]) for value in values):
        numbers = np.array([value[0] for value in values], float)
        order = np.argsort(numbers, kind="stable")
        numbers, values = numbers[order], [values[place] for place in order]
        levels = np.argsort(order)[levels]
        if len(np.unique(numbers)) < len(numbers):
            numbers = None
    return Dimension(tuple(names), _texts(values), numbers, levels, tuple(values))


def text_of(value: object) -> str:
    """Return a value as a picture writes it: a number with four digits, a component by its name and its options."""
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if _is_number(value):
        number: Any = value
        return str(int(number)) if float(number).is_integer() and abs(number) < 1e7 else f"{number:.4g}"
    text = str(value)
    if text.startswith("{"):
        try:
            options = json.loads(text)
        except ValueError:
            return text
        name = text_of(str(options.pop("use", "")))
        return f"{name}({', '.join(f'{key}={text_of(one)}' for key, one in options.items())})"
    # A reference "package.module:Name".
    return text.rpartition(":")[2] if ":" in text and " " not in text else text


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _texts(values: Sequence[tuple[object, ...]]) -> tuple[str, ...]:
    """Return different texts for different values, short ones where possible."""
    long = [", ".join(map(text_of, value)) for value in values]
    half = _LONGEST_TEXT // 2
    # The beginning is what values often have in common.
    short = [text if len(text) <= _LONGEST_TEXT else f"{text[: half - 1]}…{text[-half:]}" for text in long]
    exact = [", ".join(map(str, value)) for value in values]
    return tuple(next((texts for texts in (short, long) if len(set(texts)) == len(texts)), exact))


def _unevenness(numbers: NDArray[np.float64]) -> float:
    steps = np.diff(numbers)
    return float(steps.std() / steps.mean())


@dataclass(frozen=True, eq=False)
class Cells:
    """The settings of a study with their statistics.

    Attributes
    ----------
    dimensions : tuple of Dimension
        The axes that vary.
    fixed : tuple of str
        The values that were chosen for other axes, as in "radius = 3".
    statistics : DataFrame
        One row for each setting: n, mean, low, high, maximum.
    values, setting : ndarray, shape (runs,)
        The value of each run, and the number of its setting.
    """

    dimensions: tuple[Dimension, ...]
    fixed: tuple[str, ...]
    statistics: pd.DataFrame
    values: NDArray[np.float64]
    setting: NDArray[np.int64]

    @property
    def is_grid(self) -> bool:
        """Whether the settings fill at least half of all combinations of the levels."""
        combinations = np.prod([float(len(dimension)) for dimension in self.dimensions])
        return bool(len(self.statistics) >= 0.5 * combinations)

    def named(self, option: str, name: str) -> Dimension:
        """Return the dimension that contains an axis; errors call it `option`.

        Raises
        ------
        ValueError
            If no axis that varies has this name.
        """
        checks.choice(option, name, [one for dimension in self.dimensions for one in dimension.names])
        return next(dimension for dimension in self.dimensions if name in dimension.names)

    def among(self, settings: NDArray[np.bool_], fixed: Sequence[str] = ()) -> Cells:
        """Return the cells of some settings; axes that no longer vary are left out."""
        found = [dimension.among(settings) for dimension in self.dimensions]
        of_runs = settings[self.setting]
        renumbered = np.cumsum(settings) - 1
        return Cells(
            tuple(dimension for dimension in found if len(dimension) > 1),
            (*self.fixed, *fixed),
            self.statistics[settings].reset_index(drop=True),
            self.values[of_runs],
            renumbered[self.setting[of_runs]],
        )


def cells_of(
    settings: pd.DataFrame, groups: Sequence[Sequence[str]], values: NDArray[np.float64], setting: NDArray[np.int64], *,
    are_flags: bool = False,
) -> Cells:  # fmt: skip
    """Return the cells of a study.

    Parameters
    ----------
    settings : DataFrame
        One row for each setting, with a column for each axis.
    groups : sequence of sequence of str
        The axes; those that advance together in one group.
    values, setting : ndarray, shape (runs,)
        The value of each run, and the number of its setting.
    are_flags : bool
        Whether the values are True and False; see `summarise`.
    """
    dimensions = [dimension_of(settings, group) for group in groups] if len(settings) else []
    statistics = summarise(values, setting, len(settings), are_flags=are_flags)
    return Cells(tuple(one for one in dimensions if len(one) > 1), (), statistics, values, setting)


def matching(settings: pd.DataFrame, where: Mapping[str, object]) -> NDArray[np.bool_]:
    """Return which settings have the given values.

    Parameters
    ----------
    settings : DataFrame
        One row for each setting, with a column for each axis.
    where : mapping
        The value of some axes; a text may spell a number.

    Raises
    ------
    TypeError
        If several values are given for one axis.
    ValueError
        If there is no such axis, or no setting with the value.
    """
    found = np.ones(len(settings), bool)
    for name, value in where.items():
        checks.choice("where", name, list(settings.columns))
        if isinstance(value, list | tuple | set | np.ndarray | pd.Series):
            raise TypeError(f"where={name}={checks.shown(value)}: must be one value; draw one picture for each")
        column = settings[name]
        has_value = np.array([is_same(one, value) for one in column.unique()], bool)
        if not has_value.any():
            values = [str(one) for one in column.unique()]
            listed = ", ".join(values[:_MOST_LISTED]) + ", …" * (len(values) > _MOST_LISTED)
            raise ValueError(f"where={name}={checks.shown(value)}: is no value of the study; give one of {listed}")
        found &= column.isin(column.unique()[has_value]).to_numpy()
    if not found.any():
        given = ", ".join(f"{name}={value}" for name, value in where.items())
        raise ValueError(f"where={given}: no setting of the study has these values together; leave one out")
    return found


def is_same(one: object, given: object) -> bool:
    """Whether two values are equal; a text may spell a number."""
    is_flag = isinstance(one, bool | np.bool_)
    return str(given) in (str(one), text_of(one)) or bool(not is_flag and one == number_in(given))


@dataclass(frozen=True)
class Quantity:
    """A measure, or the difference of a measure in two studies.

    Attributes
    ----------
    name : str
        Name of the measure; a fraction, whose name ends so, is written in percent.
    is_difference : bool
        Whether it is a difference, in which 0 is special.
    decimals : int
        Decimals of its numbers.
    """

    name: str
    is_difference: bool = False
    decimals: int = 1

    @property
    def is_percent(self) -> bool:
        """Whether it is written in percent."""
        return self.name.endswith("fraction")

    @property
    def factor(self) -> float:
        """What values are multiplied by before they are written."""
        return 100.0 if self.is_percent else 1.0

    @property
    def title(self) -> str:
        """The name in words."""
        words = self.name.replace("_", " ")
        return f"difference in {words}" if self.is_difference else words

    @property
    def label(self) -> str:
        """The name in words with its unit; of a difference, which is long, without the name of the measure."""
        if self.is_difference:
            return "difference" + "  [percentage points]" * self.is_percent
        return self.title + "  [%]" * self.is_percent

    def write(self, value: float) -> str:
        """Return a value in the unit of the quantity; a difference has a sign."""
        text = f"{value:{'+' if self.is_difference else ''}.{self.decimals}f}"
        # What rounds to 0 has no sign.
        text = text.lstrip("+-") if _is_zero(text) else text
        return text.replace("-", "−")

    def finer(self, wide: float, mean: float) -> Quantity:
        """Return the quantity with one more decimal where the half width of an interval would be written as 0."""
        text = f"{wide:.{self.decimals}f}"
        # The half width of equal values is 0 or a rounding error.
        is_hidden = np.isfinite(wide) and _is_zero(text) and wide > _ROUNDING * abs(mean)
        return replace(self, decimals=self.decimals + 1) if is_hidden else self

    def write_width(self, wide: float, mean: float) -> str:
        """Return the half width of an interval around a mean; see `finer`. What would still be 0 is "<" a limit."""
        own = self.finer(wide, mean)
        text = f"{wide:.{own.decimals}f}"
        return f"<{10.0**-own.decimals:.{own.decimals}f}" if own is not self and _is_zero(text) else text

    def fitted(self, mean: NDArray[np.float64], half_width: NDArray[np.float64]) -> Quantity:
        """Return the quantity with the decimals that half widths of intervals justify.

        Parameters
        ----------
        mean, half_width : ndarray of float64, shape (n,)
            Means and half widths in the unit of the quantity.
        """
        known = half_width[np.isfinite(half_width) & (half_width > _ROUNDING * np.abs(mean))]
        means = np.abs(mean[np.isfinite(mean)])
        if len(known):
            decimals = -np.floor(np.log10(np.median(known) / 2))
        elif len(means) and means.max() > 0 and (means % 1).any():
            decimals = _DIGITS - 1 - np.floor(np.log10(means.max()))
        else:
            decimals = 0
        return replace(self, decimals=int(np.clip(decimals, 0, _MOST_DECIMALS)))


def _is_zero(text: str) -> bool:
    return not any(digit in "123456789" for digit in text)


#: More panels, or more lines in one of them, cannot be read.
MOST_PANELS, MOST_LINES = 12, 10
# An axis with fewer numbers becomes lines beside each other rather than a side of a map.
_LEAST_SIDE = 3
# More combinations than settings by this factor are not drawn as a map unless they are few.
_MOST_EMPTY = 2500


class Choice(NamedTuple):
    """What is drawn along each direction."""

    kind: str
    x: Dimension | None = None
    y: Dimension | None = None
    panels: tuple[Dimension, ...] = ()


def choose(cells: Cells, kind: str = "auto", x: str | None = None, y: str | None = None) -> Choice:
    """Return what is drawn along each direction.

    Parameters
    ----------
    cells : Cells
        The settings.
    kind : str
        One of `KINDS`.
    x, y : str, optional
        The axes along the picture's two directions; lines have a line for each value of `y`.

    Raises
    ------
    ValueError
        If the axes do not suit the kind, or there would be too many panels or lines.
    """
    checks.choice("kind", kind, KINDS)
    given = [None if name is None else cells.named(option, name) for option, name in (("x", x), ("y", y))]
    if given[0] is not None and given[0] is given[1]:
        raise ValueError(f"y={y}: advances together with x={x}; give another axis")
    if kind == "auto":
        kind = _suitable(cells, given)
    if kind == "scatter":
        return Choice("scatter", given[0], given[1])
    if kind == "distribution":
        if given[0] is not None:
            raise ValueError(f"x={given[0].names[0]}: a distribution has the measure along x; give --y")
        across, up = None, given[1] or next(iter(cells.dimensions), None)
    else:
        if not cells.dimensions:
            raise ValueError(f"kind={kind}: needs an axis, but the study has one setting; give --kind distribution")
        across, up = _directions(cells, given)
        if kind == "heat-map" and up is None:
            raise ValueError(f"kind={kind}: needs two axes, but only {across.names[0]} varies; give --kind lines")
    rest = tuple(one for one in cells.dimensions if one is not across and one is not up)
    if (panels := int(np.prod([float(len(one)) for one in rest]))) > MOST_PANELS:
        names = ", ".join(one.names[0] for one in rest)
        raise ValueError(
            f"{names}: {panels:,} panels, one for each combination, at most {MOST_PANELS}; {_where(rest)}"
        )
    combinations = np.prod([float(len(one)) for one in (across, up, *rest) if one is not None])
    if across is not None and combinations > max(_MOST_EMPTY, 2 * len(cells.statistics)):
        raise ValueError(
            f"kind={kind}: the {len(cells.statistics):,} settings are no grid ({combinations:,.0f} combinations of "
            "their values); give --kind scatter"
        )
    if kind != "heat-map" and up is not None and len(up) > MOST_LINES:
        what, cure = ("curves", _where((up,))) if across is None else (
            "lines", f"give another --y, {_where((up,))}, or --kind heat-map"
        )  # fmt: skip
        raise ValueError(f"y={up.names[0]}: has {len(up)} values, at most {MOST_LINES} {what}; {cure}")
    return Choice(kind, across, up, rest)


def _suitable(cells: Cells, given: list[Dimension | None]) -> str:
    if not cells.dimensions:
        return "distribution"
    if not cells.is_grid:
        return "scatter"
    if len(cells.dimensions) == 1:
        return "lines"
    sides = _directions(cells, given)
    ordered = [one is not None and _is_side(one) for one in sides]
    few = sides[1] is not None and len(sides[1]) <= MOST_LINES
    # Two texts have no order in which a line could connect them.
    return "lines" if ordered == [True, False] and few else "heat-map"


def _directions(cells: Cells, given: list[Dimension | None]) -> tuple[Dimension, Dimension | None]:
    """Return x and y; those that are not given are the first axes that are left, those of many numbers first."""
    free = sorted((one for one in cells.dimensions if one not in given), key=lambda one: not _is_side(one))
    x = given[0] or free.pop(0)
    return x, given[1] or (free.pop(0) if free else None)


def _is_side(dimension: Dimension) -> bool:
    return dimension.numbers is not None and len(dimension) >= _LEAST_SIDE


def panels_of(choice: Choice, settings: int) -> list[tuple[str, NDArray[np.bool_]]]:
    """Return title and settings of each panel."""
    found = []
    for levels in product(*(range(len(one)) for one in choice.panels)):
        chosen = list(zip(choice.panels, levels, strict=True))
        title = ", ".join(f"{one.label} = {one.texts[level]}" for one, level in chosen)
        own = np.ones(settings, bool)
        for one, level in chosen:
            own &= one.levels == level
        found.append((title, own))
    return found


def _where(dimensions: tuple[Dimension, ...]) -> str:
    widest = max(dimensions, key=len)
    # The value alone: texts are shortened, and those of axes that advance together are joined.
    given = f"{widest.names[0]}={text_of(widest.values[0][0])}"
    return f"choose a value, as in --where {shlex.quote(given)}"
