"""The neighbour list: who is within whose range, as flat arrays."""

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
        Who each neighbour is. In percepts: its `unique_id`, or −1 where the degree of awareness hides it. Elsewhere:
        its row in the arrays of those who were searched. Ascending for each observer, unless hidden.
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
        """How many neighbours each observer has, shape (n,)."""
        return np.diff(self.start)

    def copy(self) -> NeighbourList:
        """Return a neighbour list whose arrays are its own."""
        return NeighbourList(self.start.copy(), self.identity.copy(), self.offset.copy(), self.distance.copy())


#: A neighbour list in a record whose arrays may have room for more: a kernel sees as many entries as `start` says.
Filled = Annotated[NeighbourList, ".k = start[-1]"]


def neighbour_room(observers: int, room: int) -> NeighbourList:
    """Return arrays for at most `room` neighbours of so many observers, without any yet."""
    return NeighbourList(
        np.zeros(observers + 1, np.int64), np.zeros(room, np.int64), np.zeros((room, 2)), np.zeros(room)
    )


def no_neighbours(observers: int) -> NeighbourList:
    """Return the neighbour list of so many observers that have no neighbours."""
    return neighbour_room(observers, 0)


def filled(room: NeighbourList) -> NeighbourList:
    """Return the part of a neighbour list that is in use, as views."""
    k = room.start[-1]
    return NeighbourList(room.start, room.identity[:k], room.offset[:k], room.distance[:k])
