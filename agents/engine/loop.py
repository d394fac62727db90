"""The loop: the same kernels for one step and for many, with no Python in between.

A step is a list of phases: perceive → decide → move → interact → search for neighbours → record → watch. Each is the
address of an entry and that of its record, for a group, a relation or the world; a world has only those that it needs.
So each is compiled once, whatever policies, degrees and arenas there are; see `teamsight.agents.engine.binding`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from teamsight.agents.engine.due import decide_due, list_due
from teamsight.agents.engine.records import (
    DONE,
    FAILED,
    HISTORY_COLUMNS,
    copying_at,
    group_at,
    relation_at,
    trail_at,
    watching_at,
    world_at,
)
from teamsight.core.kernel import Entry, Packed, Record, array_at, call, inlined, kernel
from teamsight.world.motion import FINISHED, is_action, move_at
from teamsight.world.noise import TICKS_A_BLOCK, fill_block


def _run(address: int) -> int:
    """Make steps, phase by phase, until one cannot go on; return what it returned.

    What a step has computed before bodies move depends on the present state only, and is computed again.
    """
    world = world_at(address)
    progress, phases = world.progress[0], world.phases
    while progress.steps > 0:
        world.time[0] = progress.tick
        world.moment[0] = progress.tick + 1
        for at in range(progress.phase, phases.shape[0]):
            status: int = call(phases[at, 0], phases[at, 1])
            if status != DONE:
                has_moved = at > world.move
                progress.halted = at
                progress.phase = at if has_moved and status > 0 else 0
                if has_moved and status < 0 and world.restore != 0:
                    call(phases[world.move, 0], world.restore)
                return status
        progress.phase = 0
    return DONE


RUN = Entry(_run)


class OwnCall(NamedTuple):
    """The record of a call of an entry that calls kernels of the user's."""

    entry: Entry
    argument: Packed[Any]


OWN = Record(OwnCall)
own_at = OWN.at

#: What `CALL_OWN` returns if one of these kernels has raised an exception.
RAISED = -(1 << 62)


def _call_own(address: int) -> int:
    here = own_at(address)
    status: int = call(here.entry, here.argument)
    if status == FINISHED:
        return DONE
    return status if status != 0 else RAISED


CALL_OWN = Entry(_call_own)


def guarded(entry: Entry, record: Packed[Any], has_own: bool) -> tuple[Entry, Packed[Any]]:
    """Return what to call in place of an entry, and with what, if that calls kernels of the user's."""
    return (CALL_OWN, OWN.pack(OwnCall(entry, record))) if has_own else (entry, record)


@inlined
def _draw(group: Any) -> None:
    """Draw the noise of four ticks at their first."""
    block = group.tick[0] // TICKS_A_BLOCK
    if group.noise.shape[1] > 0 and group.block[0] != block:
        fill_block(group.noise, group.key, group.stream, group.tick[0], group.members)
        group.block[0] = block


def _perceive(address: int) -> int:
    """Draw the noise of a group and update its percept, if any of it decides at this tick."""
    group = group_at(address)
    if group.due != 0 and list_due(group.due, group.tick[0]) == 0:
        return DONE
    _draw(group)
    if group.perceive != 0:
        need = call(group.perceive, group.sensing)
        if need > group.room:
            return need  # type: ignore[no-any-return]
    if group.situate != 0:
        call(group.situate, group.sensing)
    return DONE


@kernel
def _check_actions(address: int) -> int:
    """Return `FAILED` if an action of a group, given by the record of its move, cannot be carried out."""
    move = move_at(address)
    for i in range(move.distance.shape[0]):
        if not is_action(move.aim[i, 0], move.aim[i, 1], move.distance[i]):
            return FAILED
    return DONE


def _decide(address: int) -> int:
    """Run the policy of a group, if it has a kernel, and check the actions before any body moves."""
    group = group_at(address)
    if group.decide != 0:
        call(group.decide, group.decision)
    return _check_actions(group.move)  # type: ignore[no-any-return]


def _decide_due(address: int) -> int:
    group = group_at(address)
    decide_due(group.due, group.tick[0])
    return DONE if group.is_sound != 0 else _check_actions(group.move)


PERCEIVE, DECIDE, DECIDE_DUE = map(Entry, (_perceive, _decide, _decide_due))


def _copy(address: int) -> int:
    """Copy bytes: to keep what moves and interactions write, or to restore it."""
    arrays = copying_at(address).arrays
    for number in range(arrays.shape[0]):
        size = arrays[number, 2]
        source = array_at(arrays[number, 0], size, np.uint8)
        copy = array_at(arrays[number, 1], size, np.uint8)
        for byte in range(size):
            copy[byte] = source[byte]
    return DONE


COPY = Entry(_copy)


@kernel
def _hide(address: int) -> None:
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


def _find_neighbours(address: int) -> int:
    """Search for the neighbours of a relation at the present positions."""
    relation = relation_at(address)
    at = 0
    for g in range(relation.groups.shape[0]):
        position = move_at(group_at(relation.groups[g]).move).position
        for j in range(position.shape[0]):
            relation.x[at + j] = position[j, 0]
            relation.y[at + j] = position[j, 1]
        at += position.shape[0]
    if relation.conditions.reach.shape[0] > 0:
        _hide(address)
    edges = call(relation.find, relation.search)
    if edges > relation.identity.shape[0]:
        return edges  # type: ignore[no-any-return]
    for k in range(edges):
        relation.identity[k] = relation.everyone[relation.neighbours.identity[k]]
    return DONE


SEARCH = Entry(_find_neighbours)


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


@kernel
def _record_relation(address: int, row: Any, stamp: int) -> None:
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


def _record(address: int) -> int:
    """Record a step, which is then made."""
    world = world_at(address)
    progress = world.progress[0]
    for r in range(world.relations.shape[0]):
        _record_relation(world.relations[r], world.history[progress.row, r], progress.tick + 1)
    progress.row += 1
    progress.tick += 1
    progress.steps -= 1
    return DONE


def _record_present(address: int) -> int:
    """Record the present positions, between steps."""
    world = world_at(address)
    # No step has a stamp below 0, but an earlier call of this function may have had this one.
    for r in range(world.relations.shape[0]):
        met = relation_at(world.relations[r]).met
        for body in range(met.shape[0]):
            met[body] = 0
    for r in range(world.relations.shape[0]):
        _record_relation(world.relations[r], world.present[r], -1 - world.progress[0].tick)
    return DONE


RECORD, RECORD_PRESENT = Entry(_record), Entry(_record_present)


def _leave_trail(address: int) -> int:
    """Write the positions of all groups at every so many ticks; NaN for bodies that are inactive."""
    here = trail_at(address)
    progress = here.progress[0]
    if progress.tick % here.every != 0:
        return DONE
    trail = here.trail[progress.trail_row]
    at = 0
    for g in range(here.groups.shape[0]):
        move = move_at(group_at(here.groups[g]).move)
        position = move.position
        for i in range(position.shape[0]):
            trail[at + i, 0] = position[i, 0]
            trail[at + i, 1] = position[i, 1]
        for i in range(move.active.shape[0]):
            if not move.active[i]:
                trail[at + i, 0] = math.nan
                trail[at + i, 1] = math.nan
        at += position.shape[0]
    progress.trail_row += 1
    return DONE


LEAVE_TRAIL = Entry(_leave_trail)


def _watch(address: int) -> int:
    """Call the watchers, those that see changes between steps or all after a step; note which of them stop the loop."""
    here = watching_at(address)
    watchers = here.watchers
    for number in range(watchers.shape[0]):
        watchers[number, 3] = 0
        if here.is_step != 0 or watchers[number, 2] != 0:
            watchers[number, 3] = call(watchers[number, 0], watchers[number, 1])
            if watchers[number, 3] != 0:
                here.progress[0].stopped = 1
                here.progress[0].steps = 0
    return DONE


WATCH = Entry(_watch)
