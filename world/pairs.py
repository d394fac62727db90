"""The search for edges among few bodies: every pair, in loops that use SIMD lanes."""

from __future__ import annotations

from typing import Any

from teamsight.kernel import kernel
from teamsight.world.edges import Observed, append, shortest


@kernel
def search_pairs(position: Any, reach: Any, observed: Observed, graph: Any) -> int:
    """Find all edges by comparing every pair; return how many there are.

    Parameters
    ----------
    position : ndarray, shape (n, 2), float64
        The observers.
    reach : ndarray, shape (n,), float64
        How far each observes.
    observed : Observed
        The others, and work space `square` of shape (m,). Observer i itself is number i + `own` of them, if `own` ≥ 0.
    graph : ProximityGraph
        Written as far as its arrays go; when the number returned is larger, they must grow.
    """
    size = observed.x.shape[0]
    room = graph.index.shape[0]
    edge = 0
    wraps = observed.period_x > 0.0
    for i in range(position.shape[0]):
        graph.start[i] = edge
        x = position[i, 0]
        y = position[i, 1]
        limit = reach[i] * reach[i]
        hits = 0
        if wraps:
            for j in range(size):
                way_x = shortest(observed.x[j] - x, observed.period_x)
                way_y = shortest(observed.y[j] - y, observed.period_y)
                square = way_x * way_x + way_y * way_y
                observed.square[j] = square
                hits += square <= limit
        else:
            for j in range(size):
                way_x = observed.x[j] - x
                way_y = observed.y[j] - y
                square = way_x * way_x + way_y * way_y
                observed.square[j] = square
                hits += square <= limit
        myself = -1
        if observed.own >= 0:
            myself = i + observed.own
            hits -= 1
        if edge + hits > room:
            edge += hits
            continue
        last = edge + hits
        j = 0
        while edge < last:
            if observed.square[j] <= limit and j != myself:
                way_x = observed.x[j] - x
                way_y = observed.y[j] - y
                if wraps:
                    way_x = shortest(way_x, observed.period_x)
                    way_y = shortest(way_y, observed.period_y)
                append(graph, edge, j, way_x, way_y, observed.square[j])
                edge += 1
            j += 1
    graph.start[position.shape[0]] = edge
    return edge
