"""Relays: teammates know late what a group senses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.engine.detection import Integers, ReadingArrays, Readings
from teamsight.core.kernel import Entry, Record, kernel
from teamsight.core.neighbour_list import NeighbourList, neighbour_room
from teamsight.world.proximity.search import append

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.core.kernel import Packed

Floats = npt.NDArray[np.float64]


class RelayArrays(NamedTuple):
    """The record of a relay of a group's targets and headings.

    Attributes
    ----------
    tick : ndarray, shape (1,), int64
        The tick of the present positions.
    delay : int
        The number of ticks until teammates know what the group senses.
    heading : ndarray, shape (n, 2), float64
        The present headings.
    targets : NeighbourList
        The targets that the group senses now.
    place : ndarray, shape (k,), int64
        The index of each of them among the observed.
    x : ndarray, shape (observed,) or (0,), float64
        NaN for targets that are inactive; empty if none ever is.
    readings : ReadingArrays
        Those of the last ticks.
    headings : ndarray, shape (slots, n, 2), float64
        The headings of the last ticks.
    shown, shown_heading
        What teammates know.
    """

    tick: Annotated[Integers, 1]
    delay: int
    heading: Annotated[Floats, "n", 2]
    targets: NeighbourList
    place: Annotated[Integers, ".place"]
    x: Annotated[Floats, ".x"]
    readings: ReadingArrays
    headings: Annotated[Floats, "slots", "n", 2]
    shown: NeighbourList
    shown_heading: Annotated[Floats, "n", 2]


RELAY = Record(RelayArrays)
_relay_at = RELAY.at


def _relay(address: int) -> int:
    """Keep the present targets and headings of a group, and show those that are due; none if there were none then."""
    here = _relay_at(address)
    slots = here.readings.tick.shape[0]
    slot = here.tick[0] % slots
    here.readings.tick[slot] = here.tick[0]
    _keep(here, slot)
    due = here.tick[0] - here.delay
    is_there = due >= 0 and here.readings.tick[due % slots] == due
    _show(here, due % slots, is_there)
    return 0


@kernel
def _keep(here: Any, slot: int) -> None:
    kept, targets = here.readings, here.targets
    size = here.heading.shape[0]
    for i in range(size + 1):
        kept.start[slot, i] = targets.start[i]
    for i in range(size):
        for axis in range(2):
            here.headings[slot, i, axis] = here.heading[i, axis]
    for k in range(targets.start[size]):
        kept.identity[slot, k] = targets.identity[k]
        kept.place[slot, k] = here.place[k]
        kept.distance[slot, k] = targets.distance[k]
        for axis in range(2):
            kept.offset[slot, k, axis] = targets.offset[k, axis]


@kernel
def _show(here: Any, slot: int, is_there: bool) -> None:
    kept, shown = here.readings, here.shown
    size = here.heading.shape[0]
    for i in range(size):
        for axis in range(2):
            here.shown_heading[i, axis] = here.headings[slot, i, axis] if is_there else here.heading[i, axis]
    at = 0
    shown.start[0] = 0
    for i in range(size):
        for k in range(kept.start[slot, i], kept.start[slot, i + 1] if is_there else kept.start[slot, i]):
            # Nobody shows a target that is inactive now.
            if here.x.shape[0] == 0 or not math.isnan(here.x[kept.place[slot, k]]):
                x = kept.offset[slot, k, 0]
                y = kept.offset[slot, k, 1]
                append(shown, at, kept.identity[slot, k], x, y, kept.distance[slot, k])
                at += 1
        shown.start[i + 1] = at


SHOW_LATE = Entry(_relay)


class RelayReadings(Readings):
    """The targets that a group has sensed in the last ticks, and its headings.

    Attributes
    ----------
    headings : ndarray, shape (slots, n, 2), float64
        The headings.
    """

    def __init__(self, delay: int) -> None:
        super().__init__(delay)
        self.headings = np.zeros((delay + 1, 0, 2))

    def fit(self, observers: Integers, everyone: Integers, room: int) -> None:
        """Adapt to the present agents; see `Readings.fit`."""
        row_of = {member: row for row, member in enumerate(self._observers.tolist())}
        old, self.headings = self.headings, np.zeros((self.delay + 1, len(observers), 2))
        for row, member in enumerate(observers.tolist()):
            if member in row_of:
                self.headings[:, row] = old[:, row_of[member]]
        super().fit(observers, everyone, room)


def relays_of(groups: list[Group], tick: Integers) -> dict[tuple[int, int], Packed[RelayArrays]]:
    """Return the relays of a world, by the number of the group that relays and the delay, and forget all others."""
    delays = {delay_of(group) for group in groups} - {0}
    found = {}
    for group in groups:
        mine = [delay for delay in sorted(delays) if _is_known_late(groups, group, delay)]
        for name in [name for name, kept in group.readings.items() if isinstance(kept, RelayReadings)]:
            if name not in map(_name, mine):
                del group.readings[name]
        for delay in mine:
            found[group.number, delay] = _relay_of(group, delay, tick)
    return found


def delay_of(group: Group) -> int:
    """Return the number of ticks after which a group knows of its teammates."""
    channel = group.channels.get(TEAMMATES)
    return channel.sensor.delay if channel and channel.sensor else 0


def _is_known_late(groups: list[Group], group: Group, delay: int) -> bool:
    return group.team is not None and any(
        other.team == group.team and delay_of(other) == delay for other in groups
    )


def _name(delay: int) -> str:
    return f"{TEAMMATES} after {delay}"


def _relay_of(group: Group, delay: int, tick: Integers) -> Packed[RelayArrays]:
    relation, targets = group.relations.get(TARGETS), group.room(TARGETS)
    readings = group.readings.setdefault(_name(delay), RelayReadings(delay))
    assert isinstance(readings, RelayReadings)
    room = len(targets.identity)
    readings.fit(group.bodies.member, relation.everyone if relation else np.zeros(0, np.int64), room)
    place, x = relation.place if relation else np.zeros(0, np.int64), np.zeros(0)
    if relation and relation.is_conditional:
        x = relation.search.x
    return RELAY.pack(RelayArrays(
        tick, delay, group.bodies.heading, targets, place, x, readings.arrays, readings.headings,
        neighbour_room(len(group), room), group.bodies.heading.copy(),
    ))  # fmt: skip
