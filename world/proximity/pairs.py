"""The neighbour search among few bodies: compare every pair, in loops that use SIMD lanes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from teamsight.core.kernel import inlined, kernel, near_eight, near_eight_in_square
from teamsight.world.proximity.edges import Observed, append, is_near, limit_of, shortest, square_of, take_roots
from teamsight.world.proximity.shapes import DISC

BLOCK = 64
"""The number of bodies that are compared at once: one bit of a word for each."""

FAR_AWAY = 1e150
"""The coordinates that fill the last lanes: beyond any range, and with a finite square."""

_ONE = np.uint64(1)


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
