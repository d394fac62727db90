"""Transitions: what the robots of a group perceived, did and perceived afterwards, for learners.

The compiled loop writes them, see `teamsight.agents.recording.transition_kernels`; so both paths record the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.group import Group
from teamsight.agents.recording.transition_kernels import FACTS
from teamsight.core.buffer import Buffer

Reals = npt.NDArray[np.float32]


class Transitions(NamedTuple):
    """Transitions of a group, k of them in the order of time, robots in the order of their rows.

    Attributes
    ----------
    situation, next_situation : ndarray, shape (k, width), float32
        The situation of the robot before and after, as its degree of awareness gives it to learners.
    action : ndarray, shape (k, 2), float32
        What its body did: the rotation from the heading before, anticlockwise, in (−π, π] [rad], within its turning
        limit; and the distance over its speed, 0..1. At a wall both are those before the wall changed them.
    facts : mapping of str to ndarray, shape (k,), float32
        Numbers of targets: ``sensed`` by the robot afterwards, ``gained`` and ``lost`` by it in the step; the same of
        those that it senses and no teammate does (``alone``…), and of those that any robot of its team senses
        (``team_sensed``…). Rewards are made of them.
    """

    situation: Reals
    action: Reals
    next_situation: Reals
    facts: Mapping[str, Reals]


class TransitionLog:
    """The transitions of a group while the groups of its world stay as they are.

    Parameters
    ----------
    group : Group
        The group.
    team_size : int
        How many robots its team has.

    Attributes
    ----------
    own, added : int
        The inputs of a robot's own sensors, and those added for teammates.
    situation, action, next_situation, facts : Buffer
        One row for each step.
    row : ndarray, shape (1,), int64
        How many steps are recorded; compiled code adds them.
    now, kept_start, kept_identity, before, after : ndarray
        Work space; see `LogArrays`.
    """

    def __init__(self, group: Group, team_size: int) -> None:
        self.group = group
        size, width = len(group), group.awareness.width(max(team_size, 1))
        self.own, self.added = width
        self.situation, self.action, self.next_situation, self.facts = self._buffers = [
            Buffer((size, columns), np.float32) for columns in (sum(width), 2, sum(width), len(FACTS))
        ]
        self.row = np.zeros(1, np.int64)
        self.now = np.zeros((size, sum(width)), np.float32)
        self.kept_start, self.kept_identity = np.zeros(size + 1, np.int64), np.zeros(0, np.int64)
        self.before = self.after = np.zeros(0, np.int64)

    @property
    def rows(self) -> int:
        """How many steps are recorded."""
        return int(self.row[0])

    def make_room(self, steps: int) -> bool:
        """Make room for this many more steps; return whether arrays are others now."""
        for buffer in self._buffers:
            buffer.rows = self.rows
        moved = [buffer.make_room(steps) for buffer in self._buffers]
        return any(moved)

    def make_room_to_compare(self, neighbours: int, bodies: int) -> None:
        """Make the work space large enough; what was kept before a move stays."""
        if neighbours > len(self.kept_identity):
            self.kept_identity = np.append(self.kept_identity, np.zeros(neighbours - len(self.kept_identity), np.int64))
        if bodies != len(self.before):
            self.before, self.after = np.zeros((2, bodies), np.int64)

    def transitions(self) -> Transitions:
        """Return the transitions of the steps so far."""
        situation, action, after, facts = (
            buffer.array[: self.rows].reshape(-1, buffer.array.shape[-1]) for buffer in self._buffers
        )
        return Transitions(situation, action, after, {name: facts[:, column] for column, name in enumerate(FACTS)})


def joined(group: Group, logs: list[TransitionLog]) -> Transitions:
    """Return the transitions of a group from all its logs.

    Raises
    ------
    ValueError
        If there is none, or its situations differ in width.
    """
    if not logs:
        raise ValueError(f"transitions({group!r}): none were recorded; call record_transitions(group) before the steps")
    widths = sorted({log.own + log.added for log in logs if log.rows})
    if len(widths) > 1:
        raise ValueError(
            f"transitions({group!r}): their situations have {' and '.join(map(str, widths))} components, for the team "
            "has grown or shrunk; use RingAwareness(), whose width is that of no team"
        )
    parts = [log.transitions() for log in logs if log.rows] or [logs[-1].transitions()]
    return concatenated(parts)


def concatenated(parts: Sequence[Transitions]) -> Transitions:
    """Return transitions of one width, one after another."""
    return Transitions(
        np.concatenate([part.situation for part in parts]),
        np.concatenate([part.action for part in parts]),
        np.concatenate([part.next_situation for part in parts]),
        {name: np.concatenate([part.facts[name] for part in parts]) for name in FACTS},
    )
