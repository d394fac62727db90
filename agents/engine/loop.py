"""The loop: the same kernels for one step and for many, with no Python in between.

A step is: perceive → decide → advance → new sightings → record. Everything that differs from group to group is reached
through the addresses of entries, so this file is compiled once, whatever policies, degrees and arenas there are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.agents.engine.records import (
    BAD_ACTION,
    DONE,
    GROUP,
    GROW_PERCEPT,
    GROW_RELATION,
    HISTORY_COLUMNS,
    OUTSIDE,
    RELATION,
    WORLD,
)
from teamsight.agents.recording.transition_kernels import note_after, note_before
from teamsight.core.kernel import Entry, array_at, call, kernel
from teamsight.policies.compiled import DECISION
from teamsight.world.motion import MOVE, is_action
from teamsight.world.noise import TICKS_A_BLOCK, fill_block
from teamsight.world.proximity.search import search


@kernel
def _hand_out_noise(world: Any, group: Any) -> None:
    """Give the group's policy the numbers of this tick; four ticks are made at a time."""
    block = world.tick // TICKS_A_BLOCK
    if group.noise_block != block:
        numbers = array_at(group.noise, (TICKS_A_BLOCK, group.draws, group.lanes), np.float64)
        identity = array_at(group.identity, group.lanes, np.int64)
        key = array_at(world.key, 2, np.uint64)
        fill_block(numbers, key, group.stream, world.tick, identity)
        group.noise_block = block
    if group.decision != 0:
        decision = array_at(group.decision, 1, DECISION)[0]
        decision.noise = group.noise + (world.tick % TICKS_A_BLOCK) * group.draws * group.lanes * 8


@kernel
def _perceive(world: Any) -> int:
    """Hand out noise and bring the percepts of all groups up to date."""
    groups = array_at(world.groups, world.group_count, GROUP)
    for g in range(world.group_count):
        group = groups[g]
        if group.draws > 0:
            _hand_out_noise(world, group)
        if group.perceive != 0:
            need = call(group.perceive, group.scene)
            if need > group.room:
                world.where = g
                world.need = need
                return GROW_PERCEPT
        if group.situate != 0:
            call(group.situate, group.scene)
    return DONE


@kernel
def _decide(world: Any) -> int:
    """Let the policies decide that have kernels, and check the actions of all groups before anybody moves."""
    groups = array_at(world.groups, world.group_count, GROUP)
    for g in range(world.group_count):
        group = groups[g]
        if group.decide != 0:
            call(group.decide, group.decision)
        if group.sound != 0:
            continue
        move = array_at(group.move, 1, MOVE)[0]
        heading = array_at(move.action_heading, (group.size, 2), np.float64)
        distance = array_at(move.action_distance, group.size, np.float64)
        for i in range(group.size):
            if not is_action(heading[i, 0], heading[i, 1], distance[i]):
                world.where = g
                return BAD_ACTION
    return DONE


@kernel
def _keep(world: Any, back: bool) -> None:
    """Keep where all bodies are, or put them back there."""
    groups = array_at(world.groups, world.group_count, GROUP)
    kept = array_at(world.kept, (world.bodies, 6), np.float64)
    at = 0
    for g in range(world.group_count):
        move = array_at(groups[g].move, 1, MOVE)[0]
        position = array_at(move.position, (move.size, 2), np.float64)
        heading = array_at(move.heading, (move.size, 2), np.float64)
        moved = array_at(move.moved, (move.size, 2), np.float64)
        for i in range(move.size):
            for axis in range(2):
                if back:
                    position[i, axis] = kept[at + i, axis]
                    heading[i, axis] = kept[at + i, 2 + axis]
                    moved[i, axis] = kept[at + i, 4 + axis]
                else:
                    kept[at + i, axis] = position[i, axis]
                    kept[at + i, 2 + axis] = heading[i, axis]
                    kept[at + i, 4 + axis] = moved[i, axis]
        at += move.size


@kernel
def _move(world: Any) -> int:
    if world.log_count > 0:
        note_before(world)
    groups = array_at(world.groups, world.group_count, GROUP)
    if world.kept != 0:
        _keep(world, False)
    for g in range(world.group_count):
        if call(groups[g].advance, groups[g].move) != 0:
            _keep(world, True)
            world.where = g
            return OUTSIDE
    world.phase = 1
    return DONE


@kernel
def _look(world: Any) -> int:
    """Find all sightings anew."""
    relations = array_at(world.relations, world.relation_count, RELATION)
    for r in range(world.relation_count):
        relation = relations[r]
        parts = array_at(relation.parts, (relation.part_count, 2), np.int64)
        x = array_at(relation.x, relation.observed, np.float64)
        y = array_at(relation.y, relation.observed, np.float64)
        at = 0
        for part in range(relation.part_count):
            size = parts[part, 1]
            position = array_at(parts[part, 0], (size, 2), np.float64)
            for j in range(size):
                x[at + j] = position[j, 0]
                y[at + j] = position[j, 1]
            at += size
        edges = search(relation.search)
        if edges > relation.room:
            world.where = r
            world.need = edges
            return GROW_RELATION
        index = array_at(relation.index, relation.room, np.int64)
        identity = array_at(relation.identity, relation.room, np.int64)
        everyone = array_at(relation.everyone, relation.observed, np.int64)
        for k in range(edges):
            identity[k] = everyone[index[k]]
    return DONE


@kernel
def _record(world: Any) -> None:
    """Write what the step led to: edges, largest degree and how many are observed, for each relation."""
    relations = array_at(world.relations, world.relation_count, RELATION)
    row = array_at(
        world.history + world.row * world.relation_count * HISTORY_COLUMNS * 8,
        (world.relation_count, HISTORY_COLUMNS),
        np.int64,
    )
    stamp = world.tick + 1
    for r in range(world.relation_count):
        relation = relations[r]
        start = array_at(relation.start, relation.observers + 1, np.int64)
        largest = 0
        for i in range(relation.observers):
            largest = max(largest, start[i + 1] - start[i])
        edges = start[relation.observers]
        index = array_at(relation.index, relation.room, np.int64)
        rows = array_at(relation.rows, relation.observed, np.int64)
        met = array_at(relation.met, world.bodies, np.int64)
        observed = 0
        for k in range(edges):
            body = rows[index[k]]
            observed += met[body] != stamp
            met[body] = stamp
        row[r, 0] = edges
        row[r, 1] = largest
        row[r, 2] = observed
    world.row += 1


@kernel
def _leave_trail(world: Any) -> None:
    """Write the positions of all groups."""
    groups = array_at(world.groups, world.group_count, GROUP)
    trail = array_at(world.trail + world.trail_row * world.bodies * 16, (world.bodies, 2), np.float64)
    at = 0
    for g in range(world.group_count):
        position = array_at(groups[g].position, (groups[g].size, 2), np.float64)
        for i in range(groups[g].size):
            trail[at + i, 0] = position[i, 0]
            trail[at + i, 1] = position[i, 1]
        at += groups[g].size
    world.trail_row += 1


@kernel
def _finish(world: Any) -> int:
    """Find the sightings after a move and record the step."""
    status = _look(world)
    if status != DONE:
        return status
    if world.log_count > 0:
        note_after(world)
    _record(world)
    world.tick += 1
    world.phase = 0
    if world.every > 0 and world.tick % world.every == 0:
        _leave_trail(world)
    return DONE


def _run(address: int) -> int:
    world = array_at(address, 1, WORLD)[0]
    while world.phase == 1 or world.steps > 0:
        status = 0
        if world.phase == 0:
            world.steps -= 1
            status = _perceive(world)
            if status == DONE:
                status = _decide(world)
            if status == DONE:
                status = _move(world)
            if status != DONE:
                world.steps += 1
                return status
        status = _finish(world)
        if status != DONE:
            return status
    return DONE


def _begin_step(address: int) -> int:
    return _perceive(array_at(address, 1, WORLD)[0])


def _end_step(address: int) -> int:
    world = array_at(address, 1, WORLD)[0]
    if world.phase == 0:
        status = _decide(world)
        if status == DONE:
            status = _move(world)
        if status != DONE:
            return status
    return _finish(world)


def _see(address: int) -> int:
    return _look(array_at(address, 1, WORLD)[0])


RUN = Entry(_run)
BEGIN_STEP = Entry(_begin_step)
END_STEP = Entry(_end_step)
SEE = Entry(_see)
