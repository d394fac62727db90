"""The neighbour search: it finds, once per step, which bodies are within range of which.

Few bodies are compared pair by pair, in loops that use SIMD lanes. Many are sorted into square cells as wide as the
longest range, and each is compared with those in the nine cells around it. Both methods give the same edges in the same
order and with the same bits.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record
from teamsight.core.neighbour_list import NeighbourList, filled, neighbour_room
from teamsight.world.arena import Arena, kernel_period
from teamsight.world.proximity.cells import Cells, Grid, search_cells
from teamsight.world.proximity.edges import Observed
from teamsight.world.proximity.pairs import FAR_AWAY, search_pairs
from teamsight.world.proximity.shapes import shape_number

__all__ = ["NeighbourList", "Search", "proximity_graph"]

# For more pairs than this, cells are faster (benchmarks/crossover.py).
MOST_PAIRS = 6_000
MOST_PAIRS_ON_TORUS = 1_500

_LANES = 16

Floats = npt.NDArray[np.float64]


class Searching(NamedTuple):
    """The record of a search.

    Attributes
    ----------
    position : ndarray, shape (n, 2), float64
        The observers.
    reach : ndarray, shape (n,), float64
        The range of each; below 0 for one that finds nobody.
    observed : Observed
        The observed bodies.
    grid, cells
        The cells, and room to sort bodies into them; without columns all pairs are compared.
    neighbours : NeighbourList
        Written, as far as there is room.
    """

    position: Annotated[Floats, "n", 2]
    reach: Annotated[Floats, "n"]
    observed: Observed
    grid: Grid
    cells: Cells
    neighbours: NeighbourList


SEARCHING = Record(Searching)
searching_at = SEARCHING.at


def _pairs(address: int) -> int:
    """Fill the neighbour list of a record; return the number of entries that it needs, even if there is less room."""
    s = searching_at(address)
    return search_pairs(s.position, s.reach, s.observed, s.neighbours)


def _cells(address: int) -> int:
    s = searching_at(address)
    return search_cells(s.position, s.reach, s.observed, s.grid, s.cells, s.neighbours)


PAIRS, CELLS = Entry(_pairs), Entry(_cells)


class Search:
    """A neighbour search that can be repeated on the same arrays.

    Parameters
    ----------
    position : ndarray, shape (n, 2), float64
        The observers [length].
    reach : ndarray, shape (n,), float64
        The range of each [length]. Cells are as wide as the largest; written later, they must not exceed it. Below 0
        for an observer that finds nobody.
    observed : int
        The number of observed bodies. Write their positions to `x` and `y`; NaN hides a body.
    own : int
        The index of observer 0 among the observed; −1 if the observers are not observed themselves.
    arena : Arena
        The arena.
    shape : {"disc", "square"}
        The shape of ranges.
    pairs : bool, optional
        Compare all pairs, or use cells; by default whichever is faster.

    Attributes
    ----------
    entry, record : Entry, Packed
        The kernel that fills the neighbour list, and its argument.
    room : NeighbourList
        The arrays that it writes.
    """

    def __init__(
        self,
        position: npt.NDArray[np.float64],
        reach: npt.NDArray[np.float64],
        observed: int,
        own: int,
        arena: Arena | Plane,
        *,
        shape: str = "disc",
        pairs: bool | None = None,
    ) -> None:
        self.position, self.reach = position, reach
        self._lanes = np.full((2, -(-observed // _LANES) * _LANES), FAR_AWAY)
        self.x, self.y = self._lanes[:, :observed]
        most = MOST_PAIRS_ON_TORUS if any(arena.period) else MOST_PAIRS
        size = len(position) * observed
        grid = None if (size <= most if pairs is None else pairs) else self._grid(arena)
        self.room = neighbour_room(len(position), first_room(len(position), observed))
        period = kernel_period(arena.period)
        bodies = Observed(self._lanes[0], self._lanes[1], observed, own, period[0], period[1], shape_number(shape))
        self.entry = CELLS if grid else PAIRS
        none = Grid(0.0, 0.0, 0.0, 0.0, 0, 0)
        self.record = SEARCHING.pack(
            Searching(position, reach, bodies, grid or none, _room_to_sort(grid, observed), self.room)
        )

    def _grid(self, arena: Arena | Plane) -> Grid | None:
        """Return the division of the arena into cells; None if it is too small for that."""
        low, high = arena.bounds
        side = high - low
        # Cells narrower than the range would need more than nine comparisons; many more cells than bodies take time to
        # clear. They are slightly wider than the range, because rounding may put a body into the next cell.
        reach = float(self.reach.max(initial=0.0)) * (1 + 1e-9)
        width = max(reach, math.sqrt(side[0] * side[1] / max(len(self.x), 1)) / 2, 1e-300)
        columns, rows = (max(int(length / width), 1) for length in side)
        # Along an axis that repeats, fewer than three cells would be searched twice.
        if any(period > 0 and count < 3 for period, count in zip(arena.period, (columns, rows), strict=True)):
            return None
        return Grid(low[0], low[1], columns / side[0], rows / side[1], columns, rows)

    @property
    def has_cells(self) -> bool:
        """Whether bodies are sorted into cells; their size depends on the ranges and on the arena."""
        return self.entry is CELLS

    def grow(self, edges: int) -> None:
        """Make room for this many edges and a quarter more."""
        self.room = neighbour_room(len(self.position), edges + edges // 4)
        self.record.update(neighbours=self.room)

    def run(self) -> int:
        """Find the edges; return their number."""
        edges = self.entry(self.record)
        if edges > len(self.room.identity):
            self.grow(edges)
            edges = self.entry(self.record)
        return edges

    @property
    def graph(self) -> NeighbourList:
        """The edges found by the last search, as views that the next one overwrites."""
        return filled(self.room)


def first_room(observers: int, observed: int) -> int:
    """Return the number of edges for which there is room at first."""
    pairs = observers * observed
    return max(pairs if pairs <= MOST_PAIRS else 4 * observers + 64, 1)


def _room_to_sort(grid: Grid | None, observed: int) -> Cells:
    size, count = (observed, grid.columns * grid.rows + 2) if grid else (0, 0)
    places = np.empty((2, size), np.int64)
    return Cells(np.empty(count, np.int64), *places, *np.empty((2, size)))


def proximity_graph(
    observers: npt.ArrayLike,
    observed: npt.ArrayLike | None,
    reach: npt.ArrayLike,
    arena: Arena | None = None,
    *,
    range_shape: str = "disc",
    pairs: bool | None = None,
) -> NeighbourList:
    """Return the bodies within range of each observer.

    Parameters
    ----------
    observers : array_like, shape (n, 2)
        Positions [length].
    observed : array_like, shape (m, 2), or None
        Positions [length]; None for the observers among themselves, without edges to oneself.
    reach : float or array_like, shape (n,)
        The range of each observer [length]; a body at exactly this distance is in range.
    arena : Arena, optional
        The arena that defines distances; on a torus positions are wrapped. By default the plane.
    range_shape : {"disc", "square"}
        The shape of ranges. In a square are bodies that are at most the range away along either axis.
    pairs : bool, optional
        Compare all pairs (True) or use cells (False); by default whichever is faster. The result is the same.

    Returns
    -------
    NeighbourList

    Raises
    ------
    ValueError
        If an array has the wrong shape, the shape of ranges is unknown, a number is not finite, or a range is negative
        or, on a torus, above half a side.
    """
    here = _points("observers", observers)
    there = here if observed is None else _points("observed", observed)
    given = np.asarray(reach, float)
    if given.shape not in ((), (len(here),)):
        raise ValueError(f"reach: has the shape {given.shape}; give one number, or {len(here)}, one for each observer")
    far = np.array(np.broadcast_to(given, len(here)), order="C")
    if not np.all(far >= 0) or not np.all(np.isfinite(far)):
        raise ValueError("reach: must be a finite number of at least 0 for every observer")
    if arena is not None:
        arena.check_reach(float(far.max(initial=0.0)))
        if any(arena.period):
            here, there = (np.ascontiguousarray(arena.displacement(np.zeros(2), points)) for points in (here, there))
    place = arena or plane_around(here, there)
    made = Search(here, far, len(there), 0 if observed is None else -1, place, shape=range_shape, pairs=pairs)
    made.x[:], made.y[:] = there.T
    made.run()
    return made.graph


def _points(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    points = np.ascontiguousarray(value, float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"{name}: has the shape {points.shape}; give positions of shape (n, 2)")
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise ValueError(f"{name}: row {row} is {tuple(points[row].tolist())}; positions must be finite")
    return points


class Plane(NamedTuple):
    """The part of the open plane that contains the bodies of one search; in place of an arena."""

    bounds: tuple[Floats, Floats]
    period: tuple[float, float] = (0.0, 0.0)


def plane_around(*points: Floats) -> Plane:
    """Return the part of the plane that contains these positions, each of shape (…, 2)."""
    every = np.concatenate(points)
    low, high = (every.min(axis=0), every.max(axis=0)) if len(every) else (np.zeros(2), np.ones(2))
    return Plane((low, np.maximum(high, low + 1e-9)))
