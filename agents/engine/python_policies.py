"""Decisions in Python: NumPy policies, callables for one robot, and agents that override `decide`.

No policy state changes before the step is complete: after an error, the world is as the last completed step left it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.columns import readonly
from teamsight.agents.group import Group
from teamsight.agents.policy_state import put_rows, take_rows
from teamsight.policies.actions import check_action, check_answer
from teamsight.policies.interface import Action, Percept, Policy, turned
from teamsight.policies.percept_of_one import PerceptOfOne, percept_of_group_of_one, percept_of_one, percept_of_rows
from teamsight.world.noise import Stream, generator, stream_number, uniforms

Key = npt.NDArray[np.uint64]
Integers = npt.NDArray[np.int64]
Rule = Callable[[PerceptOfOne, np.random.Generator], tuple[float, float]]


class Deliberation:
    """A decision of a group while it is being made.

    Parameters
    ----------
    group : Group
        The group that decides.
    tick : int
        The present tick.
    key : ndarray, shape (2,), uint64
        The key of the world's noise.
    noise : ndarray, shape (draws, n), float64, optional
        The group's random numbers for this tick, if they have been drawn.
    rows : ndarray, shape (k,), int64, optional
        The robots that decide, by ascending rows; by default all.

    Attributes
    ----------
    rows : ndarray, shape (k,), int64
        The robots that decide.
    """

    def __init__(
        self,
        group: Group,
        tick: int,
        key: Key,
        noise: npt.NDArray[np.float64] | None = None,
        rows: Integers | None = None,
    ) -> None:
        self.group, self.tick, self.key = group, tick, key
        self.rows = np.arange(len(group)) if rows is None else rows
        self._noise = noise
        self._percept: Percept | None = None
        self._given: dict[int, PerceptOfOne] = {}
        # The decisions of all deciding robots of a policy, by its index: each robot's place in them, and the decision.
        self._whole: dict[int, tuple[dict[int, int], Action, Any]] = {}
        # The rows that used a policy, each with its new state; None for that of such a decision.
        self._decided: dict[int, Any] = {}

    @property
    def percept(self) -> Percept:
        """What the whole group perceives, as arrays that cannot be written to."""
        if self._percept is None:
            self._percept = _protected(self.group.perceived)
        return self._percept

    @property
    def noise(self) -> npt.NDArray[np.float64]:
        """The policy's random numbers, shape (draws, n)."""
        if self._noise is None:
            group = self.group
            stream = stream_number(Stream.POLICY, group.number)
            self._noise = uniforms(self.key, stream, self.tick, group.bodies.member, group.draws)
        return self._noise

    def decide(self) -> Action:
        """Return the action of the robots that decide."""
        group = self.group
        if group.decides_alone:
            name = f"{type(group._agents[0]).__name__}.decide" if group._agents else ""
            return self._of_each(self.rows, [group._agents[row].decide for row in self.rows], name)
        action = Action(np.zeros((len(self.rows), 2)), np.zeros(len(self.rows)))
        for index, policy in enumerate(group.policies):
            places = np.flatnonzero(self._choices == index)
            rows = self.rows[places]
            if not len(rows):
                continue
            if isinstance(policy, Policy):
                self._decided |= dict.fromkeys(rows.tolist())
                _, made, _ = self._decision_of_all(index)
            else:
                made = self._of_each(rows, [policy] * len(rows), _name(policy))
            action.heading[places], action.distance[places] = made
        return action

    def states(self) -> list[Any]:
        """Return the states of all policies after this decision."""
        group, size = self.group, len(self.group)
        states = group.states
        whole = [row for row, part in self._decided.items() if part is None]
        for index, (places, _, after) in self._whole.items():
            rows = np.array([row for row in whole if row in places], np.int64)
            if len(rows) == size:
                states[index] = after
            elif len(rows):
                kept = np.array([places[int(row)] for row in rows])
                states[index] = put_rows(states[index], rows, take_rows(after, kept, len(places)), size)
        for row, part in self._decided.items():
            if part is not None:
                index = self._choice(row)
                states[index] = put_rows(states[index], np.array([row]), part[0], size)
        return states

    def policy_decides(self, row: int, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn, distance) that a robot's policy decides on this percept.

        Policies that are callables for one robot are given `rng`.
        """
        group, index = self.group, self._choice(row)
        policy = group.policies[index]
        if not isinstance(policy, Policy):
            return check_answer(_name(policy), policy(percept, rng), row)
        if percept is self._given.get(row):
            # The usual case, an unchanged percept: one decision serves all that decide by this policy.
            places, action, _ = self._decision_of_all(index)
            self._decided[row] = None
            return _turn(percept.heading, action.heading[places[row]]), float(action.distance[places[row]])
        self._check_situation(row, percept)
        own, rows = percept_of_group_of_one(percept), np.array([row])
        before = take_rows(group.states[index], rows, len(group))
        action, after = _ask(policy, own, before, np.ascontiguousarray(self.noise[: policy.draws, rows]))
        self._decided[row] = (after,)
        return _turn(percept.heading, action.heading[0]), float(action.distance[0])

    @property
    def _choices(self) -> Integers:
        """The policy of each robot that decides, by its index."""
        table = self.group.timetable
        return np.zeros(len(self.rows), np.int64) if table is None else table.policy[self.rows]

    def _choice(self, row: int) -> int:
        table = self.group.timetable
        return 0 if table is None else int(table.policy[row])

    def _check_situation(self, row: int, percept: PerceptOfOne) -> None:
        """Refuse changed neighbour lists if the policy reads the situation, which was computed from the old ones."""
        given = self._given.get(row)
        if given is None or not self.group.inputs:
            return
        names = ("targets", "teammates", "relayed")
        changed = [name for name in names if getattr(percept, name) is not getattr(given, name)]
        if changed and percept.situation is given.situation:
            raise ValueError(
                f"percept.{changed[0]}: was changed, but {_name(self.group.policy)} reads percept.situation, which was "
                f"not; change both, as in percept._replace({changed[0]}=…, situation=…)"
            )

    def _decision_of_all(self, index: int) -> tuple[dict[int, int], Action, Any]:
        """Return the decision of all deciding robots of a policy; see `_whole`."""
        if index not in self._whole:
            group, size = self.group, len(self.group)
            rows = self.rows[self._choices == index]
            percept, state, policy = self.percept, group.states[index], group.policies[index]
            noise = self.noise[: policy.draws]
            if len(rows) < size:
                percept, state = _protected(percept_of_rows(percept, rows)), take_rows(state, rows, size)
                noise = np.ascontiguousarray(noise[:, rows])
            action, after = _ask(policy, percept, state, noise)
            self._whole[index] = {row: place for place, row in enumerate(rows.tolist())}, action, after
        return self._whole[index]

    def _of_each(self, rows: Integers, rules: list[Rule], name: str) -> Action:
        group, percept = self.group, self.percept
        stream = stream_number(Stream.CALLABLE, group.number)
        self._given |= {int(row): percept_of_one(percept, row) for row in rows}
        answers = np.zeros((len(rows), 2))
        for place, (row, rule) in enumerate(zip(rows.tolist(), rules, strict=True)):
            rng = generator(self.key, stream, self.tick, int(group.bodies.member[row]))
            answers[place] = check_answer(name, rule(self._given[row], rng), row)
        return Action(turned(percept.heading[rows], answers[:, 0]), answers[:, 1])


class Carried:
    """Actions that the next step carries out, and the states that follow; a step that fails undoes both."""

    def __init__(self, deliberation: Deliberation) -> None:
        self._group, self._states = deliberation.group, deliberation.states()
        table = deliberation.group.timetable
        self._kept = table.kept() if table is not None else None

    def end(self, *, is_made: bool) -> None:
        """Set the new states if the step was made, else put the timetable back."""
        table = self._group.timetable
        if is_made:
            for index, state in enumerate(self._states):
                self._group.set_state(index, state)
        elif table is not None and self._kept is not None:
            table.put_back(self._kept)


def carry(deliberation: Deliberation, action: Action) -> Carried:
    """Write the actions of a group for the next step."""
    group, carried = deliberation.group, Carried(deliberation)
    heading, distance = group.action
    if group.due is not None and group.timetable is not None:
        heading, distance = group.due.chosen_heading, group.due.chosen_distance
    heading[deliberation.rows], distance[deliberation.rows] = action
    return carried


def due_rows(group: Group) -> Integers | None:
    """Return the rows of the robots that decide in this step; None for all."""
    if group.timetable is None or group.due is None:
        return None
    runs = group.due.runs[: group.due.number[0]]
    return np.concatenate([np.arange(0), *(np.arange(first, last) for first, last, _ in runs.tolist())])


def _ask(policy: Any, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
    name = _name(policy)
    try:
        answer = policy.decide(percept, state, noise)
    except ValueError as error:
        if "read-only" not in str(error):
            raise
        raise ValueError(f"{name}.decide writes into its percept ({error}); copy the array first") from error
    if not isinstance(answer, tuple) or isinstance(answer, Action) or len(answer) != 2:
        raise TypeError(f"{name}.decide returned {type(answer).__name__}; it must return (action, state)")
    action, after = answer
    check_action(name, action, len(percept.heading))
    return Action(*action), after


def _name(policy: Any) -> str:
    return str(getattr(policy, "__name__", type(policy).__name__))


def _turn(heading: npt.NDArray[np.float64], aim: npt.NDArray[np.float64]) -> float:
    """Return the angle from a heading to an aim [rad]; 0 for the aim (0, 0), which keeps the heading."""
    x, y = aim
    ahead, left = heading
    return math.atan2(y * ahead - x * left, x * ahead + y * left) if x or y else 0.0


def _protected(value: Any) -> Any:
    """Return a percept, or a part of one, with read-only arrays."""
    return type(value)(*map(_protected, value)) if isinstance(value, tuple) else readonly(value)
