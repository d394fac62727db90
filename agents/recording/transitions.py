"""Transitions: situation, action and what followed, recorded for learners."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.records import group_at, log_at, relation_at
from teamsight.agents.group import Group, team_of
from teamsight.core.elementary import atan2
from teamsight.core.kernel import Entry, call, kernel
from teamsight.core.table import Field, Table
from teamsight.world.motion import move_at, turn

#: What is recorded of the targets after a step, robot by robot.
FACTS = (
    "sensed", "gained", "lost", "alone", "alone_gained", "alone_lost", "team_sensed", "team_gained", "team_lost",
)  # fmt: skip
#: What is recorded besides where the robots take part in an interaction.
REWARD_FACTS = ("reward", "ended")

_OWN_FACTS, _ALL_FACTS = 6, 9
_FIRST_ROWS = 16
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
            rotation = np.float32(atan2(new_y * x - new_x * y, new_x * x + new_y * y))
        action[i, 0] = _HALF_TURN if rotation <= -_HALF_TURN else rotation
        speed = move.speed[i]
        action[i, 1] = min(max(move.distance[i], 0.0), speed) / speed if speed > 0.0 else 0.0


def _record_before(address: int) -> int:
    """Write the situations before a move and the actions decided."""
    log = log_at(address)
    _situate(log, log.situation[log.row[0]])
    _write_actions(log, log.action[log.row[0]])
    _keep_neighbours(log)
    count_sensing(log.team, log.before)
    return 0


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


def _record_after(address: int) -> int:
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
    for i in range(log.last_rewards.shape[0]):
        for fact in range(2):
            facts[i, _ALL_FACTS + fact] = log.last_rewards[i, fact]
    if log.relation != 0:
        _write_own_facts(address, facts)
    _mark_inactive(move_at(group_at(log.group).move).active, facts)
    log.row[0] += 1
    return 0


RECORD_BEFORE, RECORD_AFTER = Entry(_record_before), Entry(_record_after)


Reals = npt.NDArray[np.float32]


class Transitions(NamedTuple):
    """Transitions of a group, k of them in the order of time, robots in the order of their rows.

    Attributes
    ----------
    situation, next_situation : ndarray, shape (k, width), float32
        The situation of the robot before and after, as its degree of awareness gives it to learners.
    action : ndarray, shape (k, 2), float32
        The rotation, anticlockwise, in (−π, π] [rad], limited by the turning limit; and the distance divided by the
        speed, in [0, 1]. Both are those before a wall changed the motion.
    facts : mapping of str to ndarray, shape (k,), float32
        Numbers of targets, from which rewards are computed: ``sensed`` by the robot after the step, ``gained`` and
        ``lost`` in it; ``alone``…, the same for targets that no teammate senses; ``team_sensed``…, the same for targets
        that any robot of the team senses. Of robots that take part in an interaction also ``reward``, what it gave each
        in the step, and ``ended``, 1 if it ended a trial, else 0.
    """

    situation: Reals
    action: Reals
    next_situation: Reals
    facts: Mapping[str, Reals]


class TransitionLog:
    """The transitions of a group while the groups of its world stay as they are.

    Attributes
    ----------
    awareness : Awareness
        The degree of awareness under which they were recorded.
    has_rewards : bool
        Whether the facts include rewards, because the group takes part in an interaction.
    own, added : int
        The inputs of a robot's own sensors, and those added for teammates.
    steps : Table
        A row for each step: `situation`, `action`, `next_situation` and `facts` of all robots.
    row : ndarray, shape (1,), int64
        The number of recorded steps; compiled code increases it.
    now, kept_start, kept_identity, before, after : ndarray
        Work space; see `LogArrays`.
    """

    def __init__(self, group: Group, team_size: int, *, has_rewards: bool = False) -> None:
        self.group, self.awareness, self.has_rewards = group, group.awareness, has_rewards
        size, width = len(group), group.awareness.width(max(team_size, 1))
        self.own, self.added = width
        widths = {"situation": sum(width), "action": 2, "next_situation": sum(width), "facts": len(self.names)}
        self.steps = Table(
            (Field(name, np.float32, (size, columns)) for name, columns in widths.items()), room=_FIRST_ROWS
        )
        self.row = np.zeros(1, np.int64)
        self.now = np.zeros((size, sum(width)), np.float32)
        self.kept_start, self.kept_identity = np.zeros(size + 1, np.int64), np.zeros(0, np.int64)
        self.before = self.after = np.zeros(0, np.int64)

    @property
    def names(self) -> tuple[str, ...]:
        """The facts."""
        return FACTS + REWARD_FACTS * self.has_rewards

    @property
    def rows(self) -> int:
        """The number of recorded steps."""
        return int(self.row[0])

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether arrays were replaced."""
        self.steps.count(self.rows)
        return self.steps.make_room(steps, most_spare=None)

    def make_room_to_compare(self, neighbours: int, bodies: int) -> None:
        """Enlarge the work space, with its content."""
        if neighbours > len(self.kept_identity):
            self.kept_identity = np.append(self.kept_identity, np.zeros(neighbours - len(self.kept_identity), np.int64))
        if bodies != len(self.before):
            self.before, self.after = np.zeros((2, bodies), np.int64)

    def transitions(self) -> Transitions:
        """Return the transitions of the steps so far; none of robots while they were inactive."""
        self.steps.count(self.rows)
        situation, action, after, facts = (
            self.steps[name].reshape(-1, self.steps[name].shape[-1]) for name in self.steps.fields
        )
        # Compiled code marks the rows of inactive robots.
        is_there = ~np.isnan(facts[:, 0])
        if not is_there.all():
            situation, action, after, facts = (array[is_there] for array in (situation, action, after, facts))
        return Transitions(situation, action, after, {name: facts[:, column] for column, name in enumerate(self.names)})


class TransitionLogs:
    """The transitions of some groups of a world: a log for each stretch in which the groups stay as they are.

    Attributes
    ----------
    groups : list of Group
        The recorded groups.
    logs : list of TransitionLog
        All logs with transitions, and those in use.
    in_use : list of TransitionLog
        The logs to which the compiled loop writes.
    """

    def __init__(self) -> None:
        self.groups: list[Group] = []
        self.forget()

    def forget(self) -> None:
        """Drop all that was recorded."""
        self.logs: list[TransitionLog] = []
        self.in_use: list[TransitionLog] = []

    def begin(self, groups: list[Group], partakers: list[Group]) -> None:
        """Begin new logs, because groups or teams may have changed; `partakers` are in interactions."""
        self.in_use = [
            TransitionLog(group, sum(map(len, team_of(groups, group))), has_rewards=group in partakers)
            for group in self.groups
        ]
        self.logs = [log for log in self.logs if log.rows] + self.in_use

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether arrays were replaced and must be bound."""
        moved = [log.make_room(steps) for log in self.in_use]
        return any(moved)


def joined(group: Group, logs: list[TransitionLog]) -> Transitions:
    """Return the transitions of a group from all its logs.

    Raises
    ------
    ValueError
        If there is none, or its situations differ in width.
    """
    if not logs:
        raise ValueError(f"transitions({group!r}): none were recorded; call record_transitions(group) before the steps")
    degrees = list(dict.fromkeys(repr(log.awareness) for log in logs if log.rows))
    if len(degrees) > 1:
        raise ValueError(
            f"transitions({group!r}): were recorded under {' and '.join(degrees)}, whose situations mean different "
            "things; change the degree of awareness before recording, or in another world"
        )
    widths = sorted({log.own + log.added for log in logs if log.rows})
    if len(widths) > 1:
        raise ValueError(
            f"transitions({group!r}): the situations have {' and '.join(map(str, widths))} inputs, because the team "
            "size has changed; use RingAwareness(), whose width does not depend on the team size"
        )
    parts = [log.transitions() for log in logs if log.rows] or [logs[-1].transitions()]
    return concatenated(parts)


def concatenated(parts: Sequence[Transitions]) -> Transitions:
    """Return transitions of one width, one after another; those without a fact have 0."""
    names = dict.fromkeys(name for part in parts for name in part.facts)
    return Transitions(
        np.concatenate([part.situation for part in parts]),
        np.concatenate([part.action for part in parts]),
        np.concatenate([part.next_situation for part in parts]),
        {
            name: np.concatenate([part.facts.get(name, np.zeros(len(part.action), np.float32)) for part in parts])
            for name in names
        },
    )
