"""Percolation: how the largest component grows with the range, and from which range on it holds most robots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.cluster.hierarchy import DisjointSet
from scipy.sparse import coo_array, csgraph

from teamsight.analysis.contacts.frames import FrameSearch
from teamsight.analysis.stats import exceedance
from teamsight.analysis.stats.paired import Interval, half_width
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.world.arena import Arena

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

# Default number of ranges, and of the frames that decide how far they go.
_RANGES, _SAMPLED = 60, 20
#: The share of the robots that the largest component holds at the critical range.
CRITICAL_SHARE = 0.5


@dataclass(frozen=True)
class Percolation:
    """The largest component against the range.

    Attributes
    ----------
    curve : DataFrame
        One row a range: range [length]; share, the mean over frames of the share of the robots in the largest
        component, with low and high, its 95 % confidence interval; mean_degree.
    frames : DataFrame
        One row a frame with two robots or more: frame; critical, the smallest range at which a component holds half of
        the robots; connected, the smallest at which it holds all [length]; NaN where no range does, as on a torus.
    critical, connected : Interval
        Their means over frames, with 95 % confidence intervals.

    Notes
    -----
    Frames of one run are correlated: intervals are based on the effective number of independent ones, and are infinite
    where that is below two, as in a record of slow robots.
    """

    curve: pd.DataFrame
    frames: pd.DataFrame
    critical: Interval
    connected: Interval


class _Growth(NamedTuple):
    """One frame: the largest component after each edge, in the order of the ranges at which the edges appear."""

    range: Floats
    largest: Ints
    robots: int

    def reaching(self, robots: int) -> float:
        """Return the smallest range at which a component holds so many robots; infinite if none does."""
        place = int(np.searchsorted(self.largest, robots))
        return float(self.range[place]) if place < len(self.range) else np.inf


def percolation(
    position: ArrayLike,
    ranges: ArrayLike | None = None,
    arena: Arena | None = None,
    *,
    awareness_range: float | ArrayLike = 1.0,
    run: ArrayLike | None = None,
) -> Percolation:
    """Return how the largest component grows as the range does.

    Parameters
    ----------
    position : array_like of float, shape (frames, n, 2)
        Positions [length], NaN while a robot is not there; or `TemporalGraph.position`.
    ranges : array_like of float, optional
        Ranges of the curve [length]; by default 60, up to that which connects all robots.
    arena : Arena, optional
        Changes distances only if it is periodic, as a torus is.
    awareness_range : float or array_like of float, shape (n,)
        For robots of unequal ranges: the range of each is the common factor `range` times this. Two robots are
        neighbours if both sense each other.
    run : array_like, shape (frames,), optional
        Run of each frame, one run after the other. Runs are independent; frames of one run are correlated, and their
        effective number is estimated.

    Raises
    ------
    ValueError
        If no frame has two robots, a range is not above 0, or it is above half a side of a torus.
    """
    place = np.ascontiguousarray(position, float)
    if place.ndim != 3 or place.shape[2] != 2:
        raise ValueError(f"position: has the shape {place.shape}; give positions of shape (frames, robots, 2)")
    scale = np.array(np.broadcast_to(np.asarray(awareness_range, float), place.shape[1]))
    if not np.all(scale > 0) or not np.isfinite(scale).all():
        raise ValueError("awareness_range: must be finite and above 0 for every robot; give 1 for equal ranges")
    present = ~np.isnan(place[..., 0])
    counted = np.flatnonzero(present.sum(axis=1) >= 2)
    if not len(counted):
        raise ValueError("position: no frame has two robots or more; give frames with some")
    finder = _Finder(place, scale, arena)
    if ranges is None:
        shown = counted[np.unique(np.linspace(0, len(counted) - 1, _SAMPLED).astype(int))]
        top = max(finder.grown_until_connected(frame).range[-1] for frame in shown.tolist())
        grid = np.linspace(0, min(1.05 * top, finder.most), _RANGES + 1)[1:]
    else:
        grid = np.array([checks.number("ranges", one, above=0.0) for one in np.atleast_1d(np.asarray(ranges)).tolist()])
        grid.sort()
        if arena is not None:
            arena.check_reach(float(grid[-1] * scale.max()))
    return _gathered(finder, counted, grid, None if run is None else np.asarray(run)[counted])


def _gathered(finder: _Finder, counted: Ints, grid: Floats, run: NDArray[np.generic] | None) -> Percolation:
    share, degree = np.zeros((2, len(counted), len(grid)))
    reached = np.zeros((len(counted), 2))
    for at, frame in enumerate(counted.tolist()):
        growth = finder.grown_until_connected(frame, float(grid[-1]))
        edges = np.searchsorted(growth.range, grid, side="right")
        share[at] = np.append(1, growth.largest)[edges] / growth.robots
        degree[at] = 2.0 * edges / growth.robots
        half = int(np.ceil(CRITICAL_SHARE * growth.robots - 1e-9))
        reached[at] = growth.reaching(max(half, 2)), growth.reaching(growth.robots)
    reached[np.isinf(reached)] = np.nan
    frames = pd.DataFrame({"frame": counted, "critical": reached[:, 0], "connected": reached[:, 1]})
    mean, low, high = _means(share, exceedance.effective_number(share.mean(axis=1), run=run))
    curve = pd.DataFrame(
        {
            "range": grid,
            "share": mean,
            "low": np.maximum(low, 0),
            "high": np.minimum(high, 1),
            "mean_degree": degree.mean(axis=0),
        }
    )
    # NaN if there is no such range in some frame.
    critical, connected = (
        Interval(*map(float, _means(column, exceedance.effective_number(column, run=run))))
        if np.isfinite(column).all()
        else Interval(np.nan, np.nan, np.nan)
        for column in reached.T
    )
    return Percolation(curve, frames, critical, connected)


def _means(values: Floats, independent: float) -> tuple[Floats, Floats, Floats]:
    """Return the means over the first axis with 95 % intervals for so many independent values."""
    mean = values.mean(axis=0)
    spread = values.std(axis=0, ddof=1) if len(values) > 1 else np.full(mean.shape, np.nan)
    wide = half_width(spread / np.sqrt(independent), np.full(mean.shape, int(independent)))
    return mean, mean - wide, mean + wide


def _largest_components(one: Ints, other: Ints, size: int) -> Ints:
    """Return the size of the largest component after each edge is added, one for each pair; int64 of shape (m,)."""
    # scipy 1.13 takes no other integers.
    places = one.astype(np.int32), other.astype(np.int32)
    rank = coo_array((np.arange(1.0, len(one) + 1), places), shape=(size, size))
    # Only the edges of the spanning tree join two components.
    joining = np.sort(csgraph.minimum_spanning_tree(rank).data).astype(np.int64) - 1
    largest, sets = np.ones(len(one), np.int64), DisjointSet(range(size))
    for edge, low, high in zip(joining.tolist(), one[joining].tolist(), other[joining].tolist(), strict=True):
        sets.merge(low, high)
        largest[edge] = sets.subset_size(low)
    return np.maximum.accumulate(largest)


class _Finder:
    """The growth of the largest component in any frame."""

    def __init__(self, position: Floats, scale: Floats, arena: Arena | None) -> None:
        self._position, self._scale, self._arena = position, scale, arena
        period = np.array([0.0, 0.0] if arena is None else arena.period)
        self.most = float(period[period > 0].min() / 2 / scale.max()) if period.any() else np.inf
        self._searches: dict[float, FrameSearch] = {}
        sides = np.nanmax(position, axis=(0, 1)) - np.nanmin(position, axis=(0, 1))
        # Within the longest way all robots are connected.
        self._across = float(np.hypot(*sides) / scale.min()) + 1e-9
        self._latest = 2.0 * self._across / np.sqrt(position.shape[1])

    def grown_until_connected(self, frame: int, least: float = 0.0) -> _Growth:
        """Return the growth of a frame, at least up to a range, and until all robots are connected if they can be."""
        reach = min(max(self._latest, least), self.most)
        while True:
            growth = self._growth(frame, reach)
            if growth.reaching(growth.robots) < np.inf or reach >= min(self._across, self.most):
                return growth
            self._latest = reach = min(1.5 * reach, max(self._across, least), self.most)

    def _growth(self, frame: int, reach: float) -> _Growth:
        if reach not in self._searches:
            self._searches = {reach: FrameSearch(self._position, reach * self._scale, self._arena)}
        search = self._searches[reach]
        one, other, distance = search.edges(frame)
        factor = distance / np.minimum(self._scale[one], self._scale[other])
        once = (one < other) & (factor <= reach)
        order = np.argsort(factor[once], kind="stable")
        rows = np.flatnonzero(search.present[frame])
        nodes = [np.searchsorted(rows, side[once][order]) for side in (one, other)]
        return _Growth(factor[once][order], _largest_components(nodes[0], nodes[1], len(rows)), len(rows))
