"""Readings: what a sensor with a delay has measured and not yet delivered."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

Integers = npt.NDArray[np.int64]


class ReadingArrays(NamedTuple):
    """The neighbour lists of the last ticks, one per slot; that of tick t is in slot ``t % slots``.

    Attributes
    ----------
    tick : ndarray, shape (slots,), int64
        The tick of each list; −1 for none.
    start, identity, place, offset, distance
        As in `NeighbourList`, with an axis of slots; `place` holds indices among the observed.
    """

    tick: Annotated[Integers, "slots"]
    start: Annotated[Integers, "slots", "n + 1"]
    identity: Annotated[Integers, "slots", "kept"]
    place: Annotated[Integers, "slots", "kept"]
    offset: Annotated[npt.NDArray[np.float64], "slots", "kept", 2]
    distance: Annotated[npt.NDArray[np.float64], "slots", "kept"]


class Readings:
    """The readings of a group in one channel. They belong to agents, so they survive changes of the groups.

    Parameters
    ----------
    delay : int
        The number of ticks from a measurement to the percept, at least 1.

    Attributes
    ----------
    arrays : ReadingArrays
        The lists.
    """

    def __init__(self, delay: int) -> None:
        self.delay = delay
        none = np.zeros(0, np.int64)
        self._observers, self._everyone = none, none
        self.arrays = reading_room(delay + 1, 0, 0)

    def forget(self) -> None:
        """Drop all lists, in place."""
        self.arrays.tick[:] = -1

    def fit(self, observers: Integers, everyone: Integers, room: int) -> None:
        """Adapt to the present agents, given by their identities, and to a number of entries per list.

        The lists of agents that have left, and entries that show them, are dropped; new agents have none.
        """
        old = self.arrays
        is_same = np.array_equal(observers, self._observers) and np.array_equal(everyone, self._everyone)
        if is_same and room == old.identity.shape[1]:
            return
        new = reading_room(self.delay + 1, len(observers), room)
        new.tick[:] = old.tick
        row_of = {identity: row for row, identity in enumerate(self._observers.tolist())}
        place_of = {identity: place for place, identity in enumerate(everyone.tolist())}
        rows = [row_of.get(identity, -1) for identity in observers.tolist()]
        for slot in np.flatnonzero(old.tick >= 0):
            kept: list[int] = []
            for row, before in enumerate(rows):
                if before >= 0:
                    entries = range(old.start[slot, before], old.start[slot, before + 1])
                    kept += [k for k in entries if int(old.identity[slot, k]) in place_of]
                new.start[slot, row + 1] = len(kept)
            new.identity[slot, : len(kept)] = old.identity[slot, kept]
            new.offset[slot, : len(kept)] = old.offset[slot, kept]
            new.distance[slot, : len(kept)] = old.distance[slot, kept]
            new.place[slot, : len(kept)] = [place_of[identity] for identity in old.identity[slot, kept].tolist()]
        self.arrays, self._observers, self._everyone = new, observers.copy(), everyone.copy()


def reading_room(slots: int, observers: int, room: int) -> ReadingArrays:
    """Return empty lists of this many observers, with room for this many entries each."""
    return ReadingArrays(
        np.full(slots, -1), np.zeros((slots, observers + 1), np.int64), np.zeros((slots, room), np.int64),
        np.zeros((slots, room), np.int64), np.zeros((slots, room, 2)), np.zeros((slots, room)),
    )  # fmt: skip
