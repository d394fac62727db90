"""Relaying: which groups know late what their teammates sense, and the arrays for it."""

from __future__ import annotations

import numpy as np

from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.engine.readings import Integers
from teamsight.agents.engine.relays import RELAY, RelayArrays, RelayReadings
from teamsight.agents.group import Group
from teamsight.core.kernel import Packed
from teamsight.core.neighbour_list import neighbour_room


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
            found[group.number, delay] = _relay(group, delay, tick)
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


def _relay(group: Group, delay: int, tick: Integers) -> Packed[RelayArrays]:
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
