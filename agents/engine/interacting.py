"""The motion of a step in a world with interactions: bodies move, and the kernels of the interactions are called."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.agents.engine.interaction_records import interaction_at, partaker_at, role_at
from teamsight.agents.engine.keeping import keep
from teamsight.agents.engine.records import BAD_INTERACTION, DONE, OUTSIDE, group_at, world_at
from teamsight.core.kernel import Entry, call, inlined, kernel
from teamsight.core.kernel.window import move as show
from teamsight.world.interaction import COMPLETED
from teamsight.world.motion import move_at
from teamsight.world.noise import TICKS_A_BLOCK, fill_block
from teamsight.world.region import is_in_region

#: What a kernel has left wrong: a position outside the arena, a heading that is no unit vector, a speed below 0 or not
#: finite, a reward that is not finite, a score that is not finite; or it has raised an exception.
BAD_POSITION, BAD_HEADING, BAD_SPEED, BAD_REWARD, BAD_SCORE, RAISED = range(1, 7)


@kernel
def _begin(address: int) -> None:
    """Begin the step of all groups that take part: nobody has moved, and those that decided have got nothing since."""
    world = world_at(address)
    tick = world.progress[0].tick
    for p in range(world.partakers.shape[0]):
        partaker = partaker_at(world.partakers[p])
        move = move_at(group_at(partaker.group).move)
        timed = partaker.decided_at.shape[0] > 0
        for i in range(move.position.shape[0]):
            for axis in range(2):
                partaker.before[i, axis] = move.position[i, axis]
                move.moved[i, axis] = 0.0
            partaker.last_rewards[0, i] = 0.0
            partaker.last_rewards[1, i] = 0.0
            if not timed or partaker.decided_at[i] == tick:
                partaker.reward[i] = 0.0
                partaker.ended[i] = False
    for number in range(world.interactions.shape[0]):
        here = interaction_at(world.interactions[number])
        for s in range(here.scores.shape[0]):
            here.scores[s] = 0.0


@kernel
def _draw(address: int, tick: int) -> None:
    """Show the kernel the random numbers of a tick."""
    here = interaction_at(address)
    block = tick // TICKS_A_BLOCK
    if here.block[0] != block:
        for r in range(here.roles.shape[0]):
            role = role_at(here.roles[r])
            if role.noise.shape[1] > 0:
                fill_block(role.noise, here.key, role.stream, tick, role.members)
        here.block[0] = block
    show(here.words, here.moves, tick % TICKS_A_BLOCK)


@inlined
def _fault(move: Any, reward: float, i: int, region: Any, found: Any) -> int:
    """Return what is wrong with a body after a call; 0 for nothing. What is wrong is written to `found`."""
    found[0] = move.position[i, 0]
    found[1] = move.position[i, 1]
    if not is_in_region(region, found[0], found[1]):
        return BAD_POSITION
    x = move.heading[i, 0]
    y = move.heading[i, 1]
    if not abs(x * x + y * y - 1.0) < 1e-6:
        found[0] = x
        found[1] = y
        return BAD_HEADING
    if not 0.0 <= move.speed[i] < math.inf:
        found[0] = move.speed[i]
        return BAD_SPEED
    if not abs(reward) < math.inf:
        found[0] = reward
        return BAD_REWARD
    return 0


@kernel
def _accept(address: int, region: Any, found: Any, progress: Any) -> int:
    """Add what the bodies of a role got in a call; return `BAD_INTERACTION` if something is wrong with one of them."""
    role = role_at(address)
    partaker = partaker_at(role.partaker)
    move = move_at(group_at(partaker.group).move)
    for i in range(role.reward.shape[0]):
        what = _fault(move, role.reward[i], i, region, found)
        if what != 0:
            progress.what = what
            progress.body = i
            return BAD_INTERACTION
        partaker.reward[i] += role.reward[i]
        partaker.last_rewards[0, i] += role.reward[i]
        if role.ended[i]:
            partaker.ended[i] = True
            partaker.last_rewards[1, i] = 1.0
    return DONE


@kernel
def _set_moved(address: int) -> None:
    """Write the displacement of each body of a group in this step so far, by the rule of `motion`."""
    partaker = partaker_at(address)
    move = move_at(group_at(partaker.group).move)
    period_x = move.period[0]
    period_y = move.period[1]
    for i in range(move.position.shape[0]):
        step_x = move.position[i, 0] - partaker.before[i, 0]
        step_y = move.position[i, 1] - partaker.before[i, 1]
        if period_x > 0.0:
            step_x -= period_x * np.rint(step_x / period_x)
            step_y -= period_y * np.rint(step_y / period_y)
        move.moved[i, 0] = step_x
        move.moved[i, 1] = step_y


@kernel
def _interact(address: int, number: int, turn: int) -> int:
    """Call an interaction, and add up the rewards; return `BAD_INTERACTION` if it left something wrong."""
    world = world_at(address)
    progress = world.progress[0]
    here = interaction_at(world.interactions[number])
    _draw(world.interactions[number], progress.tick)
    here.words[here.turn] = turn
    for r in range(here.roles.shape[0]):
        role = role_at(here.roles[r])
        for i in range(role.reward.shape[0]):
            role.reward[i] = 0.0
            role.ended[i] = False
    progress.where = number
    if call(here.kernel, here.call) != COMPLETED:
        progress.what = RAISED
        return BAD_INTERACTION
    for s in range(here.scores.shape[0]):
        if not abs(here.scores[s]) < math.inf:
            here.found[0] = here.scores[s]
            progress.what = BAD_SCORE
            progress.need = s
            return BAD_INTERACTION
    for r in range(here.roles.shape[0]):
        if _accept(here.roles[r], here.region, here.found, progress) != DONE:
            progress.need = r
            return BAD_INTERACTION
        _set_moved(role_at(here.roles[r]).partaker)
    return DONE


@kernel
def _take_turn(address: int, g: int) -> int:
    """Call the interactions that follow the move of a group."""
    world = world_at(address)
    for p in range(world.partakers.shape[0]):
        if partaker_at(world.partakers[p]).number == g:
            _set_moved(world.partakers[p])
    for number in range(world.interactions.shape[0]):
        here = interaction_at(world.interactions[number])
        if not here.in_turn:
            continue
        for r in range(here.roles.shape[0]):
            if partaker_at(role_at(here.roles[r]).partaker).number == g and _interact(address, number, r) != DONE:
                return BAD_INTERACTION
    return DONE


@kernel
def _move_all(address: int) -> int:
    world = world_at(address)
    for g in range(world.groups.shape[0]):
        group = group_at(world.groups[g])
        if call(group.advance, group.move) != 0:
            world.progress[0].where = g
            return OUTSIDE
        if _take_turn(address, g) != DONE:
            return BAD_INTERACTION
    for number in range(world.interactions.shape[0]):
        if not interaction_at(world.interactions[number]).in_turn and _interact(address, number, -1) != DONE:
            return BAD_INTERACTION
    return DONE


def _move_and_interact(address: int) -> int:
    keep(address, False)
    _begin(address)
    status = _move_all(address)
    if status != DONE:
        keep(address, True)
    return status


MOVE_AND_INTERACT = Entry(_move_and_interact)
