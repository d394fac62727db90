"""Mean, 95 % interval and maximum of a measure, for each setting of a study."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtri

from teamsight.analysis.stats.paired import half_width

Floats = NDArray[np.float64]


def summarise(
    values: Floats, cell: NDArray[np.int64], cells: int, level: float = 0.95, *, are_flags: bool = False
) -> pd.DataFrame:
    """Return the statistics of the values in each cell.

    Parameters
    ----------
    values : ndarray of float64, shape (n,)
        One value for each run; NaN is left out.
    cell : ndarray of int64, shape (n,)
        The cell of each run, from 0.
    cells : int
        Number of cells.
    level : float
        Confidence of the interval of the mean.
    are_flags : bool
        Whether the values are True and False. Their mean is a rate, whose interval is Wilson's; that of numbers is
        Student's.

    Returns
    -------
    DataFrame
        One row for each cell: n, the number of values; mean, low, high and maximum, NaN in a cell without values. The
        interval of a single number is infinite, that of a rate within [0, 1]. Student's interval supposes that means
        are about normally distributed: of few values near a bound, as of fractions near 1, it may end beyond the bound
        and is too narrow if all of them are equal.
    """
    known = ~np.isnan(values)
    values, cell = values[known], cell[known]
    n, mean, low, high, _ = intervals(values, cell, cells, level, are_flags=are_flags)
    maximum = np.full(cells, -np.inf)
    np.maximum.at(maximum, cell, values)
    maximum[n == 0] = np.nan
    return pd.DataFrame({"n": n, "mean": mean, "low": low, "high": high, "maximum": maximum})


def intervals(
    values: Floats, cell: NDArray[np.int64], cells: int, level: float = 0.95, *, are_flags: bool = False
) -> tuple[NDArray[np.int64], Floats, Floats, Floats, Floats]:
    """Return n, mean, low, high, and the width of the interval, of the values in each cell; see `summarise`."""
    n = np.bincount(cell, minlength=cells)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell, values, cells) / n
        if are_flags:
            low, high = wilson(mean, n, level)
            return n, mean, low, high, high - low
        # Around the mean of the cell: a sum of squares around 0 would lose all digits of a small spread.
        squares = np.bincount(cell, (values - mean[cell]) ** 2, cells)
        wide = half_width(np.sqrt(squares / (n - 1) / n), n, level)
    return n, mean, mean - wide, mean + wide, 2.0 * wide


def wilson(rate: Floats, n: NDArray[np.int64], level: float = 0.95) -> tuple[Floats, Floats]:
    """Return the ends of Wilson's confidence intervals of rates, (cells,); NaN where `n` is 0.

    Parameters
    ----------
    rate : ndarray of float64, shape (cells,)
        The share of True among the values.
    n : ndarray of int64, shape (cells,)
        The numbers of values.
    level : float
        Confidence.
    """
    z = ndtri(0.5 + level / 2)
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = (rate + z * z / (2 * n)) / (1 + z * z / n)
        wide = z / (1 + z * z / n) * np.sqrt(rate * (1 - rate) / n + (z / (2 * n)) ** 2)
    # Rounding must not put the rate outside, as 0 or 1 at the end of its interval.
    return np.minimum(np.clip(middle - wide, 0.0, 1.0), rate), np.maximum(np.clip(middle + wide, 0.0, 1.0), rate)
