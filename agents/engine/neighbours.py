"""A relation: one group observes others within a range. All that anybody perceives is read from relations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import RELATION
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Arena
from teamsight.world.proximity.search import Search

if TYPE_CHECKING:
    from teamsight.agents.group import Group


class Relation:
    """Who of the observed groups is within the range of each observer.

    Parameters
    ----------
    kind : {"targets", "teammates"}
        As what the observers perceive the observed.
    observers : Group
        Who observes.
    observed : list of Group
        Who is observed, in this order.
    reach : ndarray, shape (n,), float64
        How far each observer sees [length].
    arena : Arena
        Where all of them are.
    """

    def __init__(
        self, kind: str, observers: Group, observed: list[Group], reach: npt.NDArray[np.float64], arena: Arena
    ) -> None:
        self.kind, self.observers, self.observed = kind, observers, observed
        arena.check_reach(float(reach.max(initial=0.0)))
        sizes = [len(group) for group in observed]
        self.first = dict(zip((group.number for group in observed), np.cumsum([0, *sizes[:-1]]).tolist(), strict=True))
        self.everyone = np.concatenate([group.bodies.identity for group in observed])
        own = self.first.get(observers.number, -1)
        self.search = Search(observers.bodies.position, reach, len(self.everyone), own, arena)
        self.identity = np.zeros(len(self.search.identity), np.int64)
        self._parts = np.zeros((len(observed), 2), np.int64)

    def grow(self, edges: int) -> None:
        """Make room for this many edges and some more; records must be bound again."""
        self.search.grow(edges)
        self.identity = np.zeros(len(self.search.identity), np.int64)

    def bind(self, record: Any, met: npt.NDArray[np.int64], first_row: dict[int, int]) -> None:
        """Write where everything is into a record of kind `RELATION`.

        Parameters
        ----------
        record : void
            The record.
        met : ndarray, shape (bodies of the world,), int64
            The step at which each body was last counted as observed by the observers' side.
        first_row : dict
            For each group's number, which element of `met` is its first.
        """
        search = self.search
        rows = [np.arange(len(group)) + first_row[group.number] for group in self.observed]
        self._rows = np.concatenate(rows).astype(np.int64)
        self._parts[:] = [(group.bodies.position.ctypes.data, len(group)) for group in self.observed]
        arrays = {
            "search": search.record, "parts": self._parts, "x": search.x, "y": search.y, "everyone": self.everyone,
            "start": search.start, "index": search.identity, "identity": self.identity, "met": met,
            "rows": self._rows,
        }  # fmt: skip
        assert set(arrays) <= set(RELATION.names or ())
        for name, array in arrays.items():
            record[name] = array.ctypes.data
        record["observers"], record["observed"] = len(self.observers), len(self.everyone)
        record["part_count"], record["room"] = len(self.observed), len(search.identity)

    @property
    def graph(self) -> NeighbourList:
        """The edges; `identity` counts through the observed groups in order."""
        return self.search.graph

    @property
    def sightings(self) -> NeighbourList:
        """The edges as a policy sees them, with identities."""
        graph = self.search.graph
        return NeighbourList(graph.start, self.identity[: len(graph.identity)], graph.offset, graph.distance)

    @property
    def buffers(self) -> NeighbourList:
        """The whole buffers behind `sightings`."""
        return NeighbourList(self.search.start, self.identity, self.search.offset, self.search.distance)
