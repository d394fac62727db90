"""Decisions of policies that are Python: NumPy policies, callables for one robot, and robots that decide themselves."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.group import Group, readonly
from teamsight.policies.check import check_action, check_answer
from teamsight.policies.interface import Action, Percept, Sightings, percept_of_one, turned
from teamsight.world.noise import Stream, generator, stream_number


def decide(group: Group, tick: int, key: npt.NDArray[np.uint64]) -> None:
    """Let the group decide, and keep its action and memory.

    Raises
    ------
    TypeError, ValueError
        If what the policy returns is no action.
    """
    if group.decides_alone:
        rules = [agent.decide for agent in group.agents]
        action = _of_each(group, rules, f"{type(group.agents[0]).__name__}.decide" if rules else "", tick, key)
    else:
        action = _of_policy(group, tick, key)
    group.action.heading[:] = action.heading
    group.action.distance[:] = action.distance


def policy_decision(group: Group, tick: int, key: npt.NDArray[np.uint64]) -> Action:
    """Return what the group's own policy decides at this tick, deciding only once."""
    if group.decided_at != tick:
        group.policy_action = _of_policy(group, tick, key)
        group.decided_at = tick
    return group.policy_action


def _of_policy(group: Group, tick: int, key: npt.NDArray[np.uint64]) -> Action:
    policy = group.policy
    name = getattr(policy, "__name__", type(policy).__name__)
    if not hasattr(policy, "decide"):
        return _of_each(group, [policy] * len(group), name, tick, key)
    try:
        answer = policy.decide(_protected(group.percept), group.memory, group.noise(tick))
    except ValueError as error:
        if "read-only" not in str(error):
            raise
        raise ValueError(f"{name}.decide writes into its percept ({error}); copy the array first") from error
    if not isinstance(answer, tuple) or isinstance(answer, Action) or len(answer) != 2:
        raise TypeError(f"{name}.decide returned {type(answer).__name__}; it must return (action, memory)")
    action, memory = answer
    check_action(name, action, len(group))
    group.memory = memory
    return Action(*action)


def _of_each(group: Group, rules: list[Any], name: str, tick: int, key: npt.NDArray[np.uint64]) -> Action:
    percept = _protected(group.percept)
    stream = stream_number(Stream.CALLABLE, group.number)
    answers = np.zeros((len(group), 2))
    for i, rule in enumerate(rules):
        rng = generator(key, stream, tick, int(group.bodies.member[i]))
        answers[i] = check_answer(name, rule(percept_of_one(percept, i), rng), i)
    return Action(turned(percept.heading, answers[:, 0]), answers[:, 1])


def _protected(percept: Percept) -> Percept:
    """Return the percept with arrays that cannot be written to."""
    parts: list[Any] = [_protected_sightings(part) if isinstance(part, tuple) else readonly(part) for part in percept]
    return Percept(*parts)


def _protected_sightings(seen: Sightings) -> Sightings:
    return Sightings(*(readonly(array) for array in seen))
