"""The neighbours in every frame of recorded positions, from one search that is repeated on the same arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.world.arena import Arena
from teamsight.world.search import Search, plane_around

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


class Edges(NamedTuple):
    """The edges of many frames, ordered by frame, observer and observed.

    Attributes
    ----------
    frame : ndarray of int64, shape (m,)
        The frame of each edge.
    one, other : ndarray of int64, shape (m,)
        Rows of the robot that senses and of the one that is sensed; of mutual edges the smaller and the larger row.
    distance : ndarray of float64, shape (m,)
        Distance between them [length].
    """

    frame: Ints
    one: Ints
    other: Ints
    distance: Floats


class FrameSearch:
    """A neighbour search over frames, in which robots whose position is NaN are not there.

    Parameters
    ----------
    position : ndarray of float64, shape (frames, n, 2)
        Positions [length].
    reach : ndarray of float64, shape (n,)
        Range of each robot [length].
    arena : Arena, optional
        The arena that defines distances; by default the plane.
    range_shape : {"disc", "square"}
        The shape of ranges.
    """

    def __init__(self, position: Floats, reach: Floats, arena: Arena | None, range_shape: str = "disc") -> None:
        self.position, self.reach, self._arena, self._shape = position, reach, arena, range_shape
        self.present = ~np.isnan(position[..., 0])
        self._periodic = arena is not None and any(arena.period)
        found = position[self.present]
        self._place = arena if arena is not None and self._periodic else plane_around(found)
        # One search for each number of robots that are there; nearly always there are few.
        self._searches: dict[int, Search] = {}

    def edges(self, frame: int) -> tuple[Ints, Ints, Floats]:
        """Return the observer, the observed and the distance of each edge of a frame."""
        rows = np.flatnonzero(self.present[frame])
        if len(rows) not in self._searches:
            # Cells are as wide as the longest range of all robots, whichever of them are there.
            reach, size = np.full(len(rows), self.reach.max(initial=0.0)), len(rows)
            self._searches[size] = Search(np.zeros((size, 2)), reach, size, 0, self._place, shape=self._shape)
        search = self._searches[len(rows)]
        here = self.position[frame, rows]
        if self._periodic:
            assert self._arena is not None
            here = self._arena.displacement(np.zeros(2), here)
        search.position[:] = here
        search.reach[:] = self.reach[rows]
        search.x[:], search.y[:] = here.T
        search.run()
        graph = search.graph
        return np.repeat(rows, graph.degree), rows[graph.identity], graph.distance.copy()


def all_edges(search: FrameSearch, team: Ints | None = None, *, directed: bool = False) -> Edges:
    """Return the edges of all frames.

    Parameters
    ----------
    search : FrameSearch
        The positions and ranges.
    team : ndarray of int64, shape (n,), optional
        Team of each robot; robots of different teams are not neighbours.
    directed : bool
        Return each edge from the robot that senses to the one that is sensed; by default the mutual ones, once.
    """
    found = [search.edges(frame) for frame in range(len(search.position))]
    frame = np.repeat(np.arange(len(found)), [len(one) for one, _, _ in found])
    empty = np.zeros(0, np.int64)
    one, other, distance = (
        np.concatenate([parts[place] for parts in found] or [empty if place < 2 else empty.astype(float)])
        for place in range(3)
    )
    edges = Edges(frame, one, other, distance)
    if team is not None:
        edges = _chosen(edges, team[one] == team[other])
    reach = search.reach
    if directed:
        return edges
    if len(reach) and reach.min() < reach.max():
        return mutual(edges, len(reach))
    return _chosen(edges, edges.one < edges.other)


def mutual(edges: Edges, size: int) -> Edges:
    """Return the edges between robots that sense each other, each once, the smaller row first.

    Parameters
    ----------
    edges : Edges
        Directed edges.
    size : int
        Number of robots.
    """
    low, high = np.minimum(edges.one, edges.other), np.maximum(edges.one, edges.other)
    _, place, seen = np.unique((edges.frame * size + low) * size + high, return_inverse=True, return_counts=True)
    return _chosen(edges, (edges.one < edges.other) & (seen[place] == 2))


def _chosen(edges: Edges, which: NDArray[np.bool_]) -> Edges:
    return Edges(edges.frame[which], edges.one[which], edges.other[which], edges.distance[which])
