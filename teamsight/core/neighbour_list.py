"""The neighbour list: the neighbours of each observer, as flat arrays."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt


class NeighbourList(NamedTuple):
    """The neighbours of n observers, grouped by observer. A neighbour can be of another kind, such as a target.

    Attributes
    ----------
    start : ndarray, shape (n + 1,), int64
        The neighbours of observer i are the entries from ``start[i]`` up to, not including, ``start[i + 1]``.
    identity : ndarray, shape (k,), int64
        The identity of each neighbour. In percepts: its `unique_id`, or −1 if the degree of awareness hides it.
        Elsewhere: its row in the arrays that were searched. Ascending for each observer, unless hidden.
    offset : ndarray, shape (k, 2), float64
        From the observer to the neighbour, by the shortest way, along the arena's axes [length].
    distance : ndarray, shape (k,), float64
        The length of `offset` [length].
    """

    start: Annotated[npt.NDArray[np.int64], "n + 1"]
    identity: Annotated[npt.NDArray[np.int64], ".k"]
    offset: Annotated[npt.NDArray[np.float64], ".k", 2]
    distance: Annotated[npt.NDArray[np.float64], ".k"]

    @property
    def degree(self) -> npt.NDArray[np.int64]:
        """The number of neighbours of each observer, shape (n,)."""
        return np.diff(self.start)

    def copy(self) -> NeighbourList:
        """Return a copy with arrays of its own."""
        return NeighbourList(self.start.copy(), self.identity.copy(), self.offset.copy(), self.distance.copy())


#: A neighbour list in a record, with room for more; kernels receive the part that is in use, by the last of `start`.
Filled = Annotated[NeighbourList, ".k = start[-1]"]


def neighbour_room(observers: int, room: int) -> NeighbourList:
    """Return an empty neighbour list with room for `room` neighbours."""
    return NeighbourList(
        np.zeros(observers + 1, np.int64), np.zeros(room, np.int64), np.zeros((room, 2)), np.zeros(room)
    )


def no_neighbours(observers: int) -> NeighbourList:
    """Return an empty neighbour list without room."""
    return neighbour_room(observers, 0)


def filled(room: NeighbourList) -> NeighbourList:
    """Return the part of a neighbour list that is in use, as views."""
    k = room.start[-1]
    return NeighbourList(room.start, room.identity[:k], room.offset[:k], room.distance[:k])
