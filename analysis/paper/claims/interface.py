"""What a claim is: words from the paper, a rule, and the function that applies the rule to tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from teamsight.analysis.stats.paired import cell_maxima, cell_means, grid_of, paired

#: One row a run, by name of the experiment.
Tables: TypeAlias = Mapping[str, pd.DataFrame]

#: The arena radii between which the paper finds that awareness matters.
PREFERRED = (2.0, 6.0)
#: By how many se the worst of a surface's cells or pairs of cells may lie on the wrong side. With 3, as first chosen,
#: noise alone would fail one of the some 500 pairs of a flat surface more often than not; see docs/claims.md.
CHANCE = 4.5
# Distances stay finite, and those of claims that differ above 1.
_LARGE, _LEAST = 1e9, 1e-6


class Verdict(NamedTuple):
    """What was measured, and whether the claim holds by its rule."""

    holds: bool
    measured: str
    #: How far the measurement is from the paper's figure, in tolerances of the rule: up to 1 holds.
    distance: float


@dataclass(frozen=True)
class Claim:
    """One statement of the paper that a simulation can check.

    Parameters
    ----------
    name : str
        Identifies the claim.
    where : str
        Section and figure of the paper.
    statement : str
        The claim in words.
    figure : str
        The number that the paper gives, in words where it gives none.
    rule : str
        The statistic and the tolerance by which `judge` decides.
    judge : callable
        Takes the tables and returns the verdict.
    needs : tuple of str
        Experiments whose tables `judge` reads.
    """

    name: str
    where: str
    statement: str
    figure: str
    rule: str
    judge: Callable[[Tables], Verdict]
    needs: tuple[str, ...] = ()


def within(value: float, target: float, tolerance: float) -> float:
    """Return the distance of `value` from `target` in tolerances."""
    return abs(value - target) / tolerance


def at_most(value: float, limit: float) -> float:
    """Return a distance of up to 1 when `value` is at most `limit`, and of one more for each `limit` above it."""
    return max(0.0, value / limit) if value <= limit else 1.0 + max(_LEAST, (value - limit) / limit)


def at_least(value: float, limit: float) -> float:
    """Return 0 when `value` is at least `limit`, else 1 plus what is missing of it."""
    return 0.0 if value >= limit else 1.0 + max(_LEAST, (limit - value) / max(abs(limit), 1.0))


def above(value: float, limit: float) -> float:
    """Return 0 when `value` is above `limit`, else 1 plus what is missing."""
    return 0.0 if value > limit else 1.0 + max(_LEAST, (limit - value) / max(abs(limit), 1.0))


def verdict(measured: str, *distances: float) -> Verdict:
    """Return the verdict of a rule with several parts: all of them have to hold."""
    worst = max(distances)
    return Verdict(worst <= 1.0, measured, min(worst, _LARGE))


def percent(table: pd.DataFrame) -> pd.DataFrame:
    """Return cell means of the observed fraction in per cent: rows are team sizes, columns radii."""
    return grid_of(cell_means(table, "observed_fraction")) * 100.0


def maxima(table: pd.DataFrame) -> pd.DataFrame:
    """Return the largest degree over the replicates of each cell: rows are team sizes, columns radii."""
    return grid_of(cell_maxima(table, "max_neighbours"))


def gain(table: pd.DataFrame, base: pd.DataFrame) -> pd.DataFrame:
    """Return the paired gain of each cell in percentage points: rows are team sizes, columns radii."""
    return grid_of(cell_means(paired(table, base), "difference")) * 100.0


class Peak(NamedTuple):
    """The largest value of a grid and where it is."""

    value: float
    robots: int
    radius: float


def peak(grid: pd.DataFrame) -> Peak:
    """Return the largest value of `grid`; the first of equals, by team size and then by radius."""
    values = grid.to_numpy(dtype=float)
    row, column = divmod(int(np.argmax(values)), values.shape[1])
    return Peak(float(values[row, column]), int(np.asarray(grid.index)[row]), float(np.asarray(grid.columns)[column]))


def average(grid: pd.DataFrame) -> float:
    """Return the mean over all cells."""
    return float(grid.to_numpy(dtype=float).mean())


def part(grid: pd.DataFrame, robots: tuple[int, int], radius: tuple[float, float]) -> pd.DataFrame:
    """Return the cells within the limits, both ends included.

    Raises
    ------
    ValueError
        If the grid has no such cell: the rule cannot be applied.
    """
    rows, columns = np.asarray(grid.index, dtype=float), np.asarray(grid.columns, dtype=float)
    found = grid.iloc[
        np.flatnonzero((rows >= robots[0]) & (rows <= robots[1])),
        np.flatnonzero((columns >= radius[0]) & (columns <= radius[1])),
    ]
    if found.empty:
        raise ValueError(f"no cell with {robots[0]}..{robots[1]} robots and radius {radius[0]:g}..{radius[1]:g}")
    return found
