"""B-CMOMMT and P-CMOMMT decide like their slow twins, on made-up percepts and in whole runs on both paths."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import relatives as naive
from naive.watched import Watched

from teamsight import CMOMMT, Box, Robot, Target, World, check_policy, run_many
from teamsight.analysis.runs.run_many import evenness
from teamsight.policies import ACmommt, BCmommt, PCmommt
from teamsight.policies.check import sample_percept
from teamsight.policies.handmade.b_cmommt import EXPLORES, FOLLOWS, HELPS, modes, most_requests
from teamsight.policies.percept_of_one import percept_of_one

B_VARIANTS = [
    BCmommt(), BCmommt(weights="shared"), BCmommt(weights="none", answer=3.0), BCmommt("wander", 0.4, escape=0.5, answer=1.5),
    BCmommt("stay", dr1=0.0, dr2=0.0, weights="shared", escape=0.0), BCmommt(answer=0.0, dr1=0.6, dr2=0.6), BCmommt(escape=1.0),
]  # fmt: skip
P_VARIANTS = [
    (PCmommt(), "pairwise"), (PCmommt(), "shared"), (PCmommt(evenness=3.0), "none"), (PCmommt(evenness=0.5), "ring"),
    (PCmommt(observation_counts=3, target_tracks=2), "shared"), (PCmommt(target_tracks=0, weights="none"), "shared"),
    (PCmommt(evenness=2.0, weights="per-teammate", idle="wander", gain=0.5), "shared"),
]  # fmt: skip


class BRobot:
    """A robot under B-CMOMMT, which keeps no state that its decisions depend on."""

    def __init__(self, policy: Any) -> None:
        self.policy = policy

    def decide(self, one: Any, noise: list[float]) -> Any:
        return naive.b_cmommt(self.policy, one, noise)


def small(policy: Any, awareness: str, seed: int) -> CMOMMT:
    return CMOMMT(
        robots=6, targets=7, radius=2.4, policy=policy, awareness=awareness, awareness_range=1.6, sensing_range=0.8,
        target_speed=0.12, uniform_target_speed=True, rng=seed,
    )  # fmt: skip


def run_both(policy: Any, twin: Any, awareness: str) -> None:
    for seed in range(3):
        watched, compiled = small(Watched(policy, twin), awareness, seed), small(policy, awareness, seed)
        with pytest.warns(UserWarning, match="Python"):
            watched.run(25)
        compiled.run(25)
        assert np.array_equal(watched.robots.position, compiled.robots.position)


@pytest.mark.parametrize("policy", B_VARIANTS, ids=str)
def test_b_cmommt_in_whole_runs(policy: BCmommt) -> None:
    run_both(policy, BRobot, "shared")


@pytest.mark.parametrize(("policy", "awareness"), P_VARIANTS, ids=lambda value: str(value).replace("PCmommt", ""))
def test_p_cmommt_in_whole_runs(policy: PCmommt, awareness: str) -> None:
    run_both(policy, naive.PCmommtRobot, awareness)


@pytest.mark.short
@pytest.mark.parametrize("policy", [*B_VARIANTS[1::3], *(policy for policy, _ in P_VARIANTS[1::3])], ids=str)
def test_they_keep_the_contract(policy: Any) -> None:
    check_policy(policy)


@pytest.mark.short
@given(seed=st.integers(0, 2**32 - 1), size=st.integers(1, 12), policy=st.sampled_from(B_VARIANTS), most=st.integers(1, 8))
@settings(max_examples=25)
def test_b_cmommt_on_made_up_percepts(seed: int, size: int, policy: BCmommt, most: int) -> None:
    rng = np.random.default_rng(seed)
    percept, noise = sample_percept(size, rng, most=most), rng.random((policy.draws, size))
    action, state = policy.decide(percept, policy.start(size), noise)
    for i in range(size):
        one = percept_of_one(percept, i)
        heading, distance = naive.b_cmommt(policy, one, noise[:, i].tolist())
        assert action.distance[i] == pytest.approx(distance, abs=1e-9)
        assert action.heading[i] == pytest.approx(heading, abs=1e-6) or distance < 1e-6
        assert most_requests(state)[i] == len(naive.requests(policy, one))


@pytest.mark.short
@pytest.mark.parametrize("awareness", ["pairwise", "shared", "none"])
def test_p_cmommt_without_evenness_is_a_cmommt_to_the_last_bit(awareness: str) -> None:
    options: dict[str, Any] = {"weights": "per-teammate", "idle": "wander", "gain": 0.7}
    plain, even = small(ACmommt(**options), awareness, 3), small(PCmommt(evenness=0.0, **options), awareness, 3)
    for model in (plain, even):
        model.run(200)
    assert np.array_equal(plain.robots.position, even.robots.position)
    other = small(PCmommt(**options), awareness, 3)
    other.run(200)
    assert not np.array_equal(plain.robots.position, other.robots.position)


def placed(robots: list[Any], targets: list[Any], policy: BCmommt) -> tuple[World, Any]:
    """Return a world of robots that hear of each other from 3 away, with resting targets."""
    world = World(Box(12, 12), rng=1)
    group = world.add(Robot, len(robots), position=robots, policy=policy, awareness="shared", awareness_range=3.0, speed=0.1)
    world.senses(group, world.add(Target, len(targets), position=targets, policy="stationary"))
    return world, group


@pytest.mark.short
def test_a_robot_with_nothing_to_follow_helps_the_nearest_that_asks_and_the_others_follow() -> None:
    # The first robot has targets on both sides, each 0.9 away; the second has nothing; the third is too far to hear.
    world, robots = placed([(0, 0), (2.5, 0), (-5, -5)], [(0.9, 0), (-0.9, 0)], BCmommt(idle="stay"))
    world.step()
    assert modes(robots.policy_state).tolist() == [FOLLOWS, HELPS, EXPLORES]
    assert robots.position == pytest.approx(np.array([(0, 0), (2.4, 0), (-5, -5)]))
    assert most_requests(robots.policy_state).tolist() == [0, 2, 0]
    world.run(20)
    assert modes(robots.policy_state).tolist() == [FOLLOWS, FOLLOWS, EXPLORES]
    assert robots.position[1] == pytest.approx((0.9, 0))
    assert most_requests(robots.policy_state)[1] == 2
    # A target that is nearer than `escape` to a robot that senses it is no request; and with answer=0 nobody helps.
    for policy, x in ((BCmommt(idle="stay"), 0.7), (BCmommt(idle="stay", answer=0.0), 0.9)):
        world, robots = placed([(0, 0), (2.5, 0)], [(x, 0), (-x, 0)], policy)
        world.step()
        assert modes(robots.policy_state).tolist() == [FOLLOWS, EXPLORES]


@pytest.mark.short
def test_a_target_that_two_teammates_relay_is_one_request() -> None:
    _, robots = placed([(0, 0), (1.8, 0), (0.9, 2.5)], [(0.9, 0)], BCmommt(idle="stay"))
    robots[0].model.step()
    assert most_requests(robots.policy_state).tolist() == [0, 0, 1]


@pytest.mark.short
def test_a_target_that_was_observed_less_attracts_more() -> None:
    # A robot between two resting targets, of which it has known one for 50 decisions when the other appears.
    def force(evenness: float) -> float:
        world = World(Box(12, 12), rng=1)
        robots = world.add(Robot, 1, position=[(0, 0)], policy=PCmommt(evenness=evenness, idle="stay"), speed=1e-9)
        targets = world.add(Target, 1, position=[(0.8, 0)], policy="stationary")
        world.senses(robots, targets)
        world.run(50)
        targets.add(position=[(-0.8, 0)])
        robots.speed = 0.1
        world.step()
        return float(robots.position[0, 0])

    assert force(0.0) == pytest.approx(0.0, abs=1e-6)
    # p is 52 / 54 and 2 / 54 with the present decision; full speed for a force of 1 or more.
    even = (math.log(54 / 2) - math.log(54 / 52)) / math.log(2)
    assert force(1.0) == pytest.approx(-0.1 * min(even, 1.0), abs=1e-6)
    assert force(0.1) == pytest.approx(
        -0.1 * ((math.log(54 / 2) / math.log(2)) ** 0.1 - (math.log(54 / 52) / math.log(2)) ** 0.1), abs=1e-6
    )


def test_b_cmommt_needs_relayed_targets() -> None:
    with pytest.raises(ValueError, match=r"'b-cmommt': needs 'relayed', which awareness 'pairwise' does not deliver.*shared"):
        CMOMMT(policy="b-cmommt", rng=1).run(1)


def test_distances_out_of_order_are_refused() -> None:
    with pytest.raises(ValueError, match=r"dr2=0\.769.*dr1=2"):
        BCmommt(dr1=2.0)


def test_p_cmommt_is_more_even_and_observes_less_than_a_cmommt() -> None:
    """Over 40 paired runs both differences are below 0 by several of their standard errors."""
    found = {
        name: run_many({"policy": name, "radius": 5.0}, steps=600, replicates=40, rng=5, measure=evenness)
        for name in ("a-cmommt", "p-cmommt")
    }
    for column in ("spread", "observed_fraction"):
        gain = found["p-cmommt"][column] - found["a-cmommt"][column]
        assert gain.mean() < -2 * gain.std() / 40**0.5
