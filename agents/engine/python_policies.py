"""Decisions in Python: NumPy policies, callables for one robot, and agents that override `decide`.

No policy state changes before the step is complete: after an error, the world is as the last completed step left it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.state_rows import put_rows, take_rows
from teamsight.agents.group import Group, readonly
from teamsight.policies.answers import check_action, check_answer
from teamsight.policies.interface import Action, Percept, Policy, turned
from teamsight.policies.percept_of_one import PerceptOfOne, percept_of_group_of_one, percept_of_one
from teamsight.world.noise import Stream, generator, stream_number, uniforms

Key = npt.NDArray[np.uint64]
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
    """

    def __init__(self, group: Group, tick: int, key: Key, noise: npt.NDArray[np.float64] | None = None) -> None:
        self.group, self.tick, self.key = group, tick, key
        self._noise = noise
        self._percept: Percept | None = None
        self._given: list[PerceptOfOne] = []
        self._whole: tuple[Action, Any] | None = None
        # The rows that used the group's policy, each with its new state; None for that of the whole group's decision.
        self._decided: dict[int, Any] = {}

    @property
    def percept(self) -> Percept:
        """What the group perceives, as arrays that cannot be written to."""
        if self._percept is None:
            self._percept = _protected(self.group.percept)
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
        """Return the action of the group."""
        group = self.group
        if group.decides_alone:
            rules = [agent.decide for agent in group.agents]
            return self._of_each(rules, f"{type(group.agents[0]).__name__}.decide" if rules else "")
        if not isinstance(group.policy, Policy):
            return self._of_each([group.policy] * len(group), _name(group.policy))
        self._decided = dict.fromkeys(range(len(group)))
        return self._decision_of_all()[0]

    def state(self) -> Any:
        """Return the policy state after this decision."""
        group, size = self.group, len(self.group)
        whole = np.array([row for row, part in self._decided.items() if part is None], np.int64)
        state = group.policy_state
        if len(whole):
            after = self._decision_of_all()[1]
            state = after if len(whole) == size else put_rows(state, whole, take_rows(after, whole, size), size)
        for row, part in self._decided.items():
            if part is not None:
                state = put_rows(state, np.array([row]), part[0], size)
        return state

    def policy_decides(self, row: int, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        """Return (turn, distance) that the group's own policy decides for one robot on this percept.

        Policies that are callables for one robot are given `rng`.
        """
        group = self.group
        if not isinstance(group.policy, Policy):
            return check_answer(_name(group.policy), group.policy(percept, rng), row)
        if row < len(self._given) and percept is self._given[row]:
            # The usual case, an unchanged percept: one decision serves the whole group.
            action, _ = self._decision_of_all()
            self._decided[row] = None
            return _turn(percept.heading, action.heading[row]), float(action.distance[row])
        self._check_situation(row, percept)
        own, rows = percept_of_group_of_one(percept), np.array([row])
        before = take_rows(group.policy_state, rows, len(group))
        action, after = _ask(group.policy, own, before, np.ascontiguousarray(self.noise[:, rows]))
        self._decided[row] = (after,)
        return _turn(percept.heading, action.heading[0]), float(action.distance[0])

    def _check_situation(self, row: int, percept: PerceptOfOne) -> None:
        """Refuse changed neighbour lists if the policy reads the situation, which was computed from the old ones."""
        if row >= len(self._given) or not self.group.inputs:
            return
        given = self._given[row]
        names = ("targets", "teammates", "relayed")
        changed = [name for name in names if getattr(percept, name) is not getattr(given, name)]
        if changed and percept.situation is given.situation:
            raise ValueError(
                f"percept.{changed[0]}: was changed, but {_name(self.group.policy)} reads percept.situation, which was "
                f"not; change both, as in percept._replace({changed[0]}=…, situation=…)"
            )

    def _decision_of_all(self) -> tuple[Action, Any]:
        if self._whole is None:
            self._whole = _ask(self.group.policy, self.percept, self.group.policy_state, self.noise)
        return self._whole

    def _of_each(self, rules: list[Rule], name: str) -> Action:
        group, percept = self.group, self.percept
        stream = stream_number(Stream.CALLABLE, group.number)
        self._given = [percept_of_one(percept, i) for i in range(len(rules))]
        answers = np.zeros((len(group), 2))
        for i, rule in enumerate(rules):
            rng = generator(self.key, stream, self.tick, int(group.bodies.member[i]))
            answers[i] = check_answer(name, rule(self._given[i], rng), i)
        return Action(turned(percept.heading, answers[:, 0]), answers[:, 1])


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
