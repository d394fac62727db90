"""Edges of the neighbour graph: how they are stored, and how a kernel writes one."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined
from teamsight.world.proximity.shapes import DISC


class Observed(NamedTuple):
    """The bodies that can be observed, and the metric.

    `x` and `y` are filled up to full SIMD lanes, and NaN for one that is hidden. `shape` is that of ranges; see
    `teamsight.world.proximity.shapes`.
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
