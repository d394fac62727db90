"""Conditions of bodies in the loop: who is inactive, or has a sensor out of order, is hidden from the search."""

from __future__ import annotations

import math

from teamsight.agents.engine.records import group_at, relation_at
from teamsight.core.kernel import Entry, kernel
from teamsight.world.motion import move_at


def _hide(address: int) -> int:
    """Put the inactive bodies of a relation where nobody finds them, and write how far each observer senses."""
    relation = relation_at(address)
    at = 0
    for g in range(relation.groups.shape[0]):
        move = move_at(group_at(relation.groups[g]).move)
        for j in range(move.active.shape[0]):
            if not move.active[j]:
                relation.x[at + j] = math.nan
                relation.y[at + j] = math.nan
        at += move.position.shape[0]
    conditions = relation.conditions
    for i in range(conditions.reach.shape[0]):
        senses = conditions.active[i] and conditions.works[i]
        conditions.reach[i] = conditions.full[i] if senses else -1.0
    return 0


HIDE = Entry(_hide)


@kernel
def count_active(address: int) -> int:
    """Return the number of active bodies of a group."""
    move = move_at(group_at(address).move)
    if move.active.shape[0] == 0:
        return move.position.shape[0]  # type: ignore[no-any-return]
    count = 0
    for i in range(move.active.shape[0]):
        count += move.active[i]
    return count


@kernel
def count_observers(address: int) -> int:
    """Return the number of active observers of a relation."""
    relation = relation_at(address)
    active = relation.conditions.active
    if active.shape[0] == 0:
        return relation.neighbours.start.shape[0] - 1  # type: ignore[no-any-return]
    count = 0
    for i in range(active.shape[0]):
        count += active[i]
    return count
