"""Edges of the proximity graph: how they are stored, and how a kernel writes one."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import inlined


class ProximityGraph(NamedTuple):
    """The edges from observers to what they observe, grouped by observer.

    Attributes
    ----------
    start : ndarray, shape (n + 1,), int64
        The edges of observer i are those from ``start[i]`` up to, not including, ``start[i + 1]``.
    index : ndarray, shape (k,), int64
        Which body each edge leads to; ascending for each observer.
    offset : ndarray, shape (k, 2), float64
        From the observer to that body, by the shortest way [length].
    distance : ndarray, shape (k,), float64
        The length of `offset` [length].
    """

    start: npt.NDArray[np.int64]
    index: npt.NDArray[np.int64]  # type: ignore[assignment]  # hides tuple.index, which nobody needs here
    offset: npt.NDArray[np.float64]
    distance: npt.NDArray[np.float64]

    @property
    def degree(self) -> npt.NDArray[np.int64]:
        """How many bodies each observer has within range, shape (n,)."""
        return np.diff(self.start)


class Observed(NamedTuple):
    """Where the bodies are that can be observed, as a kernel reads it; `x` and `y` are filled up to full SIMD lanes."""

    x: Any
    y: Any
    size: int
    own: int
    period_x: float
    period_y: float


@inlined
def shortest(way: float, period: float) -> Any:
    """Return a way along one axis by the shorter side of the torus."""
    return way - period * np.rint(way / period)


@inlined
def append(graph: Any, edge: int, j: Any, way_x: float, way_y: float, square: float) -> None:
    """Write one edge."""
    graph.index[edge] = j
    graph.offset[edge, 0] = way_x
    graph.offset[edge, 1] = way_y
    # The square for now; `take_roots` takes all roots at once, in SIMD lanes.
    graph.distance[edge] = square


@inlined
def take_roots(graph: Any, edges: int) -> None:
    """Turn the squares that `append` has written into distances."""
    for k in range(min(edges, graph.distance.shape[0])):
        graph.distance[k] = math.sqrt(graph.distance[k])
