"""What a picture shows: the settings of a study with their statistics, by dimension."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.studies.figures.dimension import Dimension, dimension_of
from teamsight.analysis.studies.results import summarise
from teamsight.core import checks

# Values that an error lists.
_MOST_LISTED = 8


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
    from teamsight.analysis.studies.figures.dimension import text_of

    if one == given or str(one) == str(given) or text_of(one) == str(given):
        return True
    if isinstance(one, int | float | np.number) and not isinstance(one, bool) and isinstance(given, str):
        try:
            return float(one) == float(given)
        except ValueError:
            return False
    return False
