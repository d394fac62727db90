"""What awareness adds to learned teams: the gain of each cell, one surface for each exploration."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.stats.paired import Interval, interval_of, paired


class Gains(NamedTuple):
    """A gain by exploration and cell.

    Attributes
    ----------
    values : ndarray, shape (explorations, team sizes, radii), float64
        The gain [percentage points].
    robots : ndarray, shape (team sizes,), int64
        Team sizes, ascending.
    radius : ndarray, shape (radii,), float64
        Radii of the arena, ascending.
    """

    values: NDArray[np.float64]
    robots: NDArray[np.int64]
    radius: NDArray[np.float64]

    @property
    def mean(self) -> NDArray[np.float64]:
        """The mean surface, shape (team sizes, radii)."""
        return np.asarray(self.values.mean(axis=0))

    def average(self) -> Interval:
        """Return the mean over all cells, with its interval over explorations."""
        return interval_of(self.values.mean(axis=(1, 2)))


def gains_of(table: pd.DataFrame, base: pd.DataFrame) -> Gains:
    """Return the paired gain of one experiment over another; replicate k of every cell is exploration k."""
    runs = paired(table, base)
    grid = runs.pivot(index="replicate", columns=["robots", "radius"], values="difference").sort_index(axis=1)
    robots, radius = (np.unique(runs[name].to_numpy()) for name in ("robots", "radius"))
    return Gains(100.0 * grid.to_numpy().reshape(len(grid), len(robots), len(radius)), robots, radius)
