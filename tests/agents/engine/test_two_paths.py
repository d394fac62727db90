"""Two paths, one answer: running, stepping and any mix of the two give the same bits."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.agents.awareness import NoAwareness, PairwiseAwareness, RelayedAwareness, RingAwareness, SharedAwareness
from teamsight.policies import ACmommt, Centroid, Evasive, Evolved, RandomWalk, Stationary, turned
from teamsight.policies.interface import Action, Policy

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

PATHS: dict[str, Callable[[World], None]] = {
    "steps": lambda model: [model.step() for _ in range(60)] and None,
    "mixed": lambda model: [model.run(30), model.step(), model.run(0), model.run(29)] and None,
    "pieces": lambda model: [model.run(k) for k in (1, 2, 3, 5, 7, 11, 13, 17, 1)] and None,
}


def fingerprint(model: World) -> list[Any]:
    """All that a user can see of what has happened."""
    seen: list[Any] = [
        model.tick,
        model.steps,
        model.observed,
        model.mean_degree,
        model.observed_fraction,
        model.max_neighbours,
    ]
    for group in model.groups:
        seen += [group.position, group.heading, group.bodies.moved, group.identity]
        seen += [group.policy_state] if isinstance(group.policy_state, np.ndarray) else list(group.policy_state or ())
        for kind in ("targets", "teammates"):
            seen += list(group.neighbours(kind))
        seen += [agent.situation for agent in group if isinstance(agent, Robot)]
        for agent in list(group)[:3]:
            percept = agent.percept
            seen += [*percept.targets, *percept.teammates, *percept.relayed, percept.moved]
    seen += [model.recording.history, model.recording.trajectory]
    if hasattr(model, "datacollector"):
        seen += [model.datacollector.get_model_vars_dataframe()]
    return seen


def same(one: Any, other: Any) -> bool:
    if isinstance(one, pd.DataFrame):
        return bool(one.equals(other) and one.index.equals(other.index))
    if isinstance(one, np.ndarray):
        return bool(one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes())
    return bool(one == other or (one != one and other != other))


def assert_one_answer(make: Callable[[], World], paths: dict[str, Callable[[World], None]] = PATHS) -> None:
    reference = make()
    start = [group.position.copy() for group in reference.groups]
    reference.run(60)
    assert reference.tick == 60
    expected = fingerprint(reference)
    still = all(np.array_equal(a, group.position) for a, group in zip(start, reference.groups, strict=True))
    assert not still or all(isinstance(group.policy, Stationary) for group in reference.groups)
    for name, path in paths.items():
        model = make()
        path(model)
        found = fingerprint(model)
        assert len(found) == len(expected)
        wrong = [k for k, pair in enumerate(zip(expected, found, strict=True)) if not same(*pair)]
        assert not wrong, f"{name}: {[(expected[k], found[k]) for k in wrong[:2]]}"


def seeds() -> int:
    return fresh_seed()


POLICIES = [
    ACmommt(), ACmommt(weights="shared"), ACmommt(weights="per-teammate", idle="wander"), ACmommt(weights="none", idle="stay"),
    ACmommt(idle_when="nothing-sensed", repulsion_scale="awareness"), ACmommt(target_tracks=0), Centroid(), Centroid("wander"),
    ACmommt(idle="wander", turn_probability=0.3, gain=0.4), Centroid("wander", 0.5),
    Centroid("stay", arrive=False), RandomWalk(), RandomWalk(0.1, turn_range=1.0, random_distance=True), Stationary(), Evasive(),
    Evolved(),
]  # fmt: skip
DEGREES = [
    NoAwareness(), RingAwareness(16), RingAwareness(1), RingAwareness(5), PairwiseAwareness(), SharedAwareness(),
    RelayedAwareness(), RelayedAwareness(2, 1, 0.2),
]  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize("policy", POLICIES, ids=str)
def test_every_policy(policy: Any) -> None:
    seed = seeds()
    assert_one_answer(lambda: CMOMMT(policy=policy, awareness="shared", radius=2.5, rng=seed))


@pytest.mark.parametrize("awareness", DEGREES, ids=str)
@pytest.mark.parametrize(
    "target_policy", ["random-walk", "evasive", "stationary", "centroid", "a-cmommt", RandomWalk(0.3)], ids=str
)
def test_every_degree_and_every_target_policy(awareness: Any, target_policy: Any) -> None:
    seed = seeds()
    assert_one_answer(
        lambda: CMOMMT(
            awareness=awareness, target_policy=target_policy, radius=2.5, rng=seed, uniform_target_speed=True
        )
    )


@pytest.mark.parametrize("arena", [Disc(2.0), Box(3.0, 5.0), Torus(4.0, 6.0), Disc(0.05)], ids=str)
@pytest.mark.parametrize("turn_limit", [None, 0.2, [0.0, 0.1, 1.0, 3.0, 4.0, 0.5]], ids=str)
def test_every_arena_and_turn_limits_and_several_groups(arena: Any, turn_limit: Any) -> None:
    seed = seeds()

    def make() -> World:
        world = World(arena, rng=seed)
        fast = world.add(
            Robot, 6, policy=ACmommt(), awareness="shared", turn_limit=turn_limit, speed=[0.1, 0.2, 0.0, 0.3, 1.0, 0.1]
        )
        slow = world.add(
            Robot, 3, policy=Centroid(), awareness=RingAwareness(4), awareness_range=[0.5, 1.0, 2.0], speed=0.03
        )
        deer = world.add(Target, 5, policy=Evasive(), speed=0.08, sensing_range=0.7)
        flies = world.add(Target, 30, policy=RandomWalk(0.2), speed=0.1)
        for robots in (fast, slow):
            for targets in (deer, flies):
                world.senses(robots, targets)
        world.senses(deer, fast)
        return world

    assert_one_answer(make)


@pytest.mark.parametrize("every", [1, 7, 100])
def test_recording_positions(every: int) -> None:
    seed = seeds()

    def make() -> World:
        model = CMOMMT(robots=4, targets=3, rng=seed)
        model.recording.record_positions(every)
        return model

    assert_one_answer(make)
    plain, recorded = CMOMMT(robots=4, targets=3, rng=seed), make()
    plain.run(60)
    recorded.run(60)
    assert np.array_equal(plain.robots.position, recorded.robots.position)
    table = recorded.recording.trajectory
    assert table.time.unique().tolist() == list(range(every, 61, every))
    assert len(table) == 7 * (60 // every)
    if every == 1:
        assert np.array_equal(table[table.time == 60][["x", "y"]].to_numpy()[:4], plain.robots.position)


def test_events_between() -> None:
    seed = seeds()

    def make() -> World:
        model = CMOMMT(robots=8, targets=6, radius=2.0, target_policy="evasive", rng=seed)

        def teleport() -> None:
            model.robots[0].position = (0.0, 0.0)
            model.targets[1].heading = (1.0, 2.0)

        def kick() -> Any:
            while True:
                yield model.clock.timeout(7.5)
                model.robots[int(model.clock.now) % len(model.robots)].position = (0.1 * model.clock.now % 1, 0.2)

        model.clock.at(12.5, teleport)
        model.clock.at(20, model.robots[3].remove)
        model.clock.at(20, model.targets[2].remove)
        model.clock.at(41.1, lambda: model.add(Robot, 2, policy="a-cmommt", awareness="shared", name="late"))
        model.clock.process(kick())
        return model

    assert_one_answer(make)


class Careful(Policy):
    """A NumPy policy with a memory: circles, the wider the more targets there are, with noise."""

    draws = 2

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        seen = np.diff(percept.targets.start)
        return Action(
            turned(percept.heading, 0.3 + noise[0] + memory), percept.speed * noise[1] / (1 + seen)
        ), memory + 0.01


def rule(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    """A policy for one robot."""
    turn = rng.normal() + len(percept.teammates.identity)
    return math.remainder(turn, 2 * math.pi), percept.speed * rng.random()


class Own(Robot):
    """Turns to the left of what its group's policy says."""

    def decide(self, percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        return turn + 0.1, 0.9 * distance


class Busy(Robot):
    """Moves by itself before it perceives."""

    def step(self) -> None:
        self.position = 0.99 * self.position


@pytest.mark.short
def test_python_and_compiled_policies_mixed() -> None:
    seed = seeds()

    def make() -> World:
        world = World(Disc(2.0), rng=seed)
        kinds = [
            (Robot, ACmommt()),
            (Robot, Careful()),
            (Robot, rule),
            (Own, ACmommt()),
            (Own, Careful()),
            (Busy, Centroid()),
        ]
        teams = [world.add(kind, 3, policy=policy, awareness="shared") for kind, policy in kinds]
        targets = world.add(Target, 6, policy=Evasive(), speed=0.05)
        for robots in teams:
            world.senses(robots, targets)
            world.senses(targets, robots)
        return world

    assert_one_answer(make)


class Plain(Policy):
    """The same policy, as its NumPy side only."""

    def __init__(self, policy: Any) -> None:
        self.policy, self.draws, self.inputs = policy, policy.draws, policy.inputs

    def start(self, size: int) -> Any:
        return self.policy.start(size)

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        return self.policy.decide(percept, state, noise)


@pytest.mark.parametrize("policy", [p for p in POLICIES if not isinstance(p, Stationary)], ids=str)
def test_a_policy_called_from_python_agrees_with_its_kernel_in_the_loop(policy: Any) -> None:
    seed = seeds()
    compiled, plain = (CMOMMT(policy=p, awareness="shared", radius=2.5, rng=seed) for p in (policy, Plain(policy)))
    compiled.run(50)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        plain.run(50)
    assert np.array_equal(compiled.robots.position, plain.robots.position)
    assert compiled.recording.history.equals(plain.recording.history)


def test_running_says_once_why_it_steps() -> None:
    model = CMOMMT(policy=rule, rng=1)
    with pytest.warns(UserWarning, match=r"run\(\) makes its steps one by one, because the policy of robots is Python"):
        model.run(2)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.run(2)
        CMOMMT(rng=1).run(5)
