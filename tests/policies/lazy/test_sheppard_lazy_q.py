"""Sheppard's lazy Q-learning: through whole lives against the slow twin, and what it refuses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import learners as naive_learners

from teamsight.policies import SheppardLazyQ, check_policy
from teamsight.policies.check import sample_percept
from teamsight.policies.lazy.learner import action_values
from teamsight.policies.lazy.sheppard_lazy_q import MOST_CHANGE, MOST_SEEN
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import GainReward, own_reward, tabulate, team_reward

pytestmark = pytest.mark.short


def made_up(seed: int, transitions: int, levels: int = 2) -> LazyMemory:
    rng = np.random.default_rng(seed)
    before, after = rng.integers(0, levels + 1, (2, transitions, 3)) / levels
    action = np.stack([rng.uniform(-np.pi, np.pi, transitions), rng.random(transitions)], axis=1)
    facts = {name: rng.integers(0, 2, transitions) for name in ("gained", "lost")}
    return LazyMemory.of(before, action, after, facts, own=2)


@given(
    seed=st.integers(0, 2**32 - 1), size=st.integers(1, 3), capacity=st.integers(1, 25),
    threshold=st.sampled_from([0.0, 0.5, 1.0]), similar_action=st.sampled_from([0.0, 0.3, 2.0]),
    explore=st.sampled_from([0.0, 0.3, 1.0]), both=st.sampled_from(["gain", "net"]), seeded=st.booleans(),
)  # fmt: skip
def test_a_life_as_the_slow_twin_has_it(
    seed: int,
    size: int,
    capacity: int,
    threshold: float,
    similar_action: float,
    explore: float,
    both: str,
    seeded: bool,
) -> None:
    rng = np.random.default_rng(seed)
    reward = GainReward(both=both)
    known = made_up(seed, int(rng.integers(1, capacity + 1))) if seeded else None
    policy = SheppardLazyQ(
        known, reward, 3, threshold=threshold, similar_action=similar_action, explore=explore, capacity=capacity
    )
    twins = [naive_learners.SheppardRobot(policy, tabulate(reward, 8).tolist()) for _ in range(size)]
    if known is not None:
        values = action_values(known, reward, k=min(10, len(known)))
        for twin in twins:
            twin.know(known, values)
    memory = policy.start(size)
    for _ in range(30):
        situation = (rng.integers(0, 3, (size, 3)) / 2).astype(np.float32)
        percept = sample_percept(size, rng)._replace(situation=situation)
        noise = rng.random((3, size))
        action, memory = policy.decide(percept, memory, noise)
        for i, twin in enumerate(twins):
            mine = slice(percept.targets.start[i], percept.targets.start[i + 1])
            targets = set(percept.targets.identity[mine].tolist())
            rotation, share = twin.decide(situation[i], targets, noise[:, i].tolist())
            turn = complex(*action.heading[i]) / complex(*percept.heading[i])
            assert turn == pytest.approx(complex(math.cos(rotation), math.sin(rotation)))
            assert action.distance[i] == pytest.approx(share * percept.speed[i])
            assert [one["q"] for one in twin.store] == pytest.approx(memory.floats[i, : len(twin.store), 5].tolist())


def difference(memory: LazyMemory) -> Any:
    return np.asarray(memory.fact("gained"), float) - 2 * memory.fact("lost")


def test_targets_beyond_the_room_for_identities_are_not_followed() -> None:
    rng = np.random.default_rng(3)
    policy = SheppardLazyQ(None, difference, 3, capacity=40)
    rewards = tabulate(difference, MOST_CHANGE)
    room = np.minimum(np.arange(MOST_SEEN + 1), MOST_CHANGE)
    twins = [naive_learners.SheppardRobot(policy, rewards[np.ix_(room, room)].tolist()) for _ in range(3)]
    memory = policy.start(3)
    for crowd in (0, MOST_SEEN, 300, 70, 5, 3, 12, 200):
        situation = np.zeros((3, 3), np.float32)
        seen = [np.sort(rng.permutation(400)[: crowd + i]) for i in range(3)]
        start = np.cumsum([0, *map(len, seen)])
        percept = sample_percept(3, rng)
        targets = percept.targets._replace(
            start=start, identity=np.concatenate(seen), offset=np.zeros((start[-1], 2)), distance=np.zeros(start[-1])
        )
        noise = rng.random((3, 3))
        _, memory = policy.decide(percept._replace(situation=situation, targets=targets), memory, noise)
        for i, twin in enumerate(twins):
            twin.decide(situation[i], set(seen[i][:MOST_SEEN].tolist()), noise[:, i].tolist())
            assert [one["q"] for one in twin.store] == pytest.approx(memory.floats[i, : len(twin.store), 5].tolist())


def test_what_pays_is_done_again() -> None:
    # The first random action wins a target; from then on, without exploring, it is repeated.
    policy = SheppardLazyQ(inputs=1, threshold=0.5, explore=0.0, learning_rate=1.0, discount=0.0)
    percept = sample_percept(1, np.random.default_rng(1))._replace(situation=np.zeros((1, 1), np.float32))
    nobody, somebody = (
        percept.targets._replace(
            start=np.array([0, count]), identity=np.arange(count), offset=np.zeros((count, 2)), distance=np.zeros(count)
        )
        for count in (0, 1)
    )
    first, memory = policy.decide(percept._replace(targets=nobody), policy.start(1), np.full((3, 1), 0.3))
    for _ in range(3):
        action, memory = policy.decide(percept._replace(targets=somebody), memory, np.full((3, 1), 0.9))
        assert action.heading == pytest.approx(first.heading)
        assert action.distance == pytest.approx(first.distance)


def test_without_similar_situations_or_by_chance_the_action_is_random() -> None:
    memory = LazyMemory.of([[0.0]], [[1.0, 0.5]], [[0.0]], {"gained": [0], "lost": [0]}, own=1)
    percept = sample_percept(1, np.random.default_rng(1))
    for reading, explore, chance, is_random in ((0.4, 0.3, 0.31, False), (0.4, 0.3, 0.29, True), (0.6, 0.3, 0.9, True)):
        policy = SheppardLazyQ(inputs=1, threshold=0.5, explore=explore, memory=memory)
        seen = percept._replace(situation=np.full((1, 1), reading, np.float32))
        action, _ = policy.decide(seen, policy.start(1), np.array([[chance], [0.5], [0.9]]))
        assert action.distance[0] == pytest.approx((0.9 if is_random else 0.5) * percept.speed[0])


def test_the_contract() -> None:
    check_policy(SheppardLazyQ(inputs=3, threshold=2.0), steps=20)
    check_policy(SheppardLazyQ(made_up(1, 50), threshold=2.0), steps=20)


def test_policies_that_differ_have_different_reprs() -> None:
    policies = [
        SheppardLazyQ(), SheppardLazyQ(inputs=16), SheppardLazyQ(threshold=2), SheppardLazyQ(made_up(1, 5)),
        SheppardLazyQ(made_up(2, 5)), SheppardLazyQ(inputs=3), SheppardLazyQ(learning_rate=0.1), SheppardLazyQ(capacity=7),
        SheppardLazyQ(reward=lambda memory: memory.fact("lost")), SheppardLazyQ(reward=lambda memory: memory.fact("gained")),
    ]  # fmt: skip
    assert len({repr(policy) for policy in policies}) == len(policies)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"reward": team_reward}, r"must depend only on the facts gained and lost, at most 8 each"),
        ({"reward": lambda memory: np.full(len(memory), np.nan)}, r"is nan"),
        ({"memory": made_up(1, 30), "capacity": 29}, r"capacity=29: the memory has 30 transitions; give a larger capacity, or a"),
        ({"memory": made_up(1, 30), "inputs": 32}, r"inputs=32: the memory has 2 components for targets and 1 for"),
        ({"memory": own_reward}, r"must be a LazyMemory"),
        ({"explore": 1.5}, r"explore=1.5"),
        ({"capacity": 0}, r"capacity=0: must be at least 1"),
        ({"inputs": 0}, r"inputs=0: must be at least 1"),
    ],
)
def test_what_is_wrong_is_named(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        SheppardLazyQ(**{"inputs": 3} | wrong)


def test_percepts_that_do_not_fit_are_refused() -> None:
    policy = SheppardLazyQ(inputs=3)
    percept = sample_percept(2, np.random.default_rng(1), 2)
    with pytest.raises(ValueError, match="SheppardLazyQ: the percept's situations have 2 components; it compares 3"):
        policy.decide(percept, policy.start(2), np.zeros((3, 2)))


def test_a_robot_has_room_for_what_its_memory_holds() -> None:
    assert SheppardLazyQ().capacity == SheppardLazyQ(made_up(1, 5)).capacity == 600
    assert SheppardLazyQ(made_up(1, 700)).capacity == 700
    assert SheppardLazyQ(made_up(1, 5)).inputs == 3
