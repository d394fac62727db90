"""The records and buffers with which a degree of awareness is called."""

from __future__ import annotations

from functools import cache
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Awareness, Scene
from teamsight.core.kernel import Entry, Packed, Record, specialise
from teamsight.core.neighbour_list import NeighbourList, neighbour_room, no_neighbours


class Sensing(NamedTuple):
    """The record of a degree of awareness: the arguments of its two kernels; see `Awareness`."""

    scene: Scene
    parameters: Annotated[npt.NDArray[np.float64], "p"]
    teammates: NeighbourList
    relayed: NeighbourList
    situation: Annotated[npt.NDArray[np.float32], "n", "width"]


SENSING = Record(Sensing)
sensing_at = SENSING.at


def perceive_at(address: int) -> int:
    """Call `perceive` of a degree of awareness on the arrays of a record."""
    s = sensing_at(address)
    return perceive_kernel(s.scene, s.parameters, s.teammates, s.relayed)  # type: ignore[name-defined,no-any-return]  # noqa: F821


def situate_at(address: int) -> int:
    """Call `situate` of a degree of awareness on the arrays of a record."""
    s = sensing_at(address)
    situate_kernel(s.scene, s.parameters, s.situation)  # type: ignore[name-defined]  # noqa: F821
    return 0


_specialised = cache(specialise)


def perceive_entry(awareness: Awareness) -> Entry | None:
    """Return the entry that writes the percept under this degree, or None if there is nothing to write."""
    rule = type(awareness).perceive
    return None if rule is None else _specialised(perceive_at, awareness.name, perceive_kernel=rule)


def situate_entry(awareness: Awareness) -> Entry:
    """Return the entry that writes the situation vectors under this degree."""
    return _specialised(situate_at, awareness.name, situate_kernel=type(awareness).situate)


class Perception:
    """The arrays that a degree of awareness writes for n robots.

    Parameters
    ----------
    size, rows : int
        The number of robots, and the number for which there is room.

    Attributes
    ----------
    nothing : NeighbourList
        An empty list.
    shown, relayed : NeighbourList
        Room for teammates, and for the targets that they sense.
    situation : ndarray, shape (n, width), float32
        The vectors for learners; of width 0 unless the policy reads them.
    room : int
        The number of entries for which `shown` and `relayed` have room.
    is_situated : bool
        Whether the policy reads situation vectors.
    record : Packed
        The argument of the degree's kernels; see `teamsight.agents.engine.binding`.
    """

    def __init__(self, size: int, rows: int) -> None:
        self._rows = rows
        nothing = no_neighbours(rows)
        self._lists, self._situations_room = (nothing, nothing, nothing), np.zeros((rows, 0), np.float32)
        self.room = 0
        self.is_situated = False
        self.record: Packed[Sensing]
        self.fit(size)

    def fit(self, size: int) -> None:
        """Follow the number of robots; arrays stay where they are."""
        self.nothing, self.shown, self.relayed = (
            one._replace(start=one.start[: size + 1]) for one in self._lists
        )
        self.situation = self._situations_room[:size]
        self._situated_at: tuple[int, int] | None = None

    @property
    def size(self) -> int:
        """The number of robots."""
        return len(self.situation)

    def make_room(self, awareness: Awareness, team_size: int, teammates: int, inputs: int) -> None:
        """Make the arrays anew.

        Parameters
        ----------
        awareness : Awareness
            The degree that writes them.
        team_size : int
            The number of robots in the team.
        teammates : int
            The number of neighbours for which there is room; −1 for a group without a team.
        inputs : int
            The width of the situation vector that the policy reads; 0 for none.
        """
        nothing = shown = relayed = self._lists[0]
        if type(awareness).perceive is not None and teammates >= 0:
            self.room = max(self.room, teammates)
            relayed = neighbour_room(self._rows, self.room)
            if not awareness.shows_teammates:
                shown = neighbour_room(self._rows, self.room)
        self._lists = nothing, shown, relayed
        self.is_situated = bool(inputs)
        # Situations can be huge in a large team: if the policy does not read them, `situate` makes them on demand.
        width = sum(awareness.width(max(team_size, 1))) if inputs else 0
        self._situations_room = np.zeros((self._rows, width), np.float32)
        self.fit(self.size)

    def grow(self, need: int) -> None:
        """Make room for at least this many entries; it takes effect when the group is bound again."""
        self.room = max(need + need // 4, 16)

    def perceive(self, awareness: Awareness) -> bool:
        """Update the arrays to the present neighbour lists; return whether there was room."""
        entry = perceive_entry(awareness)
        need = entry(self.record) if entry else 0
        if need > self.room:
            self.grow(need)
            return False
        if self.is_situated:
            situate_entry(awareness)(self.record)
        return True

    def situate(self, awareness: Awareness, moment: tuple[int, int]) -> npt.NDArray[np.float32]:
        """Return the situation vectors of the present moment, shape (n, width)."""
        if self._situated_at != moment:
            sensing = self.record.value
            team_size = sum(len(one.value.sensing_range) for one in sensing.scene.team)
            self._situations = np.zeros((self.size, sum(awareness.width(max(team_size, 1)))), np.float32)
            situate_entry(awareness)(SENSING.pack(sensing._replace(situation=self._situations)))
            self._situated_at = moment
        return self._situations
