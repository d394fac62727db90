"""One compiled call that steps many worlds and shows what follows: observations and facts.

Each world makes its step by the same entry as `World.run`, so results are equal to the last bit.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Sensing
from teamsight.agents.engine.loop import count_active, count_observers
from teamsight.agents.engine.records import (
    HISTORY_COLUMNS,
    GroupArrays,
    RelationArrays,
    WorldArrays,
    group_at,
    relation_at,
    world_at,
)
from teamsight.agents.recording.transitions import count_sensing
from teamsight.core.kernel import Entry, Packed, Record, call, kernel
from teamsight.env.actions import GRID, HEADING
from teamsight.world.motion import is_action, move_at

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: What was done with a world: its step is made; nothing, since it waits; nothing, since its step needs Python; the loop
#: stopped within the step; the step is made, but there was no room to show it.
DONE, WAITS, NEEDS_PYTHON, UNFINISHED, UNSEEN = range(5)


class SightArrays(NamedTuple):
    """The record of one world of an environment: where its actions go, and what is shown of it.

    Attributes
    ----------
    world : Packed of WorldArrays
        The record of the world.
    robots : Packed of GroupArrays
        The robots.
    targets, teammates : Packed of RelationArrays or None
        What they sense as targets, and their teammates in range.
    team : list of Packed of RelationArrays
        What all groups of their team sense as targets.
    roles : ndarray, shape (relations,), int64
        For each relation of the world: 1 if it counts in the observed fraction, 2 if it is one of teammates.
    everybody : int
        The number of targets that count.
    state : ndarray, shape (robots, 1, 3), float64
        The state of `Steered`, into which actions are written.
    perceive, percept : Entry or None, Packed of Sensing
        The kernel of the percept, and its record; see `Observation.perceive`.
    room : int
        The number of entries that `perceive` can write.
    show, seen : Entry, Packed of Sensing
        The kernel that writes the observations, and its record.
    of_robots : ndarray, shape (robots, facts), float64
        The facts of the robots; see `Facts`.
    of_world : ndarray, shape (facts,), float64
        The facts of the world.
    kept_start, kept_index : ndarray, shape (robots + 1,) and (kept,), int64
        The targets that each robot sensed after the last step, as in `RelationArrays.true_index`.
    before, after : ndarray, shape (bodies,), int64
        The number of robots of the team that sense each body, after the last step and now.
    is_new : ndarray, shape (1,), int64
        Whether nothing is known of the last step: at the start, and after bodies have come or left.
    last_rewards : ndarray, shape (robots, 2), float64
        As in `Group`.
    """

    world: Packed[WorldArrays]
    robots: Packed[GroupArrays]
    targets: Packed[RelationArrays] | None
    teammates: Packed[RelationArrays] | None
    team: list[Packed[RelationArrays]]
    roles: Annotated[Integers, "relations"]
    everybody: int
    state: Annotated[Floats, "robots", 1, 3]
    perceive: Entry | None
    percept: Packed[Sensing]
    room: int
    show: Entry
    seen: Packed[Sensing]
    of_robots: Annotated[Floats, "robots", "facts"]
    of_world: Annotated[Floats, "world facts"]
    kept_start: Annotated[Integers, "robots + 1"]
    kept_index: Annotated[Integers, "kept"]
    before: Annotated[Integers, "bodies"]
    after: Annotated[Integers, "bodies"]
    is_new: Annotated[Integers, 1]
    last_rewards: Annotated[Floats, "robots", 2]


class BatchArrays(NamedTuple):
    """The record of many worlds.

    Attributes
    ----------
    run : Entry
        The compiled loop of a world.
    sights : list of Packed of SightArrays
        The worlds.
    form : int
        The form of the actions; see `ActionForm`.
    table : ndarray, shape (actions, 2), float64
        The actions of the grid.
    given : ndarray, shape (worlds, robots, parts), float64
        The actions.
    steering : ndarray, shape (worlds, robots, 3), float64
        The same for `Steered`, written by the call.
    quiet_until : ndarray, shape (worlds,), int64
        The tick from which a step of each world needs Python: an event is due, or the history is full.
    status : ndarray, shape (worlds,), int64
        Before the call, `WAITS` for worlds that are left out; after it, what was done.
    """

    run: Entry
    sights: list[Packed[SightArrays]]
    form: int
    table: Annotated[Floats, "actions", 2]
    given: Annotated[Floats, "worlds", "robots", "parts"]
    steering: Annotated[Floats, "worlds", "robots", 3]
    quiet_until: Annotated[Integers, "worlds"]
    status: Annotated[Integers, "worlds"]


SIGHT = Record(SightArrays)
BATCH = Record(BatchArrays)

# For kernels: from the address of a record to its arrays.
sight_at: Any = SIGHT.at
batch_at: Any = BATCH.at

# The columns of `rewards.OF_ROBOTS` and `rewards.OF_WORLDS`.
_SENSED, _GAINED, _LOST, _ALONE, _ALONE_GAINED, _ALONE_LOST, _TEAM = range(7)
_SHARE, _NEIGHBOURS, _TRAVELLED, _ACTIVE, _REWARD, _ENDED = range(9, 15)
_COUNTS, _TEAMMATES = 1, 2
# Lengths of directions; squares of others would lose digits.
_SHORTEST, _LONGEST = 1e-100, 1e100


@kernel
def _write_targets(sight: Any) -> None:
    """Compare the targets that each robot sensed before with those that it senses now, both in ascending order."""
    relation = relation_at(sight.targets)
    start, index, rows = relation.true_start, relation.true_index, relation.rows
    old_start, old_index, before, after = sight.kept_start, sight.kept_index, sight.before, sight.after
    for i in range(sight.of_robots.shape[0]):
        facts = sight.of_robots[i]
        k = start[i]
        old = old_start[i]
        while k < start[i + 1] or old < old_start[i + 1]:
            is_now = k < start[i + 1] and (old >= old_start[i + 1] or index[k] <= old_index[old])
            was_then = old < old_start[i + 1] and (k >= start[i + 1] or old_index[old] <= index[k])
            body = rows[index[k]] if is_now else rows[old_index[old]]
            is_alone = is_now and after[body] == 1
            was_alone = was_then and before[body] == 1
            facts[_SENSED] += is_now
            facts[_GAINED] += is_now and not was_then
            facts[_LOST] += was_then and not is_now
            facts[_ALONE] += is_alone
            facts[_ALONE_GAINED] += is_alone and not was_alone
            facts[_ALONE_LOST] += was_alone and not is_alone
            if is_now:
                facts[_SHARE] += 1.0 / after[body]
            k += is_now
            old += was_then


@kernel
def _keep_targets(sight: Any) -> None:
    """Keep what is sensed now, for the comparison after the next step."""
    for body in range(sight.after.shape[0]):
        sight.before[body] = sight.after[body]
    if sight.targets != 0:
        relation = relation_at(sight.targets)
        for i in range(relation.true_start.shape[0]):
            sight.kept_start[i] = relation.true_start[i]
        for k in range(relation.true_start[relation.true_start.shape[0] - 1]):
            sight.kept_index[k] = relation.true_index[k]


@kernel
def _write_bodies(sight: Any) -> None:
    """Write the neighbours of each robot, how far it went, and whether it is active."""
    move = move_at(group_at(sight.robots).move)
    for i in range(sight.of_robots.shape[0]):
        facts = sight.of_robots[i]
        facts[_NEIGHBOURS] = 0.0
        if sight.teammates != 0:
            start = relation_at(sight.teammates).neighbours.start
            facts[_NEIGHBOURS] = start[i + 1] - start[i]
        x = move.moved[i, 0]
        y = move.moved[i, 1]
        facts[_TRAVELLED] = min(math.sqrt(x * x + y * y) / move.speed[i], 1.0) if move.speed[i] > 0.0 else 0.0
        facts[_ACTIVE] = 1.0
        facts[_REWARD] = sight.last_rewards[i, 0]
        facts[_ENDED] = sight.last_rewards[i, 1]
        if move.active.shape[0] > 0 and not move.active[i]:
            facts[_ACTIVE] = 0.0


@kernel
def _write_world(sight: Any) -> None:
    """Write the facts of the world, from the last row of its history."""
    world = world_at(sight.world)
    row = world.progress[0].row
    facts = sight.of_world
    for fact in range(facts.shape[0]):
        facts[fact] = 0.0
    facts[1] = sight.everybody
    if world.present.shape[1] > HISTORY_COLUMNS:
        facts[1] = 0.0
    for r in range(sight.roles.shape[0]):
        numbers = world.history[row - 1, r] if row > 0 else world.present[r]
        if sight.roles[r] == _COUNTS:
            facts[0] += numbers[2]
            if world.present.shape[1] > HISTORY_COLUMNS:
                relation = relation_at(world.relations[r])
                for g in range(relation.counted.shape[0]):
                    facts[1] += count_active(relation.counted[g])
        elif sight.roles[r] == _TEAMMATES:
            facts[2] += numbers[0]
            facts[3] = max(facts[3], numbers[1])
            facts[4] += count_observers(world.relations[r])


@kernel
def _write_facts(sight: Any) -> None:
    count_sensing(sight.team, sight.after)
    if sight.is_new[0] != 0:
        _keep_targets(sight)
        sight.is_new[0] = 0
    sensed = 0
    gained = 0
    lost = 0
    for body in range(sight.after.shape[0]):
        sensed += sight.after[body] > 0
        gained += sight.after[body] > 0 and sight.before[body] == 0
        lost += sight.after[body] == 0 and sight.before[body] > 0
    for i in range(sight.of_robots.shape[0]):
        facts = sight.of_robots[i]
        for fact in range(_TEAM):
            facts[fact] = 0.0
        facts[_TEAM] = sensed
        facts[_TEAM + 1] = gained
        facts[_TEAM + 2] = lost
        facts[_SHARE] = 0.0
    if sight.targets != 0:
        _write_targets(sight)
    _write_bodies(sight)
    _write_world(sight)
    _keep_targets(sight)


@kernel
def _show(address: int) -> int:
    """Write the observations and the facts of a world; return `UNSEEN` if a buffer of the percept is too small."""
    sight = sight_at(address)
    if sight.perceive != 0 and call(sight.perceive, sight.percept) > sight.room:
        return UNSEEN
    call(sight.show, sight.seen)
    _write_facts(sight)
    return DONE


@kernel
def _steer_one(batch: Any, given: Any, steering: Any) -> bool:
    """Write an action for `Steered`; return whether it can be carried out. NaN cannot."""
    if batch.form == HEADING:
        for part in range(3):
            steering[part] = given[part]
        if not is_action(given[0], given[1], given[2]):
            # Any direction is good, but a unit vector is carried out to the last bit.
            length = math.sqrt(given[0] * given[0] + given[1] * given[1])
            steering[0] = given[0] / length if length > _SHORTEST else 0.0
            steering[1] = given[1] / length if length > _SHORTEST else 0.0
        # A distance that is infinite would be limited by the speed, but is a mistake.
        return bool(abs(given[0]) < _LONGEST and abs(given[1]) < _LONGEST and abs(given[2]) < math.inf)
    if batch.form == GRID:
        if not 0.0 <= given[0] < batch.table.shape[0]:
            return False
        steering[0] = batch.table[int(given[0]), 0]
        steering[1] = batch.table[int(given[0]), 1]
        return True
    steering[0] = given[0] * math.pi
    # Halved first: a half is exact, whatever the number.
    steering[1] = 0.5 * given[1] + 0.5
    return bool(abs(given[0]) <= 1.0 and abs(given[1]) <= 1.0)


@kernel
def _find_bad_action(batch: Any) -> int:
    """Write all actions; return 1 + the index of the first that cannot be carried out, or 0."""
    robots = batch.steering.shape[1]
    for w in range(batch.status.shape[0]):
        if batch.status[w] != WAITS:
            for i in range(robots):
                if not _steer_one(batch, batch.given[w, i], batch.steering[w, i]):
                    return int(w * robots + i + 1)
    return 0


@kernel
def _step_one(batch: Any, w: int) -> int:
    sight = sight_at(batch.sights[w])
    progress = world_at(sight.world).progress[0]
    if progress.tick >= batch.quiet_until[w]:
        return NEEDS_PYTHON
    for i in range(sight.state.shape[0]):
        for part in range(3):
            sight.state[i, 0, part] = batch.steering[w, i, part]
    progress.steps = 1
    if call(batch.run, sight.world) != 0:
        return UNFINISHED
    return int(_show(batch.sights[w]))


def _step_all(address: int) -> int:
    """Make a step of all worlds; return 1 + the index of a bad action, or 0, or −1 if Python has to go on."""
    batch = batch_at(address)
    bad = _find_bad_action(batch)
    if bad > 0:
        return bad
    result = 0
    for w in range(batch.status.shape[0]):
        if batch.status[w] != WAITS:
            batch.status[w] = _step_one(batch, w)
            if batch.status[w] != DONE:
                result = -1
    return result


def _show_one(address: int) -> int:
    return int(_show(address))


STEP_ALL = Entry(_step_all)
SHOW = Entry(_show_one)
