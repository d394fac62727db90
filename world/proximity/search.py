"""The proximity graph: who is within whose range, found once a step and read by everything.

Few bodies are compared pair by pair, in loops that use SIMD lanes; many are sorted into square cells as wide as the
longest range, so that each looks only at the nine cells around it. Both ways give the same edges in the same order and
with the same bits.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, array_at, kernel, plain
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena, kernel_period
from teamsight.world.proximity.cells import Cells, Grid, search_cells
from teamsight.world.proximity.edges import Observed
from teamsight.world.proximity.pairs import FAR_AWAY, search_pairs

__all__ = ["NeighbourList", "Search", "proximity_graph", "search"]

# More pairs than this, and cells are faster (benchmarks/crossover.py).
MOST_PAIRS = 6_000
MOST_PAIRS_ON_TORUS = 1_500

_LANES = 16

_SEARCH = np.dtype(
    [(name, np.int64) for name in ("size", "position", "reach", "observed", "lanes", "x", "y", "own")]
    + [(name, np.float64) for name in ("period_x", "period_y", "low_x", "low_y", "per_x", "per_y")]
    + [(name, np.int64) for name in ("columns", "rows", "cell_start", "cell_place", "cell_order", "cell_x", "cell_y")]
    + [(name, np.int64) for name in ("room", "start", "index", "offset", "distance")]
)


@kernel
def search(address: int) -> int:
    """Fill the graph of a search record; return how many edges there are, which may be more than there is room for."""
    ask = array_at(address, 1, _SEARCH)[0]
    n = ask.size
    m = ask.observed
    position = array_at(ask.position, (n, 2), np.float64)
    reach = array_at(ask.reach, n, np.float64)
    observed = Observed(
        array_at(ask.x, ask.lanes, np.float64),
        array_at(ask.y, ask.lanes, np.float64),
        m,
        ask.own,
        ask.period_x,
        ask.period_y,
    )
    graph = NeighbourList(
        array_at(ask.start, n + 1, np.int64),
        array_at(ask.index, ask.room, np.int64),
        array_at(ask.offset, (ask.room, 2), np.float64),
        array_at(ask.distance, ask.room, np.float64),
    )
    if ask.columns == 0:
        return search_pairs(position, reach, observed, graph)
    grid = Grid(ask.low_x, ask.low_y, ask.per_x, ask.per_y, ask.columns, ask.rows)
    cells = Cells(
        array_at(ask.cell_start, ask.columns * ask.rows + 2, np.int64),
        array_at(ask.cell_place, m, np.int64),
        array_at(ask.cell_order, m, np.int64),
        array_at(ask.cell_x, m, np.float64),
        array_at(ask.cell_y, m, np.float64),
    )
    return search_cells(position, reach, observed, grid, cells, graph)


_ENTRY = Entry(plain(search))


class Search:
    """A search for edges that can be made again and again on the same arrays.

    Parameters
    ----------
    position : ndarray, shape (n, 2), float64
        The observers [length].
    reach : ndarray, shape (n,), float64
        How far each observes [length].
    observed : int
        How many bodies can be observed. Their places are to be written to `x` and `y`.
    own : int
        The number of observer 0 among the observed, when the observers are observed themselves; otherwise −1.
    arena : Arena
        Where all of them are.
    pairs : bool, optional
        Compare all pairs, or use cells; by default whichever is faster.

    Attributes
    ----------
    record : ndarray
        What the kernel `search` works on.
    """

    def __init__(
        self,
        position: npt.NDArray[np.float64],
        reach: npt.NDArray[np.float64],
        observed: int,
        own: int,
        arena: Arena,
        *,
        pairs: bool | None = None,
    ) -> None:
        n = len(position)
        self.position, self.reach = position, reach
        lanes = -(-observed // _LANES) * _LANES
        self._lanes = np.full((2, lanes), FAR_AWAY)
        self.x, self.y = self._lanes[:, :observed]
        self.start = np.zeros(n + 1, np.int64)
        self.record = np.zeros(1, _SEARCH)
        ask = self.record[0]
        ask["size"], ask["observed"], ask["lanes"], ask["own"] = n, observed, lanes, own
        ask["period_x"], ask["period_y"] = kernel_period(arena)
        self._cells: Cells | None = None
        most = MOST_PAIRS_ON_TORUS if any(arena.period) else MOST_PAIRS
        if not (n * observed <= most if pairs is None else pairs):
            self._cut(arena, ask)
        self._room(n * observed if n * observed <= MOST_PAIRS else 4 * n + 64)

    def _cut(self, arena: Arena, ask: Any) -> None:
        low, high = arena.bounds
        side = high - low
        # Cells narrower than the range would need more than nine looks; far more cells than bodies cost time to clear.
        # They are a hair wider, because rounding may push a body into the next cell.
        reach = float(self.reach.max(initial=0.0)) * (1 + 1e-9)
        width = max(reach, math.sqrt(side[0] * side[1] / max(len(self.x), 1)) / 2, 1e-300)
        columns, rows = (max(int(length / width), 1) for length in side)
        # Along an axis that repeats, fewer than three cells would be looked at twice.
        if any(period > 0 and count < 3 for period, count in zip(arena.period, (columns, rows), strict=True)):
            return
        ask["low_x"], ask["low_y"], ask["columns"], ask["rows"] = *low, columns, rows
        ask["per_x"], ask["per_y"] = columns / side[0], rows / side[1]
        size = len(self.x)
        self._cells = Cells(
            np.empty(columns * rows + 2, np.int64), np.empty(size, np.int64), np.empty(size, np.int64),
            np.empty(size), np.empty(size),
        )  # fmt: skip

    def _room(self, room: int) -> None:
        room = max(room, 1)
        self.identity, self.distance = np.zeros(room, np.int64), np.zeros(room)
        self.offset = np.zeros((room, 2))
        ask = self.record[0]
        ask["room"] = room
        named = {
            "position": self.position, "reach": self.reach, "x": self.x, "y": self.y, "start": self.start,
            "index": self.identity, "offset": self.offset, "distance": self.distance,
        }  # fmt: skip
        if self._cells is not None:
            named |= {f"cell_{name}": array for name, array in self._cells._asdict().items()}
        for name, array in named.items():
            ask[name] = array.ctypes.data

    @property
    def has_cells(self) -> bool:
        """Whether bodies are sorted into cells, whose size depends on the ranges and on the arena."""
        return self._cells is not None

    def grow(self, edges: int) -> None:
        """Make room for this many edges and a quarter more."""
        self._room(edges + edges // 4)

    def run(self) -> int:
        """Find the edges; return their number."""
        edges = _ENTRY(self.record.ctypes.data)
        if edges > len(self.identity):
            self.grow(edges)
            edges = _ENTRY(self.record.ctypes.data)
        return edges

    @property
    def graph(self) -> NeighbourList:
        """The edges found last, as views that the next search overwrites."""
        edges = self.start[-1]
        return NeighbourList(self.start, self.identity[:edges], self.offset[:edges], self.distance[:edges])


def proximity_graph(
    observers: npt.ArrayLike,
    observed: npt.ArrayLike | None,
    reach: npt.ArrayLike,
    arena: Arena | None = None,
    *,
    pairs: bool | None = None,
) -> NeighbourList:
    """Find who is within whose range.

    Parameters
    ----------
    observers : array_like, shape (n, 2)
        Positions [length].
    observed : array_like, shape (m, 2), or None
        Positions [length]; None for the observers among themselves, without edges to oneself.
    reach : float or array_like, shape (n,)
        How far each observer sees [length]; a body at exactly this distance is seen.
    arena : Arena, optional
        Distances are those of this arena, on a torus after wrapping the positions; by default those of the plane.
    pairs : bool, optional
        Compare all pairs (True) or use cells (False); by default whichever is faster. The result is the same.

    Returns
    -------
    NeighbourList

    Raises
    ------
    ValueError
        If an array has the wrong shape, a number is not finite, a range is negative or, on a torus, above half a side.
    """
    here = _points("observers", observers)
    there = here if observed is None else _points("observed", observed)
    given = np.asarray(reach, float)
    if given.shape not in ((), (len(here),)):
        raise ValueError(f"reach: has the shape {given.shape}; give one number, or {len(here)}, one for each observer")
    far = np.array(np.broadcast_to(given, len(here)), order="C")
    if not np.all(far >= 0) or not np.all(np.isfinite(far)):
        raise ValueError("reach: must be a finite number of at least 0 for every observer")
    if arena is None:
        arena = _plane_around(here, there)
    if any(arena.period):
        here, there = (np.ascontiguousarray(arena.displacement(np.zeros(2), points)) for points in (here, there))
    arena.check_reach(float(far.max(initial=0.0)))
    look = Search(here, far, len(there), 0 if observed is None else -1, arena, pairs=pairs)
    look.x[:], look.y[:] = there.T
    look.run()
    return look.graph


def _points(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    points = np.ascontiguousarray(value, float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"{name}: shape {points.shape}; positions have the shape (n, 2)")
    if not np.isfinite(points).all():
        raise ValueError(f"{name}: row {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
    return points


def _plane_around(*points: npt.NDArray[np.float64]) -> Arena:
    every = np.concatenate(points)
    if not len(every):
        return _Plane(np.zeros(2), np.ones(2))
    low, high = every.min(axis=0), every.max(axis=0)
    return _Plane(low, np.maximum(high, low + 1e-9))


class _Plane(Arena):
    """The open plane, as far as the bodies of one search reach."""

    def __init__(self, low: npt.NDArray[np.float64], high: npt.NDArray[np.float64]) -> None:
        self._low, self._high = low, high

    @property
    def size(self) -> tuple[float, float]:
        return math.inf, math.inf

    @property
    def area(self) -> float:
        return math.inf

    @property
    def bounds(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        return self._low, self._high

    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        return np.ones(np.shape(position)[:-1], bool)

    def place(self, u: npt.ArrayLike, v: npt.ArrayLike, margin: float = 0.0) -> npt.NDArray[np.float64]:
        share = np.stack([np.asarray(u, float), np.asarray(v, float)], axis=-1)
        return self._low + share * (self._high - self._low)
