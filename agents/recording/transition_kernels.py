"""The kernels that record transitions: one before bodies move, and one after the neighbour search.

They take the address of a log's record; see `LogArrays`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from teamsight.agents.engine.records import group_at, log_at, relation_at
from teamsight.core.kernel import call, kernel
from teamsight.world.motion import move_at, turn

#: What is recorded of the targets after a step, robot by robot.
FACTS = (
    "sensed", "gained", "lost", "alone", "alone_gained", "alone_lost", "team_sensed", "team_gained", "team_lost",
)  # fmt: skip
#: What is recorded besides where the robots take part in an interaction.
REWARD_FACTS = ("reward", "ended")

_OWN_FACTS, _ALL_FACTS = 6, 9
_HALF_TURN = np.float32(math.pi)


@kernel
def _situate(log: Any, situation: Any) -> None:
    """Write the situation vectors of the present moment."""
    call(log.situate, log.sensing)
    for i in range(log.now.shape[0]):
        for column in range(log.now.shape[1]):
            situation[i, column] = log.now[i, column]


@kernel
def count_sensing(team: Any, counts: Any) -> None:
    """Write how many robots of a team sense each body of the world."""
    for body in range(counts.shape[0]):
        counts[body] = 0
    for r in range(team.shape[0]):
        relation = relation_at(team[r])
        for k in range(relation.true_start[relation.true_start.shape[0] - 1]):
            counts[relation.rows[relation.true_index[k]]] += 1


@kernel
def _keep_neighbours(log: Any) -> None:
    """Keep the targets that the robots sense before they move."""
    if log.relation == 0:
        return
    relation = relation_at(log.relation)
    for i in range(relation.true_start.shape[0]):
        log.kept_start[i] = relation.true_start[i]
    for k in range(relation.true_start[relation.true_start.shape[0] - 1]):
        log.kept_identity[k] = relation.true_index[k]


@kernel
def _write_actions(log: Any, action: Any) -> None:
    """Write the actions that the bodies are about to carry out."""
    move = move_at(group_at(log.group).move)
    for i in range(action.shape[0]):
        x = move.heading[i, 0]
        y = move.heading[i, 1]
        rotation = np.float32(0.0)
        if move.aim[i, 0] != 0.0 or move.aim[i, 1] != 0.0:
            new_x, new_y = turn(x, y, move.aim[i, 0], move.aim[i, 1], move.turn_cosine[i], move.turn_sine[i])
            rotation = np.float32(math.atan2(new_y * x - new_x * y, new_x * x + new_y * y))
        action[i, 0] = _HALF_TURN if rotation <= -_HALF_TURN else rotation
        speed = move.speed[i]
        action[i, 1] = min(max(move.distance[i], 0.0), speed) / speed if speed > 0.0 else 0.0


@kernel
def record_before(address: int) -> None:
    """Write the situations before a move and the actions decided."""
    log = log_at(address)
    _situate(log, log.situation[log.row[0]])
    _write_actions(log, log.action[log.row[0]])
    _keep_neighbours(log)
    count_sensing(log.team, log.before)


@kernel
def _write_own_facts(address: int, facts: Any) -> None:
    """Compare the targets that each robot sensed before with those that it senses now, both in ascending order."""
    log = log_at(address)
    relation = relation_at(log.relation)
    start, index, rows = relation.true_start, relation.true_index, relation.rows
    old_start, old_index, before, after = log.kept_start, log.kept_identity, log.before, log.after
    for i in range(facts.shape[0]):
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
def _mark_inactive(active: Any, facts: Any) -> None:
    """Mark the rows of inactive robots, which are no transitions; see `TransitionLog.transitions`."""
    for i in range(active.shape[0]):
        if not active[i]:
            facts[i, 0] = math.nan


@kernel
def record_after(address: int) -> None:
    """Write the situations after a move and the facts about it."""
    log = log_at(address)
    _situate(log, log.next_situation[log.row[0]])
    count_sensing(log.team, log.after)
    sensed = 0
    gained = 0
    lost = 0
    for body in range(log.after.shape[0]):
        sensed += log.after[body] > 0
        gained += log.after[body] > 0 and log.before[body] == 0
        lost += log.after[body] == 0 and log.before[body] > 0
    facts = log.facts[log.row[0]]
    for i in range(facts.shape[0]):
        for fact in range(_OWN_FACTS):
            facts[i, fact] = 0.0
        facts[i, _OWN_FACTS] = sensed
        facts[i, _OWN_FACTS + 1] = gained
        facts[i, _OWN_FACTS + 2] = lost
    for i in range(log.last_rewards.shape[1]):
        for fact in range(2):
            facts[i, _ALL_FACTS + fact] = log.last_rewards[fact, i]
    if log.relation != 0:
        _write_own_facts(address, facts)
    _mark_inactive(move_at(group_at(log.group).move).active, facts)
    log.row[0] += 1
