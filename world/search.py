"""The neighbour search: it finds, once per step, which bodies are within range of which.

Few bodies are compared pair by pair, in loops that use SIMD lanes. Many are sorted into square cells as wide as the
longest range, and each is compared with those in the nine cells around it, those of three cells side by side at once.
Both methods give the same edges in the same order and with the same bits.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import (
    Entry,
    Record,
    inlined,
    kernel,
    near_eight,
    near_eight_in_square,
    scratch,
    trailing_zeros,
)
from teamsight.core.neighbour_list import NeighbourList, filled, neighbour_room
from teamsight.world.arena import ENDLESS, Arena, kernel_period
from teamsight.world.limits import DISC, shape_number


class Observed(NamedTuple):
    """The bodies that can be observed, and the metric.

    `x` and `y` are filled up to full SIMD lanes, and NaN for one that is hidden. `shape` is that of ranges; see
    `teamsight.world.search`.
    """

    x: Annotated[npt.NDArray[np.float64], "lanes"]
    y: Annotated[npt.NDArray[np.float64], "lanes"]
    size: int
    own: int
    period_x: float
    period_y: float
    shape: int


@inlined
def shortest(way: float, period: float) -> Any:
    """Return the shortest displacement along one axis of a torus."""
    return way - period * np.rint(way / period)


@inlined
def square_of(reach: float) -> Any:
    """Return the largest square of a distance in range: below 0 for a range below 0, which finds not even itself."""
    return reach * abs(reach)


@inlined
def limit_of(reach: float, shape: int) -> Any:
    """Return what `is_near` compares with: `square_of` a range, or the range itself if it is a square."""
    return square_of(reach) if shape == DISC else reach


@inlined
def is_near(way_x: float, way_y: float, limit: float, shape: int) -> Any:
    """Whether a body at this offset is in range; not if the offset is NaN."""
    if shape == DISC:
        return way_x * way_x + way_y * way_y <= limit
    return abs(way_x) <= limit and abs(way_y) <= limit


@inlined
def is_hidden(observed: Observed, j: int) -> Any:
    """Whether a body is at NaN, where nobody finds it; no distance from there is in range, on a torus neither."""
    return observed.x[j] != observed.x[j]


@inlined
def append(graph: Any, edge: int, j: Any, way_x: float, way_y: float, square: float) -> None:
    """Write one edge."""
    graph.identity[edge] = j
    graph.offset[edge, 0] = way_x
    graph.offset[edge, 1] = way_y
    # The square for now; `take_roots` takes all roots at once, in SIMD lanes.
    graph.distance[edge] = square


@inlined
def take_roots(graph: Any, edges: int) -> None:
    """Turn the squares that `append` has written into distances."""
    for k in range(min(edges, graph.distance.shape[0])):
        graph.distance[k] = math.sqrt(graph.distance[k])


Floats = npt.NDArray[np.float64]
# Half as wide as others, since of many bodies these arrays do not fit into the nearest caches.
Integers = npt.NDArray[np.int32]


class Cells(NamedTuple):
    """Work space for sorting bodies into cells; `start` has one entry per cell and two more.

    `place` has the place of each body among those that are sorted, −1 if it is hidden; `x` and `y` have room behind
    them for the last eight to be read at once.
    """

    start: Annotated[Integers, "cells + 2"]
    place: Annotated[Integers, "sorted"]
    order: Annotated[Integers, "sorted"]
    x: Annotated[Floats, "sorted + 8"]
    y: Annotated[Floats, "sorted + 8"]


_ONE = np.uint64(1)


class Grid(NamedTuple):
    """The division of the plane into cells."""

    low_x: float
    low_y: float
    per_x: float
    per_y: float
    columns: int
    rows: int


@inlined
def _column(x: float, low: float, per: float, count: int) -> int:
    return min(max(int((x - low) * per), 0), count - 1)


@kernel
def sort_into_cells(observed: Observed, grid: Grid, cells: Cells) -> None:
    """Order the bodies by cell, within a cell by index; leave out those at NaN."""
    size = observed.size
    cells.start[:] = 0
    for j in range(size):
        cells.place[j] = -1
        if is_hidden(observed, j):
            continue
        row = _column(observed.y[j], grid.low_y, grid.per_y, grid.rows)
        place = row * grid.columns + _column(observed.x[j], grid.low_x, grid.per_x, grid.columns)
        cells.place[j] = place
        cells.start[place + 2] += 1
    for place in range(2, cells.start.shape[0]):
        cells.start[place] += cells.start[place - 1]
    for j in range(size):
        if cells.place[j] < 0:
            continue
        place = cells.place[j] + 1
        at = cells.start[place]
        cells.start[place] = at + 1
        cells.place[j] = at
        cells.order[at] = j
        cells.x[at] = observed.x[j]
        cells.y[at] = observed.y[j]


@kernel
def _settle(graph: Any, first: int, edge: int) -> None:
    """Insert the newest edge of an observer into the order of indices."""
    j = graph.identity[edge]
    if edge == first or graph.identity[edge - 1] < j:
        return
    way_x = graph.offset[edge, 0]
    way_y = graph.offset[edge, 1]
    distance = graph.distance[edge]
    while edge > first and graph.identity[edge - 1] > j:
        graph.identity[edge] = graph.identity[edge - 1]
        graph.offset[edge, 0] = graph.offset[edge - 1, 0]
        graph.offset[edge, 1] = graph.offset[edge - 1, 1]
        graph.distance[edge] = graph.distance[edge - 1]
        edge -= 1
    graph.identity[edge] = j
    graph.offset[edge, 0] = way_x
    graph.offset[edge, 1] = way_y
    graph.distance[edge] = distance


@inlined
def _near_eight(here: Any, first: Any, count: Any, shape: int, cells: Cells) -> Any:
    """Return a word in which bit k is set if the body at place ``first + k``, of `count` up to 8, is in range."""
    x, y, limit, mine = here
    if shape == DISC:
        near = near_eight(cells.x, cells.y, first, x, y, limit)
    else:
        near = near_eight_in_square(cells.x, cells.y, first, x, y, limit)
    near &= (_ONE << np.uint64(count)) - _ONE
    return near & (~(_ONE << np.uint64(mine - first)) if 0 <= mine - first < 8 else ~np.uint64(0))


@inlined
def _put(at: Any, way: Any, cells: Cells, graph: Any, first: int, edge: int) -> int:
    """Write the edge to the body at a place, if there is room; return the next edge."""
    if edge < graph.identity.shape[0]:
        x, y = way
        append(graph, edge, np.int64(cells.order[at]), x, y, x * x + y * y)
        _settle(graph, first, edge)
    return edge + 1


@kernel
def _search_span(
    here: tuple[float, float, float, int],
    span: tuple[Any, Any],
    observed: Observed,
    cells: Cells,
    graph: Any,
    edges: tuple[int, int],
) -> int:
    """Find the edges from one observer to the bodies of a row of cells; return the index of the next edge."""
    x, y, limit, mine = here
    first, edge = edges
    if observed.period_x == 0.0:
        for eight in range(span[0], span[1], 8):
            near = _near_eight(here, eight, min(span[1] - eight, 8), observed.shape, cells)
            while near != 0:
                at: Any = eight + np.int64(trailing_zeros(near))
                near &= near - _ONE
                edge = _put(at, (cells.x[at] - x, cells.y[at] - y), cells, graph, first, edge)
        return edge
    for at in range(span[0], span[1]):
        way_x = shortest(cells.x[at] - x, observed.period_x)
        way_y = shortest(cells.y[at] - y, observed.period_y)
        if is_near(way_x, way_y, limit, observed.shape) and at != mine:
            edge = _put(at, (way_x, way_y), cells, graph, first, edge)
    return edge


#: So many observers look around before any edge is written. One that has more than 8 bodies in a row of cells, or is
#: where an arena repeats, is marked, and searches by itself.
_OBSERVERS = 32
_ROWS = 3 * _OBSERVERS
_CROWDED = np.uint64(1 << 63)


@inlined
def _place_of(i: int, observed: Observed, cells: Cells) -> Any:
    """Return the place of an observer among the sorted bodies; −1 if it is not one of them."""
    return np.int64(cells.place[i + observed.own]) if observed.own >= 0 else -1


@inlined
def _near_in_row(here: Any, row: int, column: int, grid: Grid, shape: int, cells: Cells) -> tuple[Any, Any]:
    """Return the first body in the cells of a row around a column, and a word with a bit for each in range.

    The word is `_CROWDED` if there are more than 8 bodies, and 0 if there is no such row.
    """
    is_there = 0 <= row < grid.rows
    base = row * grid.columns if is_there else 0
    first = np.int64(cells.start[base + max(column - 1, 0)])
    count = np.int64(cells.start[base + min(column + 1, grid.columns - 1) + 1]) - first if is_there else 0
    return first, (_near_eight(here, first, min(count, 8), shape, cells) if count <= 8 else _CROWDED)


@kernel
def _look_around(
    position: Any,
    reach: Any,
    observers: tuple[int, int],
    observed: Observed,
    grid: Grid,
    cells: Cells,
    near: Any,
    row: Any,
) -> None:
    """Find the bodies around some observers: for each a word of 8 bits for each row of cells, and where the rows begin.

    There is no branch for a body or a cell: most would be mispredicted, and each wait for memory.
    """
    wraps = observed.period_x > 0.0
    for i in range(observers[0], observers[1]):
        k = i - observers[0]
        x = position[i, 0]
        y = position[i, 1]
        here = (x, y, limit_of(reach[i], observed.shape), _place_of(i, observed, cells))
        column = _column(x, grid.low_x, grid.per_x, grid.columns)
        line = _column(y, grid.low_y, grid.per_y, grid.rows)
        row[3 * k], below = _near_in_row(here, line - 1, column, grid, observed.shape, cells)
        row[3 * k + 1], level = _near_in_row(here, line, column, grid, observed.shape, cells)
        row[3 * k + 2], above = _near_in_row(here, line + 1, column, grid, observed.shape, cells)
        # From there, what is in range is so without a way around.
        is_inner = not wraps or (0 < column < grid.columns - 1 and 0 < line < grid.rows - 1)
        near[k] = below | level << np.uint64(8) | above << np.uint64(16)
        near[k] |= ((below | level | above) & _CROWDED) if is_inner else _CROWDED


@kernel
def _append_near(here: Any, near: Any, row: Any, k: int, cells: Cells, graph: Any, first: int) -> int:
    """Write the edges that `_look_around` has found of an observer; return the next edge."""
    x, y = here[0], here[1]
    edge = first
    while near != 0:
        bit = np.int64(trailing_zeros(near))
        near &= near - _ONE
        at = row[3 * k + (bit >> 3)] + (bit & 7)
        edge = _put(at, (cells.x[at] - x, cells.y[at] - y), cells, graph, first, edge)
    return edge


@kernel
def _search_rows(here: Any, observed: Observed, grid: Grid, cells: Cells, graph: Any, first: int) -> int:
    """Find the edges from one observer, row by row; return the next edge."""
    wraps_x = 0.0 < observed.period_x < ENDLESS
    wraps_y = 0.0 < observed.period_y < ENDLESS
    edge = first
    column = _column(here[0], grid.low_x, grid.per_x, grid.columns)
    row = _column(here[1], grid.low_y, grid.per_y, grid.rows)
    for r in range(row - 1, row + 2):
        line = r
        if wraps_y:
            line = r % grid.rows
        elif r < 0 or r >= grid.rows:
            continue
        base = line * grid.columns
        left = max(column - 1, 0)
        right = min(column + 1, grid.columns - 1)
        span = (np.int64(cells.start[base + left]), np.int64(cells.start[base + right + 1]))
        edge = _search_span(here, span, observed, cells, graph, (first, edge))
        if wraps_x and (column == 0 or column == grid.columns - 1):
            far = grid.columns - 1 if column == 0 else 0
            span = (np.int64(cells.start[base + far]), np.int64(cells.start[base + far + 1]))
            edge = _search_span(here, span, observed, cells, graph, (first, edge))
    return edge


@kernel
def search_cells(position: Any, reach: Any, observed: Observed, grid: Grid, cells: Cells, graph: Any) -> int:
    """Find all edges by comparing bodies of neighbouring cells; parameters and result as for `search_pairs`."""
    sort_into_cells(observed, grid, cells)
    near = scratch(_OBSERVERS, np.uint64)
    row = scratch(_ROWS, np.int64)
    size = position.shape[0]
    edge = 0
    for begin in range(0, size, _OBSERVERS):
        end = min(begin + _OBSERVERS, size)
        _look_around(position, reach, (begin, end), observed, grid, cells, near, row)
        for i in range(begin, end):
            graph.start[i] = edge
            limit = limit_of(reach[i], observed.shape)
            here = (position[i, 0], position[i, 1], limit, _place_of(i, observed, cells))
            if near[i - begin] >= _CROWDED:
                edge = _search_rows(here, observed, grid, cells, graph, edge)
            else:
                edge = _append_near(here, near[i - begin], row, i - begin, cells, graph, edge)
    graph.start[size] = edge
    take_roots(graph, edge)
    return edge


BLOCK = 64
"""The number of bodies that are compared at once: one bit of a word for each."""

FAR_AWAY = 1e150
"""The coordinates that fill the last lanes: beyond any range, and with a finite square."""


@inlined
def _near(x: float, y: float, limit: float, observed: Observed, first: int, last: int) -> Any:
    """Return a word in which bit j is set if body ``first + j`` is in range."""
    near = np.uint64(0)
    for part in range(0, last - first, 8):
        near |= near_eight(observed.x, observed.y, first + part, x, y, limit) << np.uint64(part)
    return near


@inlined
def _near_in_square(x: float, y: float, limit: float, observed: Observed, first: int, last: int) -> Any:
    near = np.uint64(0)
    for part in range(0, last - first, 8):
        near |= near_eight_in_square(observed.x, observed.y, first + part, x, y, limit) << np.uint64(part)
    return near


@inlined
def _near_on_torus(x: float, y: float, limit: float, observed: Observed, first: int, last: int) -> Any:
    near = np.uint64(0)
    for bit in range(last - first):
        j = np.uint64(first) + np.uint64(bit)
        way_x = shortest(observed.x[j] - x, observed.period_x)
        way_y = shortest(observed.y[j] - y, observed.period_y)
        near |= np.uint64(is_near(way_x, way_y, limit, observed.shape)) << np.uint64(bit)
    return near


@kernel
def _search_few(position: Any, reach: Any, observed: Observed, graph: Any) -> int:
    """As `search_pairs`, for at most `BLOCK` bodies, disc ranges, no torus and enough room for all edges."""
    # One word for each observer, and no checks of period and room: a run of 15 + 15 takes 8 % less time.
    edge: Any = np.uint64(0)
    size = np.uint64(observed.x.shape[0])
    for i in range(np.uint64(position.shape[0])):
        graph.start[i] = edge
        x = position[i, 0]
        y = position[i, 1]
        near = np.uint64(0)
        limit = min(square_of(reach[i]), 0.5 * FAR_AWAY * FAR_AWAY)
        for part in range(np.uint64(0), size, np.uint64(8)):
            near |= near_eight(observed.x, observed.y, np.int64(part), x, y, limit) << part
        if observed.own >= 0:
            near &= ~(_ONE << (np.uint64(i) + np.uint64(observed.own)))
        while near != 0:
            j = np.uint64(trailing_zeros(near))
            near &= near - _ONE
            way_x = observed.x[j] - x
            way_y = observed.y[j] - y
            append(graph, edge, j, way_x, way_y, way_x * way_x + way_y * way_y)
            edge += _ONE
    graph.start[position.shape[0]] = edge
    edges: Any = np.int64(edge)
    take_roots(graph, edges)
    return edges  # type: ignore[no-any-return]


@kernel
def search_pairs(position: Any, reach: Any, observed: Observed, graph: Any) -> int:
    """Find all edges by comparing every pair; return their number.

    Parameters
    ----------
    position : ndarray, shape (n, 2), float64
        The observers.
    reach : ndarray, shape (n,), float64
        The range of each; below 0 for one that finds nobody.
    observed : Observed
        The observed bodies; nobody finds those at NaN. Observer i itself is number i + `own` of them, if `own` ≥ 0.
    graph : NeighbourList
        Written as far as there is room; if the number returned is larger, its arrays must grow.
    """
    room = np.uint64(graph.identity.shape[0])
    edge: Any = np.uint64(0)
    wraps = observed.period_x > 0.0
    size = observed.size if wraps else observed.x.shape[0]
    is_disc = observed.shape == DISC
    if not wraps and is_disc and size <= BLOCK and graph.distance.shape[0] >= position.shape[0] * observed.size:
        return _search_few(position, reach, observed, graph)  # type: ignore[no-any-return]
    for i in range(position.shape[0]):
        graph.start[i] = edge
        x = position[i, 0]
        y = position[i, 1]
        most = 0.5 * FAR_AWAY * FAR_AWAY if is_disc else 0.5 * FAR_AWAY
        limit = min(limit_of(reach[i], observed.shape), most)
        myself = i + observed.own if observed.own >= 0 else -1
        for first in range(0, size, BLOCK):
            last = min(first + BLOCK, size)
            if wraps:
                near = _near_on_torus(x, y, limit, observed, first, last)
            elif not is_disc:
                near = _near_in_square(x, y, limit, observed, first, last)
            else:
                near = _near(x, y, limit, observed, first, last)
            if first <= myself < last:
                near &= ~(_ONE << np.uint64(myself - first))
            while near != 0:
                j = np.uint64(first) + np.uint64(trailing_zeros(near))
                near &= near - _ONE
                if edge < room:
                    way_x = observed.x[j] - x
                    way_y = observed.y[j] - y
                    if wraps:
                        way_x = shortest(way_x, observed.period_x)
                        way_y = shortest(way_y, observed.period_y)
                    append(graph, edge, j, way_x, way_y, way_x * way_x + way_y * way_y)
                edge += _ONE
    graph.start[position.shape[0]] = edge
    edges: Any = np.int64(edge)
    take_roots(graph, edges)
    return edges  # type: ignore[no-any-return]


__all__ = ["NeighbourList", "Search", "proximity_graph"]

# For more pairs than this, cells are faster (benchmarks/crossover.py): in whole worlds, whose rows are in the order of
# cells, earlier than in a search alone.
MOST_PAIRS = 9_000
MOST_PAIRS_ON_TORUS = 1_500

#: Bodies are filled up to a multiple of this many.
BODY_LANES = 16


# Cells are as wide as the distance between bodies on a square lattice over this, or wider: narrower ones take more
# memory, and in a row of three wider ones there are more often more than 8 bodies.
_FINEST = 1.2


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
    rows : tuple of two int, optional
        The numbers of observers and of observed bodies for which there is room; by default those that there are.

    Attributes
    ----------
    entry, record : Entry, Packed
        The kernel that fills the neighbour list, and its argument.
    lanes : ndarray, shape (2, lanes), float64
        x and y of all bodies for which there is room, up to full SIMD lanes.
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
        rows: tuple[int, int] | None = None,
    ) -> None:
        observers, bodies = rows or (len(position), observed)
        self.lanes = np.full((2, _lanes_of(bodies)), FAR_AWAY)
        self._start = np.zeros(observers + 1, np.int64)
        self._edges = neighbour_room(0, first_room(observers, bodies))
        self.fit(position, reach, observed)
        most = MOST_PAIRS_ON_TORUS if any(arena.period) else MOST_PAIRS
        grid = None if (observers * bodies <= most if pairs is None else pairs) else self._grid(arena)
        period = kernel_period(arena.period)
        x, y = self.lanes[:, : _lanes_of(observed)]
        seen = Observed(x, y, observed, own, period[0], period[1], shape_number(shape))
        self.entry = CELLS if grid else PAIRS
        none = Grid(0.0, 0.0, 0.0, 0.0, 0, 0)
        self._bound = Searching(position, reach, seen, grid or none, _room_to_sort(grid, bodies), self.room)
        self.record = SEARCHING.pack(self._bound)

    def arrays(self, own: int) -> Searching:
        """Return what the record holds for the present numbers of bodies; `own` is as in `Observed`."""
        x, y = self.lanes[:, : _lanes_of(len(self.x))]
        observed = self._bound.observed._replace(x=x, y=y, size=len(self.x), own=own)
        return self._bound._replace(
            position=self.position, reach=self.reach, observed=observed, neighbours=self.room
        )

    def fit(self, position: Floats, reach: Floats, observed: int) -> None:
        """Show other numbers of bodies, for which there is room; compiled code has written them into the record."""
        self.position, self.reach = position, reach
        self.x, self.y = self.lanes[:, :observed]
        self.room = self._edges._replace(start=self._start[: len(position) + 1])

    def _grid(self, arena: Arena | Plane) -> Grid | None:
        """Return the division of the arena into cells; None if it is too small for that."""
        low, high = arena.bounds
        side = high - low
        # Cells narrower than the range would need more than nine comparisons; many more cells than bodies take time to
        # clear. They are slightly wider than the range, because rounding may put a body into the next cell.
        reach = float(self.reach.max(initial=0.0)) * (1 + 1e-9)
        width = max(reach, math.sqrt(side[0] * side[1] / max(len(self.x), 1)) / _FINEST, 1e-300)
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
        self._edges = neighbour_room(0, edges + edges // 4)
        self.room = self._edges._replace(start=self._start[: len(self.position) + 1])
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


def _lanes_of(observed: int) -> int:
    return -(-observed // BODY_LANES) * BODY_LANES


def first_room(observers: int, observed: int) -> int:
    """Return the number of edges for which there is room at first."""
    pairs = observers * observed
    return max(pairs if pairs <= MOST_PAIRS else 4 * observers + 64, 1)


def _room_to_sort(grid: Grid | None, observed: int) -> Cells:
    size, count = (observed, grid.columns * grid.rows + 2) if grid else (0, 0)
    return Cells(np.empty(count, np.int32), *np.empty((2, size), np.int32), *np.empty((2, size + 8)))


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
