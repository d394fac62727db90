"""Mean, 95 % interval and maximum of a measure, for each setting of a study."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.stats.paired import half_width

#: Columns of a summary, after those that name the setting.
STATISTICS = ("n", "mean", "low", "high", "maximum")


def summarise(values: NDArray[np.float64], cell: NDArray[np.int64], cells: int, level: float = 0.95) -> pd.DataFrame:
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
        Confidence of the interval of the mean, which is Student's.

    Returns
    -------
    DataFrame
        One row for each cell: n, the number of values; mean, low, high and maximum, NaN in a cell without values. The
        interval of a single value is infinite.
    """
    known = ~np.isnan(values)
    values, cell = values[known], cell[known]
    n = np.bincount(cell, minlength=cells)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(cell, values, cells) / n
        # Around the mean of the cell: a sum of squares around 0 would lose all digits of a small spread.
        squares = np.bincount(cell, (values - mean[cell]) ** 2, cells)
        se = np.sqrt(squares / (n - 1) / n)
    maximum = np.full(cells, -np.inf)
    np.maximum.at(maximum, cell, values)
    maximum[n == 0] = np.nan
    # Rounding moves the mean of equal values away from them.
    wide = half_width(se, n, level)
    return pd.DataFrame({"n": n, "mean": mean, "low": mean - wide, "high": mean + wide, "maximum": maximum})
