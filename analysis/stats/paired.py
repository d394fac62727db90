"""Means and paired differences of tables of runs, with their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

CELL = ("robots", "radius")
_PAIR = ["robots", "targets", "radius", "replicate", "seed"]


def half_width(se: NDArray[np.float64], count: NDArray[Any], level: float = 0.95) -> NDArray[np.float64]:
    """Return half the width of Student's confidence interval, which is infinite for a single run."""
    from scipy.special import stdtrit  # which takes long to import

    with np.errstate(invalid="ignore"):
        wide = stdtrit(np.maximum(count - 1, 1), 0.5 + level / 2) * se
    return np.where(count > 1, wide, np.inf)


class Interval(NamedTuple):
    """A mean and the ends of its confidence interval."""

    mean: float
    low: float
    high: float


def interval_of(values: NDArray[np.float64], level: float = 0.95) -> Interval:
    """Return the mean of values of shape (n,) with Student's interval, which is infinite for a single value."""
    mean, count = float(values.mean()), np.array(len(values))
    se = np.array(values.std(ddof=1) / np.sqrt(count) if count > 1 else np.nan)
    wide = float(half_width(se, count, level))
    return Interval(mean, mean - wide, mean + wide)


def clustered(values: NDArray[np.float64], weights: NDArray[np.float64]) -> Interval:
    """Return a weighted sum of the means of cells, with Student's interval over groups that run through many cells.

    Parameters
    ----------
    values : ndarray, shape (groups, ...), float64
        A value for each group and cell; NaN where there is none.
    weights : ndarray, shape (...), float64
        The weight of each cell.

    Notes
    -----
    What a group adds to the sum has a variance of its own, whatever its cells have in common (the robust variance of
    clusters: K.-Y. Liang and S. L. Zeger, "Longitudinal data analysis using generalized linear models", 1986). If all
    groups have a value in each cell, this is the interval of the groups' own sums.
    """
    values, weights = values[:, weights != 0], weights[weights != 0]
    count = np.isfinite(values).sum(axis=0)
    mean = np.nanmean(values, axis=0)
    # Unbiased, as a variance with one less than the number of values; the spread of a single one is not known.
    share = weights / np.sqrt(count * np.maximum(count - 1.0, 1.0))
    added = (np.nan_to_num(values - mean) * share).sum(axis=1)
    total, groups = float((weights * mean).sum()), np.isfinite(values).any(axis=1).sum() * (count.min() > 1)
    wide = float(half_width(np.sqrt((added**2).sum()), np.array(groups)))
    return Interval(total, total - wide, total + wide)


def cell_means(table: pd.DataFrame, value: str, by: Sequence[str] = CELL, level: float = 0.95) -> pd.DataFrame:
    """Return mean, standard error and confidence interval of `value` over the replicates of each cell.

    Parameters
    ----------
    table : DataFrame
        One row for each run.
    value : str
        Column to average.
    by : sequence of str
        Columns that identify a cell.
    level : float
        Confidence of the interval.

    Returns
    -------
    DataFrame
        Columns `by`, mean, se, low, high, count; se is NaN and the interval infinite for a single run.
    """
    grouped = table.groupby(list(by), sort=True)[value]
    cells = grouped.agg(mean="mean", se="sem", count="count").reset_index()
    wide = half_width(cells["se"].to_numpy(), cells["count"].to_numpy(), level)
    return cells.assign(low=cells["mean"] - wide, high=cells["mean"] + wide)


def paired(table: pd.DataFrame, base: pd.DataFrame, value: str = "observed_fraction") -> pd.DataFrame:
    """Return the paired differences of `value` in `table` and `base`, with the same scenario and noise in each pair.

    Returns
    -------
    DataFrame
        Columns robots, targets, radius, replicate, seed, with, without, difference.

    Raises
    ------
    ValueError
        If a run of one table has no counterpart in the other.
    """
    both = table[[*_PAIR, value]].merge(base[[*_PAIR, value]], on=_PAIR, suffixes=("_with", "_without"), validate="1:1")
    if len(both) != len(table) or len(both) != len(base):
        raise ValueError(
            f"{len(table)} and {len(base)} runs, of which {len(both)} match: both tables need the same scenarios, "
            "replicates and root seed"
        )
    both = both.rename(columns={f"{value}_with": "with", f"{value}_without": "without"})
    both["difference"] = both["with"] - both["without"]
    both.attrs["measures"] = ["difference", "with", "without"]
    return both


def grid_of(cells: pd.DataFrame, value: str = "mean") -> pd.DataFrame:
    """Return `value` as a table with a row for each team size and a column for each radius."""
    return cells.pivot(index="robots", columns="radius", values=value).sort_index(axis=0).sort_index(axis=1)


def percent(table: pd.DataFrame) -> pd.DataFrame:
    """Return the mean observed fraction of each cell [%]: rows are team sizes, columns radii."""
    return grid_of(cell_means(table, "observed_fraction")) * 100.0


def maxima(table: pd.DataFrame) -> pd.DataFrame:
    """Return the largest number of neighbours over the replicates of each cell: rows are team sizes, columns radii."""
    return table.pivot_table("max_neighbours", "robots", "radius", aggfunc="max")


def gain(table: pd.DataFrame, base: pd.DataFrame) -> pd.DataFrame:
    """Return the paired gain of each cell in percentage points: rows are team sizes, columns radii."""
    return grid_of(cell_means(paired(table, base), "difference")) * 100.0


def includes_zero(cells: pd.DataFrame) -> pd.DataFrame:
    """Return whether the confidence interval of each cell includes 0: rows are team sizes, columns radii."""
    return grid_of(cells.assign(open=(cells["low"] <= 0) & (cells["high"] >= 0)), "open")
