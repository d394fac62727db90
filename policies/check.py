"""The check that ships with the contract: does a policy keep it?"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies import compiled
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.guarded_decision import try_decision
from teamsight.policies.interface import Action, Percept, Policy
from teamsight.policies.percept_of_one import Rule, percept_of_one

# A kernel may go wrong only after a while, as when a counter leaves its table; more knowledge than this takes long.
_MANY_STEPS = 64
_MUCH_KNOWLEDGE = 1_000_000

# How many things a robot sees at most, decision after decision: some, a crowd, and none at all.
_MOST_SEEN = (3, 40, 0, 250)


def sample_percept(size: int, rng: np.random.Generator, inputs: int = 0, *, most: int = 3) -> Percept:
    """Return a percept such as `size` robots might have, with some that see nothing.

    Parameters
    ----------
    size : int
        How many robots.
    rng : numpy.random.Generator
        Where the numbers come from.
    inputs : int, default 0
        The width of the situation vector.
    most : int, default 3
        How many targets, teammates and relayed a robot sees at most.
    """
    angle = rng.uniform(0, 2 * np.pi, size)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return Percept(
        heading=heading,
        moved=0.1 * rng.random(size)[:, None] * heading,
        speed=np.full(size, 0.1),
        sensing_range=np.ones(size),
        awareness_range=np.ones(size),
        targets=_sample_sightings(size, rng, most),
        teammates=_sample_sightings(size, rng, most),
        relayed=_sample_sightings(size, rng, most),
        situation=rng.random((size, inputs)).astype(np.float32),
    )


def _sample_sightings(size: int, rng: np.random.Generator, most: int) -> NeighbourList:
    count = rng.integers(0, most + 1, size)
    total = int(count.sum())
    angle = rng.uniform(0, 2 * np.pi, total)
    distance = np.sqrt(rng.random(total))
    identity = np.concatenate([np.sort(rng.choice(most + 50, c, replace=False)) for c in count] or [np.zeros(0)])
    return NeighbourList(
        np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        identity.astype(np.int64) + 1,
        np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=-1),
        distance,
    )


def check_policy(policy: Policy | Rule, *, sizes: tuple[int, ...] = (1, 7), steps: int = 3) -> None:
    """Try a policy on made-up percepts and refuse it where it breaks the contract.

    Parameters
    ----------
    policy : Policy or callable
        An object with `draws`, `start` and `decide`; or a callable for one robot.
    sizes : tuple of int
        How many robots to try it with.
    steps : int
        How many decisions to try.

    Raises
    ------
    TypeError
        If a member is missing, or an answer is not an `Action` and a memory, or of a callable not two numbers.
    ValueError
        If an answer has the wrong shape or is not finite, if headings are not unit vectors, if the policy changes what
        it is given, or if the same question gets two answers; and if a kernel uses memory, parameters or noise that
        it did not declare, or elements of arrays that they do not have.
    """
    name = getattr(policy, "__name__", type(policy).__name__)
    if isinstance(policy, type):
        raise TypeError(f"{name}: is a class; give an object, {name}()")
    if not isinstance(policy, Policy):
        if hasattr(policy, "decide") or not callable(policy):
            raise TypeError(f"{name}: is no policy; derive it from teamsight.policies.Policy, or give a function")
        for size in sizes:
            _check_rule(name, policy, sample_percept(size, np.random.default_rng(size)))
        return
    if isinstance(policy.draws, bool) or not isinstance(policy.draws, (int, np.integer)) or policy.draws < 0:
        raise TypeError(f"{name}.draws={checks.shown(policy.draws)}: must be a whole number of at least 0")
    for size in sizes:
        with _guarded_decisions():
            _check_steps(name, policy, size, steps)


@contextmanager
def _guarded_decisions() -> Iterator[None]:
    """Let compiled policies try each decision on guarded arrays first."""
    compiled.before_decision = try_decision
    try:
        yield
    finally:
        compiled.before_decision = None


def _check_steps(name: str, policy: Policy, size: int, steps: int) -> None:
    """Check some decisions of a team, and that a kernel keeps to its arrays for longer."""
    rng = np.random.default_rng(size)
    memory = policy.start(size)
    for step in range(steps):
        percept = _percept_at(step, size, rng, policy)
        memory = _check_decision(name, policy, percept, memory, rng.random((policy.draws, size)))
    if isinstance(policy, CompiledPolicy) and np.size(policy.table) < _MUCH_KNOWLEDGE:
        memory = policy.start(size)
        for step in range(_MANY_STEPS):
            percept = _percept_at(step, size, rng, policy)
            memory = policy.decide(percept, memory, rng.random((policy.draws, size)))[1]


def _percept_at(step: int, size: int, rng: np.random.Generator, policy: Policy) -> Percept:
    percept = sample_percept(size, rng, policy.inputs, most=_MOST_SEEN[step % len(_MOST_SEEN)])
    if step % 2:
        # As degrees of awareness show teammates that hide who they are.
        percept.teammates.identity[:] = -1
    return percept


def _check_decision(name: str, policy: Policy, percept: Percept, memory: Any, noise: npt.NDArray[np.float64]) -> Any:
    before = [array.copy() for array in _arrays((percept, memory, noise))]
    answer = policy.decide(percept, memory, noise)
    if any(not np.array_equal(a, b) for a, b in zip(before, _arrays((percept, memory, noise)), strict=True)):
        raise ValueError(f"{name}.decide changes its arguments; copy what you change and return the copy")
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise TypeError(f"{name}.decide returned {type(answer).__name__}; it must return (action, state)")
    action, after = answer
    check_action(name, action, len(percept.heading))
    again = policy.decide(percept, memory, noise)[0]
    if any(not np.array_equal(a, b) for a, b in zip(action, again, strict=True)):
        raise ValueError(f"{name}.decide gave two answers to one question; take random numbers from `noise` only")
    return after


def _arrays(value: Any) -> list[npt.NDArray[Any]]:
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, tuple):
        return [array for part in value for array in _arrays(part)]
    return []


def _check_rule(name: str, rule: Rule, percept: Percept) -> None:
    before = [array.copy() for array in _arrays(percept)]
    for i in range(len(percept.heading)):
        answers = [check_answer(name, rule(percept_of_one(percept, i), np.random.default_rng(i)), i) for _ in range(2)]
        if answers[0] != answers[1]:
            raise ValueError(f"{name} gave two answers to one question; take random numbers from `rng` only")
    if any(not np.array_equal(a, b) for a, b in zip(before, _arrays(percept), strict=True)):
        raise ValueError(f"{name} changes its percept; copy what you change")


def check_answer(name: str, answer: Any, i: int) -> tuple[float, float]:
    """Return the (turn, distance) that a rule for one robot answered, if that is what it is.

    Raises
    ------
    TypeError, ValueError
        Naming the rule, the robot `i` and the answer.
    """
    try:
        turn, distance = answer
        turn, distance = float(turn), float(distance)
    except (TypeError, ValueError):
        raise TypeError(
            f"{name}: robot {i} got {checks.shown(answer)}; a rule for one robot returns two numbers, (turn, distance)"
        ) from None
    if not (math.isfinite(turn) and math.isfinite(distance)):
        raise ValueError(f"{name}: robot {i} got (turn, distance) = ({turn}, {distance}); both must be finite")
    return turn, distance


def check_action(name: str, action: Action, size: int) -> None:
    """Refuse an action of the wrong shape, one that is not finite, and headings that are not unit vectors.

    Raises
    ------
    TypeError, ValueError
        Naming the policy, the value and the limit.
    """
    if not isinstance(action, tuple) or len(action) != 2:
        raise TypeError(f"{name}: an action is Action(heading, distance), not {type(action).__name__}")
    for part, array, shape in (("heading", action[0], (size, 2)), ("distance", action[1], (size,))):
        if np.shape(array) != shape:
            raise ValueError(f"{name}: action.{part} has the shape {np.shape(array)}; {size} robots need {shape}")
        finite = np.isfinite(np.asarray(array, float))
        if not finite.all():
            row = int(np.argwhere(~finite)[0][0])
            raise ValueError(f"{name}: action.{part} of robot {row} is {np.asarray(array)[row]}; it must be finite")
    heading = np.asarray(action[0], float)
    square = heading[:, 0] ** 2 + heading[:, 1] ** 2
    wrong = (np.abs(square - 1) > 1e-6) & (square != 0)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(
            f"{name}: action.heading of robot {row} has the length {np.sqrt(square[row]):g}; "
            "it must be a unit vector, or (0, 0) to keep the heading"
        )
