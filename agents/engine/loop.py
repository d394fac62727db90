"""The loop: the same kernels for one step and for many, with no Python in between.

A step is: perceive → decide → move → interact → search for neighbours → record → watch. Everything that differs from
group to group is reached through the addresses of entries, so this file is compiled once, whatever policies, degrees
and arenas there are. Kernels here take the address of the world's record; see `teamsight.agents.engine.records`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.agents.engine.detection import detect
from teamsight.agents.engine.due import decide_due, list_due, perceive_due
from teamsight.agents.engine.records import (
    BAD_ACTION,
    BAD_SENSING,
    DONE,
    GROW_DETECTION,
    GROW_PERCEPT,
    GROW_RELATION,
    HISTORY_COLUMNS,
    OUTSIDE,
    group_at,
    interaction_at,
    relation_at,
    world_at,
)
from teamsight.agents.recording.transitions import record_after, record_before
from teamsight.core.kernel import Entry, array_at, call, inlined, kernel, plain
from teamsight.world.motion import is_action, move_at
from teamsight.world.noise import TICKS_A_BLOCK, fill_block
from teamsight.world.proximity.search import append, is_near, limit_of, search, searching_at, shortest


@kernel
def keep(address: int, back: bool) -> None:
    """Save the positions of all bodies and what interactions write, or restore them."""
    world = world_at(address)
    at = 0
    for g in range(world.groups.shape[0]):
        move = move_at(group_at(world.groups[g]).move)
        for i in range(move.position.shape[0]):
            for axis in range(2):
                if back:
                    move.position[i, axis] = world.undo[at, axis]
                    move.heading[i, axis] = world.undo[at, 2 + axis]
                    move.moved[i, axis] = world.undo[at, 4 + axis]
                else:
                    world.undo[at, axis] = move.position[i, axis]
                    world.undo[at, 2 + axis] = move.heading[i, axis]
                    world.undo[at, 4 + axis] = move.moved[i, axis]
            at += 1
    for number in range(world.copies.shape[0]):
        size = world.copies[number, 2]
        present = array_at(world.copies[number, 0], size, np.uint8)
        copy = array_at(world.copies[number, 1], size, np.uint8)
        for byte in range(size):
            if back:
                present[byte] = copy[byte]
            else:
                copy[byte] = present[byte]


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


@kernel
def _perceive(address: int) -> int:
    """Draw the noise of this tick and update the percepts of all groups."""
    world = world_at(address)
    progress = world.progress[0]
    block = progress.tick // TICKS_A_BLOCK
    world.time[0] = progress.tick
    if world.show_columns != 0:
        call(world.show_columns, world.columns)
    for g in range(world.groups.shape[0]):
        group = group_at(world.groups[g])
        if group.due != 0 and list_due(group.due, progress.tick) == 0:
            continue
        if group.noise.shape[1] > 0 and group.block[0] != block:
            fill_block(group.noise, world.key, group.stream, progress.tick, group.members)
            group.block[0] = block
        if group.due != 0:
            need = perceive_due(group.due, group.perceive, group.situate, group.room)
            if need > group.room:
                progress.where = g
                progress.need = need
                return GROW_PERCEPT
            continue
        if group.perceive != 0:
            need = call(group.perceive, group.sensing)
            if need > group.room:
                progress.where = g
                progress.need = need
                return GROW_PERCEPT
        if group.situate != 0:
            call(group.situate, group.sensing)
    return DONE


@kernel
def _are_actions(address: int) -> bool:
    """Whether all actions of a group, given by the record of its move, can be carried out."""
    move = move_at(address)
    for i in range(move.distance.shape[0]):  # noqa: SIM110 (kernels have no generators)
        if not is_action(move.aim[i, 0], move.aim[i, 1], move.distance[i]):
            return False
    return True


@kernel
def _decide(address: int) -> int:
    """Run the policies that have kernels, and check the actions of all groups before any body moves."""
    world = world_at(address)
    for g in range(world.groups.shape[0]):
        group = group_at(world.groups[g])
        if group.due != 0:
            decide_due(group.due, world.progress[0].tick)
        elif group.decide != 0:
            call(group.decide, group.decision)
        if group.is_sound == 0 and not _are_actions(group.move):
            world.progress[0].where = g
            return BAD_ACTION
    return DONE


@kernel
def _move(address: int) -> int:
    world = world_at(address)
    for number in range(world.logs.shape[0]):
        record_before(world.logs[number])
    if world.interact != 0:
        status = call(world.interact, address)
        world.progress[0].phase = status == DONE
        return int(status)
    if world.undo.shape[0] > 0:
        keep(address, False)
    for g in range(world.groups.shape[0]):
        group = group_at(world.groups[g])
        if call(group.advance, group.move) != 0:
            keep(address, True)
            world.progress[0].where = g
            return OUTSIDE
    world.progress[0].phase = 1
    return DONE


@kernel
def _find_neighbours(address: int, tick: int) -> int:
    """Search for the neighbours of all relations at the positions of a tick, and apply the sensors."""
    world = world_at(address)
    world.moment[0] = tick
    for r in range(world.relations.shape[0]):
        relation = relation_at(world.relations[r])
        at = 0
        for g in range(relation.groups.shape[0]):
            position = move_at(group_at(relation.groups[g]).move).position
            for j in range(position.shape[0]):
                relation.x[at + j] = position[j, 0]
                relation.y[at + j] = position[j, 1]
            at += position.shape[0]
        if relation.conditions.reach.shape[0] > 0:
            call(world.hide, world.relations[r])
        edges = search(relation.search)
        if edges > relation.identity.shape[0]:
            world.progress[0].where = r
            world.progress[0].need = edges
            return GROW_RELATION
        for k in range(edges):
            relation.identity[k] = relation.everyone[relation.neighbours.identity[k]]
        if relation.detection != 0:
            need = detect(relation.detection)
            if need < 0:
                world.progress[0].where = r
                return BAD_SENSING
            if need > relation.true_index.shape[0]:
                world.progress[0].where = r
                world.progress[0].need = need
                return GROW_DETECTION
    for number in range(world.relays.shape[0]):
        call(world.show_late, world.relays[number])
    return DONE


@kernel
def _watch(address: int, is_step: bool) -> None:
    """Call the watchers, those that see changes between steps or all after a step; note which of them stop the loop."""
    world = world_at(address)
    watchers = world.watchers
    for number in range(watchers.shape[0]):
        watchers[number, 3] = 0
        if is_step or watchers[number, 2] != 0:
            watchers[number, 3] = call(watchers[number, 0], watchers[number, 1])
            if watchers[number, 3] != 0:
                world.progress[0].stopped = 1
                world.progress[0].steps = 0


@kernel
def _finish(address: int) -> int:
    """Search for neighbours after a move, record the step, and call the watchers."""
    status = _find_neighbours(address, world_at(address).progress[0].tick + 1)
    world = world_at(address)
    progress = world.progress[0]
    if status == BAD_SENSING:
        keep(address, True)
        progress.phase = 0
    if status != DONE:
        return status
    for number in range(world.logs.shape[0]):
        record_after(world.logs[number])
    for r in range(world.relations.shape[0]):
        record_relation(world.relations[r], world.history[progress.row, r], progress.tick + 1)
    for number in range(world.interactions.shape[0]):
        here = interaction_at(world.interactions[number])
        for s in range(here.scores.shape[0]):
            world.scores[progress.row, here.first_score + s] = here.scores[s]
    progress.row += 1
    progress.tick += 1
    progress.phase = 0
    if world.every > 0 and progress.tick % world.every == 0:
        leave_trail(address)
    if world.watchers.shape[0] > 0:
        _watch(address, True)
    return DONE


def _run(address: int) -> int:
    progress = world_at(address).progress[0]
    while progress.phase == 1 or progress.steps > 0:
        status = 0
        if progress.phase == 0:
            progress.steps -= 1
            status = _perceive(address)
            if status == DONE:
                status = _decide(address)
            if status == DONE:
                status = _move(address)
            if status != DONE:
                progress.steps += 1
                return status
        status = _finish(address)
        if status != DONE:
            return status
    return DONE


def _end_step(address: int) -> int:
    if world_at(address).progress[0].phase == 0:
        status = _decide(address)
        if status == DONE:
            status = _move(address)
        if status != DONE:
            return status
    return _finish(address)


def _see(address: int) -> int:
    status = _find_neighbours(address, world_at(address).progress[0].tick)
    if status != DONE:
        return status
    record_present(address)
    return DONE


def _look(address: int) -> int:
    _watch(address, False)
    return DONE


RUN = Entry(_run)
BEGIN_STEP = Entry(plain(_perceive))
END_STEP = Entry(_end_step)
SEE = Entry(_see)
LOOK = Entry(_look)


@inlined
def _way(searching: Any, i: int, j: int) -> tuple[float, float]:
    """Return the way from observer `i` to body `j`, as the search computes it."""
    observed = searching.observed
    x = observed.x[j] - searching.position[i, 0]
    y = observed.y[j] - searching.position[i, 1]
    if observed.period_x > 0.0:
        x = shortest(x, observed.period_x)
        y = shortest(y, observed.period_y)
    return x, y


@inlined
def _finds(searching: Any, i: int, j: int) -> Any:
    """Whether observer `i` finds body `j`."""
    x, y = _way(searching, i, j)
    myself = searching.observed.own >= 0 and searching.observed.own + i == j
    shape = searching.observed.shape
    return is_near(x, y, limit_of(searching.reach[i], shape), shape) and not myself


@inlined
def _put_found(searching: Any, at: int, i: int, j: int) -> None:
    x, y = _way(searching, i, j)
    append(searching.neighbours, at, j, x, y, math.sqrt(x * x + y * y))


@inlined
def _copy_entry(graph: Any, source: int, at: int) -> None:
    append(graph, at, graph.identity[source], graph.offset[source, 0], graph.offset[source, 1], graph.distance[source])


@kernel
def _drop_entries(graph: Any, observer: int, body: int) -> None:
    """Leave out the entries of an observer, and those that show a body; −1 for none."""
    at = 0
    k = 0
    for i in range(graph.start.shape[0] - 1):
        end = graph.start[i + 1]
        while k < end:
            if i != observer and graph.identity[k] != body:
                _copy_entry(graph, k, at)
                at += 1
            k += 1
        graph.start[i + 1] = at


@kernel
def _show_body(address: int, body: int) -> bool:
    """Insert a body into the lists of all that find it; return whether there was room."""
    searching = searching_at(address)
    graph = searching.neighbours
    observers = graph.start.shape[0] - 1
    at = graph.start[observers]
    k = at - 1
    for i in range(observers):
        at += _finds(searching, i, body)
    if at > graph.identity.shape[0]:
        return False
    # From the last entry on, so that nothing is overwritten before it is moved.
    for i in range(observers - 1, -1, -1):
        first = graph.start[i]
        graph.start[i + 1] = at
        is_due = _finds(searching, i, body)
        while k >= first or is_due:
            at -= 1
            if is_due and (k < first or graph.identity[k] < body):
                _put_found(searching, at, i, body)
                is_due = False
            else:
                _copy_entry(graph, k, at)
                k -= 1
    return True


@kernel
def _fill_list(address: int, observer: int) -> bool:
    """Fill the empty list of an observer; return whether there was room."""
    searching = searching_at(address)
    graph = searching.neighbours
    observers = graph.start.shape[0] - 1
    found = 0
    for j in range(searching.observed.size):
        found += _finds(searching, observer, j)
    if graph.start[observers] + found > graph.identity.shape[0]:
        return False
    for k in range(graph.start[observers] - 1, graph.start[observer] - 1, -1):
        _copy_entry(graph, k, k + found)
    at = graph.start[observer]
    for j in range(searching.observed.size):
        if _finds(searching, observer, j):
            _put_found(searching, at, observer, j)
            at += 1
    for i in range(observer + 1, observers + 1):
        graph.start[i] += found
    return True


@kernel
def _change_body(address: int, group: int, row: int) -> bool:
    """Write a body of an observed group into the lists, or take it out; return whether there was room."""
    relation = relation_at(address)
    first = 0
    for g in range(relation.groups.shape[0]):
        move = move_at(group_at(relation.groups[g]).move)
        if relation.groups[g] == group:
            is_active = move.active.shape[0] == 0 or move.active[row]
            body = first + row
            is_hidden = math.isnan(relation.x[body])
            if is_active and is_hidden:
                relation.x[body] = move.position[row, 0]
                relation.y[body] = move.position[row, 1]
                return _show_body(relation.search, body)  # type: ignore[no-any-return]
            if not is_active and not is_hidden:
                relation.x[body] = math.nan
                relation.y[body] = math.nan
                _drop_entries(relation.neighbours, -1, body)
            return True
        first += move.position.shape[0]
    return True


@kernel
def _change_observer(address: int, row: int) -> bool:
    """Fill the list of an observer, or empty it; return whether there was room."""
    relation = relation_at(address)
    conditions = relation.conditions
    senses = conditions.active[row] and conditions.works[row]
    if senses and conditions.reach[row] < 0.0:
        conditions.reach[row] = conditions.full[row]
        return _fill_list(relation.search, row)  # type: ignore[no-any-return]
    if not senses and conditions.reach[row] >= 0.0:
        conditions.reach[row] = -1.0
        _drop_entries(relation.neighbours, row, -1)
    return True


def _change(address: int) -> int:
    """Bring the lists up to date after a change of one body: its group and row are in ``where`` and ``need``."""
    world = world_at(address)
    group = world.groups[world.progress[0].where]
    row = world.progress[0].need
    for r in range(world.relations.shape[0]):
        relation = relation_at(world.relations[r])
        if relation.conditions.reach.shape[0] == 0:
            continue
        has_room = _change_body(world.relations[r], group, row)
        if has_room and relation.observers == group:
            has_room = _change_observer(world.relations[r], row)
        if not has_room:
            return GROW_RELATION
        for k in range(relation.neighbours.start[relation.neighbours.start.shape[0] - 1]):
            relation.identity[k] = relation.everyone[relation.neighbours.identity[k]]
    record_present(address)
    return DONE


CHANGE = Entry(_change)
