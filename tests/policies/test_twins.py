"""Every compiled policy decides like its slow twin: on made-up percepts, and through whole runs of real ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import paper as naive

from teamsight import CMOMMT, Robot, Torus, World
from teamsight.policies import ACmommt, Centroid, Evasive, Policy, RandomWalk, Stationary
from teamsight.policies.check import sample_percept
from teamsight.policies.percept_of_one import percept_of_one

WALKS = [
    RandomWalk(), RandomWalk(0.05), RandomWalk(0.0), RandomWalk(0.5, turn_range=1.0), RandomWalk(1.0, turn_range=3.0),
    RandomWalk(random_distance=True), RandomWalk(0.3, random_distance=True),
]  # fmt: skip
SIMPLE: list[tuple[Any, Callable[..., Any]]] = [
    *((policy, naive.walk) for policy in WALKS),
    *((Centroid(idle=rule), naive.centroid) for rule in ("redraw", "wander", "stay")),
    *((Centroid("wander", turn), naive.centroid) for turn in (0.0, 0.5, 1.0)),
    (Centroid(arrive=False), naive.centroid),
    (Evasive(), naive.evade), (Evasive(turn_probability=1.0), naive.evade),
    (Stationary(), lambda policy, one, noise: ((0.0, 0.0), 0.0)),
]  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize(("policy", "twin"), SIMPLE, ids=lambda value: getattr(value, "__name__", str(value)))
@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 12))
@settings(max_examples=20)
def test_policies_without_memory(policy: Any, twin: Callable[..., Any], seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    percept, noise = sample_percept(size, rng), rng.random((policy.draws, size))
    action, memory = policy.decide(percept, policy.start(size), noise)
    for i in range(size):
        heading, distance = twin(policy, percept_of_one(percept, i), noise[:, i].tolist())
        assert action.heading[i] == pytest.approx(heading, abs=1e-9)
        assert action.distance[i] == pytest.approx(distance, abs=1e-9)
    assert memory.floats.shape == (size, 0, 0)


class Watched(Policy):
    """A NumPy policy that decides as a compiled one and, robot by robot, as its slow twin; and compares."""

    def __init__(self, policy: ACmommt) -> None:
        self.policy, self.draws = policy, policy.draws
        self.lost = 0

    def start(self, size: int) -> Any:
        return self.policy.start(size), [naive.ACmommtRobot(self.policy) for _ in range(size)]

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        own, robots = memory
        action, own = self.policy.decide(percept, own, noise)
        for i, robot in enumerate(robots):
            heading, distance = robot.decide(percept_of_one(percept, i), noise[:, i].tolist())
            assert action.distance[i] == pytest.approx(distance, abs=1e-8)
            if distance > 1e-7 or not self.policy.draws:
                assert action.heading[i] == pytest.approx(heading, abs=1e-6)
            self.lost += sum(track[2] < robot.tick for track in robot.target_tracks)
        return action, (own, robots)


VARIANTS = [
    (ACmommt(), "pairwise"), (ACmommt(), "none"), (ACmommt(), "ring"), (ACmommt(), "shared"),
    (ACmommt(weights="shared"), "pairwise"), (ACmommt(weights="per-teammate"), "shared"), (ACmommt(weights="none"), "shared"),
    (ACmommt(weights="per-teammate", teammate_loss=0.7), "ring"), (ACmommt(weights="shared", shared_weight=0.6), "shared"),
    (ACmommt(idle="wander"), "none"), (ACmommt(idle="stay", idle_when="nothing-sensed"), "pairwise"),
    (ACmommt(idle_when="nothing-sensed"), "shared"), (ACmommt(repulsion_scale="awareness"), "pairwise"),
    (ACmommt(target_tracks=2), "shared"), (ACmommt(target_tracks=0), "shared"), (ACmommt(predictive=2.5, decay=2.0), "none"),
    (ACmommt(do1=0.0, do2=0.0, dr1=0.5, dr2=0.5), "pairwise"), (ACmommt(do1=0.3, do2=0.9, do3=0.95, decay=30.0), "shared"),
    (ACmommt(gain=0.3, idle="wander", turn_probability=0.4), "pairwise"), (ACmommt(gain=3.0, weights="none"), "shared"),
]  # fmt: skip


@pytest.mark.parametrize(("policy", "awareness"), VARIANTS, ids=lambda value: str(value).replace("ACmommt", ""))
def test_a_cmommt_in_whole_runs(policy: ACmommt, awareness: str) -> None:
    watched = Watched(policy)
    # Now and then a world keeps all in sight.
    for seed in range(4):
        model = CMOMMT(
            robots=5, targets=9, radius=2.2, policy=watched, awareness=awareness, awareness_range=0.8,
            sensing_range=0.9, target_speed=0.12, uniform_target_speed=True, rng=seed,
        )  # fmt: skip
        with pytest.warns(UserWarning, match="Python"):
            model.run(20)
    assert watched.lost or policy.predictive < 2


@given(seed=st.integers(0, 2**32 - 1), weights=st.sampled_from(["nearest", "shared", "per-teammate", "none"]))
def test_a_cmommt_at_its_first_sight(seed: int, weights: str) -> None:
    rng = np.random.default_rng(seed)
    policy = ACmommt(weights=weights, target_tracks=0)
    percept, noise = sample_percept(9, rng), rng.random((1, 9))
    action, _ = policy.decide(percept, policy.start(9), noise)
    for i in range(9):
        heading, distance = naive.ACmommtRobot(policy).decide(percept_of_one(percept, i), noise[:, i].tolist())
        assert action.distance[i] == pytest.approx(distance, abs=1e-9)
        assert distance < 1e-6 or action.heading[i] == pytest.approx(heading, abs=1e-6)


@given(
    seed=st.integers(0, 2**32 - 1), gain=st.floats(1e-3, 1e3), turn=st.floats(0, 1),
    when=st.sampled_from(["no-force", "nothing-sensed"]),
)  # fmt: skip
def test_gain_and_turn_probability(seed: int, gain: float, turn: float, when: str) -> None:
    rng = np.random.default_rng(seed)
    policy = ACmommt(idle="wander", idle_when=when, gain=gain, turn_probability=turn, target_tracks=0)
    percept, noise = sample_percept(9, rng), rng.random((2, 9))
    action, _ = policy.decide(percept, policy.start(9), noise)
    plain, _ = replace(policy, gain=1.0).decide(percept, policy.start(9), noise)
    # A gain changes how far a robot goes, never where to, and no robot goes faster than it can.
    assert np.array_equal(action.heading, plain.heading)
    assert (action.distance <= percept.speed).all()
    for i in range(9):
        heading, distance = naive.ACmommtRobot(policy).decide(percept_of_one(percept, i), noise[:, i].tolist())
        assert action.distance[i] == pytest.approx(distance, abs=1e-9 * max(gain, 1.0))
        assert distance < 1e-6 or action.heading[i] == pytest.approx(heading, abs=1e-6)


@pytest.mark.short
def test_a_gain_multiplies_the_force_up_to_the_full_speed() -> None:
    percept = sample_percept(200, np.random.default_rng(1))
    distances = []
    for gain in (0.5, 1.0, 1e6):
        policy = ACmommt(idle="stay", gain=gain, target_tracks=0)
        action, _ = policy.decide(percept, policy.start(200), np.empty((0, 200)))
        distances.append(action.distance / percept.speed)
    half, one, full = distances
    weak = one < 1
    assert (weak & (one > 0)).any()
    assert half[weak] == pytest.approx(0.5 * one[weak])
    assert np.array_equal(full, (one > 0).astype(float))


@pytest.mark.parametrize("make", [ACmommt, Centroid], ids=lambda kind: kind.__name__)
@pytest.mark.parametrize(("turn", "turned"), [(0.0, 0), (1.0, 50)])
def test_a_robot_alone_wanders_straight_on_or_turns_each_step(make: Any, turn: float, turned: int) -> None:
    world = World(Torus(500.0, 500.0), rng=1)
    robots = world.add(Robot, 1, policy=make(idle="wander", turn_probability=turn), speed=0.1)
    changes = 0
    for _ in range(50):
        before = robots.bodies.heading.copy()
        world.step()
        changes += not np.array_equal(before, robots.bodies.heading)
    assert changes == turned
