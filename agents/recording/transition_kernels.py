"""Noting: the kernels that write experience, one before bodies move and one after their sightings are found anew."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.agents.awareness.binding import SCENE
from teamsight.agents.engine.records import EXPERIENCE, GROUP, RELATION
from teamsight.core.kernel import array_at, call, kernel
from teamsight.world.motion import MOVE, turn

#: What is told of the targets after a step, robot by robot.
FACTS = (
    "sensed", "gained", "lost", "alone", "alone_gained", "alone_lost", "team_sensed", "team_gained", "team_lost",
)  # fmt: skip

_FACTS = len(FACTS)
_SCENE_WORDS = SCENE.itemsize // 8
_HALF_TURN = np.float32(math.pi)


@kernel
def _situate(log: Any, group: Any, out: int) -> None:
    """Write the group's situation vectors at an address."""
    # A copy, made anew, because the loop moves arrays to where there is more room.
    theirs = array_at(group.scene, _SCENE_WORDS, np.int64)
    mine = array_at(log.scene, _SCENE_WORDS, np.int64)
    for word in range(_SCENE_WORDS):
        mine[word] = theirs[word]
    scene = array_at(log.scene, 1, SCENE)[0]
    scene.situation = out + log.row * group.size * log.width * 4
    scene.width = log.width
    call(log.situate, log.scene)


@kernel
def _count_observers(world: Any, log: Any, counts: Any) -> None:
    """Write how many robots of the team sense each body of the world."""
    relations = array_at(world.relations, world.relation_count, RELATION)
    team = array_at(log.team, log.team_size, np.int64)
    for body in range(world.bodies):
        counts[body] = 0
    for r in range(log.team_size):
        relation = relations[team[r]]
        start = array_at(relation.start, relation.observers + 1, np.int64)
        index = array_at(relation.index, relation.room, np.int64)
        rows = array_at(relation.rows, relation.observed, np.int64)
        for k in range(start[relation.observers]):
            counts[rows[index[k]]] += 1


@kernel
def _keep_sightings(world: Any, log: Any) -> None:
    """Keep whom the robots sense before they move."""
    if log.relation < 0:
        return
    relation = array_at(world.relations, world.relation_count, RELATION)[log.relation]
    n = relation.observers
    start = array_at(relation.start, n + 1, np.int64)
    index = array_at(relation.index, relation.room, np.int64)
    kept_start = array_at(log.kept_start, n + 1, np.int64)
    kept_index = array_at(log.kept_index, log.kept_room, np.int64)
    for i in range(n + 1):
        kept_start[i] = start[i]
    for k in range(start[n]):
        kept_index[k] = index[k]


@kernel
def _write_actions(log: Any, group: Any) -> None:
    """Write what the bodies are about to do."""
    move = array_at(group.move, 1, MOVE)[0]
    n = move.size
    heading = array_at(move.heading, (n, 2), np.float64)
    speed = array_at(move.speed, n, np.float64)
    cosine = array_at(move.turn_cosine, n, np.float64)
    sine = array_at(move.turn_sine, n, np.float64)
    aim = array_at(move.action_heading, (n, 2), np.float64)
    distance = array_at(move.action_distance, n, np.float64)
    action = array_at(log.action + log.row * n * 8, (n, 2), np.float32)
    for i in range(n):
        x = heading[i, 0]
        y = heading[i, 1]
        rotation = np.float32(0.0)
        if aim[i, 0] != 0.0 or aim[i, 1] != 0.0:
            new_x, new_y = turn(x, y, aim[i, 0], aim[i, 1], cosine[i], sine[i])
            rotation = np.float32(math.atan2(new_y * x - new_x * y, new_x * x + new_y * y))
        action[i, 0] = _HALF_TURN if rotation <= -_HALF_TURN else rotation
        action[i, 1] = min(max(distance[i], 0.0), speed[i]) / speed[i] if speed[i] > 0.0 else 0.0


@kernel
def note_before(world: Any) -> None:
    """Write what is known before a move and what was decided; the records of groups and relations lie at `world`."""
    groups = array_at(world.groups, world.group_count, GROUP)
    logs = array_at(world.logs, world.log_count, EXPERIENCE)
    for number in range(world.log_count):
        log = logs[number]
        group = groups[log.group]
        _situate(log, group, log.situation)
        _write_actions(log, group)
        _keep_sightings(world, log)
        _count_observers(world, log, array_at(log.counts_before, world.bodies, np.int64))


@kernel
def _write_own_facts(world: Any, log: Any, facts: Any, before: Any, after: Any) -> None:
    """Compare whom each robot sensed before with whom it senses now; both are in ascending order."""
    relation = array_at(world.relations, world.relation_count, RELATION)[log.relation]
    n = relation.observers
    start = array_at(relation.start, n + 1, np.int64)
    index = array_at(relation.index, relation.room, np.int64)
    rows = array_at(relation.rows, relation.observed, np.int64)
    old_start = array_at(log.kept_start, n + 1, np.int64)
    old_index = array_at(log.kept_index, log.kept_room, np.int64)
    for i in range(n):
        own = facts[i]
        k = start[i]
        old = old_start[i]
        while k < start[i + 1] or old < old_start[i + 1]:
            is_now = k < start[i + 1] and (old >= old_start[i + 1] or index[k] <= old_index[old])
            was_then = old < old_start[i + 1] and (k >= start[i + 1] or old_index[old] <= index[k])
            body = rows[index[k]] if is_now else rows[old_index[old]]
            is_alone = is_now and after[body] == 1
            was_alone = was_then and before[body] == 1
            own[0] += np.float32(is_now)
            own[1] += np.float32(is_now and not was_then)
            own[2] += np.float32(was_then and not is_now)
            own[3] += np.float32(is_alone)
            own[4] += np.float32(is_alone and not was_alone)
            own[5] += np.float32(was_alone and not is_alone)
            k += is_now
            old += was_then


@kernel
def note_after(world: Any) -> None:
    """Write what is known after a move and the facts on what it led to."""
    groups = array_at(world.groups, world.group_count, GROUP)
    logs = array_at(world.logs, world.log_count, EXPERIENCE)
    for number in range(world.log_count):
        log = logs[number]
        group = groups[log.group]
        _situate(log, group, log.next_situation)
        facts = array_at(log.facts + log.row * group.size * _FACTS * 4, (group.size, _FACTS), np.float32)
        before = array_at(log.counts_before, world.bodies, np.int64)
        after = array_at(log.counts_after, world.bodies, np.int64)
        _count_observers(world, log, after)
        sensed = 0
        gained = 0
        lost = 0
        for body in range(world.bodies):
            sensed += after[body] > 0
            gained += after[body] > 0 and before[body] == 0
            lost += after[body] == 0 and before[body] > 0
        for i in range(group.size):
            for fact in range(6):
                facts[i, fact] = 0.0
            facts[i, 6] = sensed
            facts[i, 7] = gained
            facts[i, 8] = lost
        if log.relation >= 0:
            _write_own_facts(world, log, facts, before, after)
        log.row += 1
