"""`check_policy`: tests whether a policy keeps its contract."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

import teamsight.policies.compiled as compiled
from teamsight.core.contracts import are_equal, numbers, random_headings
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.core.neighbour_list import NeighbourList, no_neighbours
from teamsight.policies.actions import check_action, check_answer
from teamsight.policies.channels import OF_BODIES, channels_of, columns_of
from teamsight.policies.compiled import (
    CompiledPolicy,
    Decision,
    check_declarations,
    check_state,
    decision_record,
    dense,
    pack_decision,
)
from teamsight.policies.interface import IDENTITIES, Action, Floats, Percept, Policy, PolicyState
from teamsight.policies.percept_of_one import Rule, percept_of_one

_ROBOT = Axis("robots", "robots are 0 to n − 1, and n is percept.heading.shape[0]")
_TABLE = "the policy's `table` determines the shape"
_DECLARED = "declare as many as it needs in start(size)"

#: The axes of percepts and scenes, by the name of their length; for errors.
PERCEPT_AXES = {
    "n": _ROBOT,
    "2": Axis("components", "0 is x, and 1 is y"),
    "n + 1": Axis("elements", "there is one more than robots; robot i's are start[i] and start[i + 1]"),
    "k": Axis("neighbours", "those of robot i are start[i] up to, not including, start[i + 1]"),
    "width": Axis("inputs", "declare as many as it needs as `inputs`"),
    "rays": Axis("rays", "declare as many as it reads as `rays`"),
    "identities": Axis("identities", "hidden ones are −1; read elements by column_of(column, identity)"),
    "p": Axis("parameters", "add what it needs to `parameters`"),
}

_AXES = PERCEPT_AXES | {
    "rows": Axis("rows", _TABLE), "columns": Axis("columns", _TABLE),
    "slots": Axis("slots", _DECLARED), "fields": Axis("fields", _DECLARED),
    "intslots": Axis("slots", _DECLARED), "intfields": Axis("fields", _DECLARED),
    "ticks": Axis("ticks", "the kernel receives one"), "1": Axis("ticks", "there is one"),
    "draws": Axis("draws", "declare as many as it needs as `draws`"),
    "lanes": Axis(
        "robots", "rows of noise can be longer than there are robots: stop at percept.heading.shape[0]"
    ),
}  # fmt: skip


@cache
def _guard(channels: tuple[str, ...], columns: tuple[str, ...]) -> Guard[Decision]:
    return Guard(decision_record(channels, columns), ("arrays.state", "action"), _AXES)


# A value that no kernel computes; it marks what was not written.
_UNWRITTEN = np.uint64(0x7FF8_5EED_5EED_5EED)


def try_decision(policy: CompiledPolicy, percept: Percept, state: PolicyState, noise: Floats) -> None:
    """Run a policy's kernel under guard, on copies of the arguments of `CompiledPolicy.decide`.

    Raises
    ------
    TypeError
        If the kernel cannot be compiled.
    ValueError
        If it uses state, parameters or noise that the policy did not declare, writes into read-only arrays, or leaves a
        part of the action unwritten.
    """
    name, size = type(policy).__name__, len(percept.heading)
    for member, dimensions in (("parameters", 1), ("table", 2)):
        numbers(f"{name}.{member}", getattr(policy, member), dimensions, are_finite=False)
    check_state(policy, state, size)
    action = Action(*(np.full(shape, _UNWRITTEN).view(np.float64) for shape in ((size, 2), size)))
    long = np.zeros((1, len(noise), (size // 8 + 2) * 8))
    long[0, :, :size] = noise
    given = pack_decision(policy, dense(percept), state, long, np.zeros(1, np.int64), action).value
    guard = _guard(policy.channels, policy.columns)
    done = guard.run(name, "its kernel", policy.entry(), given, {"noise": size})[1]
    for part, array in done.action._asdict().items():
        is_written = (array.view(np.uint64) != _UNWRITTEN).reshape(len(array), -1).all(axis=1)
        if not is_written.all():
            raise ValueError(
                f"{name}: its kernel leaves action.{part} of robot {np.argmin(is_written)} unwritten, so that the last "
                "one would be repeated; write it for every robot at each decision"
            )


# A kernel may fail only after many decisions, as when a counter exceeds its array. With larger tables this takes long.
_MANY_STEPS = 64
_LARGE_TABLE = 1_000_000

# Largest numbers of neighbours in consecutive decisions: a few, a crowd, none, a large crowd, and a few from then on.
_MOST_SEEN = (3, 40, 0, 250)
# What functions for one robot are shown, which declare nothing.
_RAYS = 32


def sample_percept(
    size: int,
    rng: np.random.Generator,
    inputs: int = 0,
    *,
    most: int = 3,
    channels: tuple[str, ...] = (),
    columns: tuple[str, ...] = (),
    rays: int = 0,
) -> Percept:
    """Return a random percept of `size` robots, some of which see nothing.

    Parameters
    ----------
    size : int
        Number of robots.
    rng : numpy.random.Generator
        Source of the random numbers.
    inputs : int, default 0
        Width of the situation vector.
    most : int, default 3
        Largest number of targets, of teammates and of relayed targets that a robot sees, and of each channel.
    channels : tuple of str, default ()
        The names of further channels.
    columns : tuple of str, default ()
        The names of columns.
    rays : int, default 0
        Number of rays of a lidar.
    """
    heading, identities = random_headings(size, rng), size + most + 51
    percept = Percept(
        heading=heading,
        moved=0.1 * rng.random(size)[:, None] * heading,
        speed=np.full(size, 0.1),
        sensing_range=np.ones(size),
        awareness_range=np.ones(size),
        targets=_sample_neighbours(size, rng, most),
        teammates=_sample_neighbours(size, rng, most),
        relayed=_sample_neighbours(size, rng, most),
        situation=rng.random((size, inputs)).astype(np.float32),
        channels=channels_of(channels, [_sample_neighbours(size, rng, most) for _ in channels]),
        # Not drawn, so that they change no other number of a sample.
        reward=np.round(heading[:, 0]),
        ended=heading[:, 0] > 0.75,
        identity=1 + np.arange(size),
        # From 0 to the range; some rays meet nothing.
        lidar=np.minimum(np.abs(heading[:, :1]) * (0.5 * np.arange(rays) % 2), 1.0),
    )
    # Some of the others do not have the column, but all have a body.
    without = (rng.random(identities) < 0.2) & (np.arange(identities) > size)
    values = [np.where(without & (name not in OF_BODIES), np.nan, rng.integers(0, 4, identities)) for name in columns]
    return percept._replace(columns=columns_of(columns, values))


def _sample_neighbours(size: int, rng: np.random.Generator, most: int) -> NeighbourList:
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
    """Run a policy on random percepts and raise an error if it breaks the contract.

    Parameters
    ----------
    policy : Policy or callable
        A policy, or a function for one robot ``f(percept, rng) -> (turn, distance)``.
    sizes : tuple of int
        Numbers of robots.
    steps : int
        Number of decisions for each size.

    Raises
    ------
    TypeError
        If it is not a policy, or does not return an `Action` and a state, or, for a function, two numbers.
    ValueError
        If an action has the wrong shape, is not finite, or has headings that are not unit vectors; if the policy
        changes its arguments, or returns different actions for equal arguments; or if a kernel reads or writes outside
        of its arrays.
    """
    name = getattr(policy, "__name__", type(policy).__name__)
    if isinstance(policy, type):
        raise TypeError(f"{name}: is a class; give an object, {name}()")
    if not isinstance(policy, Policy):
        if hasattr(policy, "decide") or not callable(policy):
            raise TypeError(f"{name}: is not a policy; derive it from teamsight.policies.Policy, or give a function")
        for size in sizes:
            _check_rule(name, policy, sample_percept(size, np.random.default_rng(size), rays=_RAYS))
        return
    check_declarations(name, policy)
    for size in sizes:
        begin_check()
        # Each decision runs under guard first.
        compiled.before_decision = try_decision
        try:
            _check_steps(name, policy, size, steps)
        finally:
            compiled.before_decision = None


def _check_steps(name: str, policy: Policy, size: int, steps: int) -> None:
    """Check some decisions in full, and, for a kernel, the array accesses of many more."""
    rng = np.random.default_rng(size)
    state = policy.start(size)
    for percept in _percepts(steps, size, rng, policy):
        state = _check_decision(name, policy, percept, state, rng.random((policy.draws, size)))
    if isinstance(policy, CompiledPolicy) and np.size(policy.table) < _LARGE_TABLE:
        state = policy.start(size)
        for percept in _percepts(_MANY_STEPS, size, rng, policy):
            state = policy.decide(percept, state, rng.random((policy.draws, size)))[1]


def _percepts(steps: int, size: int, rng: np.random.Generator, policy: Policy) -> Iterator[Percept]:
    for step in range(steps):
        most = _MOST_SEEN[step] if step < len(_MOST_SEEN) else _MOST_SEEN[0]
        percept = sample_percept(
            size, rng, policy.inputs, most=most, channels=policy.channels, columns=policy.columns, rays=policy.rays
        )
        if step % 2 and IDENTITIES not in policy.needs:
            # Some degrees of awareness hide the identities of teammates.
            percept.teammates.identity[:] = -1
        yield percept


def _check_decision(name: str, policy: Policy, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> Any:
    before = [array.copy() for array in _arrays((percept, state, noise))]
    answer = policy.decide(percept, state, noise)
    if not are_equal(before, _arrays((percept, state, noise))):
        raise ValueError(f"{name}.decide changes its arguments; copy what you change and return the copy")
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise TypeError(f"{name}.decide returned {type(answer).__name__}; it must return (action, state)")
    action, after = answer
    try:
        check_action(name, action, len(percept.heading))
    except ValueError as error:
        if blamed := _not_finite_by(policy, percept, state, noise, action):
            raise ValueError(f"{error}. {blamed}") from None
        raise
    again = policy.decide(percept, state, noise)[0]
    if not are_equal(action, again):
        raise ValueError(f"{name}.decide returned different actions for equal arguments; use `noise` only")
    if isinstance(policy, CompiledPolicy) and not policy.reads_teammates:
        none = no_neighbours(len(percept.heading))
        alone = policy.decide(percept._replace(teammates=none, relayed=none), state, noise)[0]
        if not are_equal(action, alone):
            raise ValueError(f"{name}.reads_teammates is False, but its actions depend on teammates; return True")
    return after


def _not_finite_by(policy: Policy, percept: Percept, state: Any, noise: npt.NDArray[np.float64], action: Any) -> str:
    """Return which columns make an action that is not finite, since some are NaN; empty if it has another cause."""
    if not policy.columns or _is_finite(action):
        return ""
    others = len(percept.heading) + 1
    identity = np.where(percept.teammates.identity < 0, others, percept.teammates.identity)
    shown = percept._replace(teammates=percept.teammates._replace(identity=identity))
    filled = {name: np.nan_to_num(getattr(percept.columns, name)) for name in policy.columns}

    def is_finite_without(*names: str) -> bool:
        # The robots themselves have every column.
        own = np.arange(len(next(iter(filled.values())))) < others
        missing = {name: np.where(own, filled[name], np.nan) for name in names}
        columns: Any = percept.columns
        columns = columns._replace(**(filled | missing))
        found: Any = policy.decide(shown._replace(columns=columns), state, noise)
        return _is_finite(found[0])

    if not is_finite_without():
        return ""
    names = " and ".join(repr(name) for name in policy.columns if not is_finite_without(name))
    return names and (
        f"It comes of the column {names}, which is NaN for agents that do not have it and for hidden identities: test "
        "what column_of returns, as by np.isnan"
    )


def _is_finite(action: Any) -> bool:
    return all(np.isfinite(np.asarray(part, float)).all() for part in action)


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
            raise ValueError(f"{name} returned different answers for equal arguments; use `rng` only")
    if not are_equal(before, _arrays(percept)):
        raise ValueError(f"{name} changes its percept; copy what you change")
