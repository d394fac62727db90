"""What the loop records of a step: the numbers of each relation, and the positions."""

from __future__ import annotations

import math
from typing import Any

from teamsight.agents.engine.conditions import count_active, count_observers
from teamsight.agents.engine.records import HISTORY_COLUMNS, group_at, relation_at, world_at
from teamsight.core.kernel import kernel
from teamsight.world.motion import move_at


@kernel
def record_relation(address: int, row: Any, stamp: int) -> None:
    """Write the number of neighbours, the most of one observer, and the number of bodies detected first here."""
    here = relation_at(address)
    start = here.neighbours.start
    observers = start.shape[0] - 1
    largest = 0
    for i in range(observers):
        largest = max(largest, start[i + 1] - start[i])
    observed = 0
    for k in range(here.true_start[observers]):
        body = here.rows[here.true_index[k]]
        observed += here.met[body] != stamp
        here.met[body] = stamp
    row[0] = start[observers]
    row[1] = largest
    row[2] = observed
    if row.shape[0] > HISTORY_COLUMNS:
        row[3] = count_observers(address)
        row[4] = 0
        for g in range(here.counted.shape[0]):
            row[4] += count_active(here.counted[g])


@kernel
def record_present(address: int) -> None:
    """Record the present positions, between steps."""
    world = world_at(address)
    # No step has a stamp below 0, but an earlier call of this function may have had this one.
    for r in range(world.relations.shape[0]):
        met = relation_at(world.relations[r]).met
        for body in range(met.shape[0]):
            met[body] = 0
    for r in range(world.relations.shape[0]):
        record_relation(world.relations[r], world.present[r], -1 - world.progress[0].tick)


@kernel
def leave_trail(address: int) -> None:
    """Write the positions of all groups; NaN for bodies that are inactive."""
    world = world_at(address)
    trail = world.trail[world.progress[0].trail_row]
    at = 0
    for g in range(world.groups.shape[0]):
        move = move_at(group_at(world.groups[g]).move)
        position = move.position
        for i in range(position.shape[0]):
            trail[at + i, 0] = position[i, 0]
            trail[at + i, 1] = position[i, 1]
        for i in range(move.active.shape[0]):
            if not move.active[i]:
                trail[at + i, 0] = math.nan
                trail[at + i, 1] = math.nan
        at += position.shape[0]
    world.progress[0].trail_row += 1
