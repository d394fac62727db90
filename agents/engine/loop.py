"""The loop: the same kernels for one step and for many, with no Python in between.

A step is: perceive → decide → move → interact → search for neighbours → record → watch. Everything that differs from
group to group is reached through the addresses of entries, so this file is compiled once, whatever policies, degrees
and arenas there are. Kernels here take the address of the world's record; see `teamsight.agents.engine.records`.
"""

from __future__ import annotations

from teamsight.agents.engine.detection import detect
from teamsight.agents.engine.due import decide_due, list_due, perceive_due
from teamsight.agents.engine.interaction_records import interaction_at
from teamsight.agents.engine.keeping import keep
from teamsight.agents.engine.records import (
    BAD_ACTION,
    BAD_SENSING,
    DONE,
    GROW_DETECTION,
    GROW_PERCEPT,
    GROW_RELATION,
    OUTSIDE,
    group_at,
    relation_at,
    world_at,
)
from teamsight.agents.engine.step_records import leave_trail, record_present, record_relation
from teamsight.agents.recording.transition_kernels import record_after, record_before
from teamsight.core.kernel import Entry, call, kernel, plain
from teamsight.world.motion import is_action, move_at
from teamsight.world.noise import TICKS_A_BLOCK, fill_block
from teamsight.world.proximity.search import search


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
