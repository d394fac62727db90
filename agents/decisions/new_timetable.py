"""New timetables: for a group with a cycle, and for one whose robots can be inactive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.agents.decisions.cycle import EVERY_STEP, Cycle
from teamsight.agents.decisions.timetable import Timetable
from teamsight.agents.fixed import put
from teamsight.agents.group import Group

if TYPE_CHECKING:
    from teamsight.agents.world_data import WorldData


def new_timetable(data: WorldData, group: Group, cycle: Cycle = EVERY_STEP) -> Timetable:
    """Return the timetable of a group with a cycle that begins now; it is not yet the group's."""
    members, tick = group.bodies.member, data.timeline.tick
    if group.timetable is None:
        so_far = max(group.members_so_far, len(members))
        # After a failed step the kernels have decided at this tick, and learned from what they got before.
        decided_at = np.full(len(members), tick) if group.has_decided else group.decided_at
        table = Timetable.made(group.number, cycle, members, so_far, decided_at, group.action)
    else:
        table = group.timetable.with_cycle(cycle, members)
    table.begin(slice(None), data.key, members, tick)
    return table


def put_timetable(group: Group, table: Timetable) -> None:
    """Give a group a timetable; its records must be bound again."""
    put(group, timetable=table)
    group.action = table.action


def give_timetables(data: WorldData) -> None:
    """Give a timetable to the groups that need one and have none: those with inactive robots."""
    for group in data.groups:
        if group.needs_timetable and group.timetable is None:
            put_timetable(group, new_timetable(data, group))


def is_every_step(group: Group) -> bool:
    """Whether all active robots of a group decide at every step."""
    return group.timetable is None or group.timetable.cycle() == EVERY_STEP
