"""The lazy learners that read a memory: against their slow twins, in any order of transitions, and what they refuse."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import learners as naive_learners

from teamsight.policies import LazyQ, PessimisticLazyQ, check_policy
from teamsight.policies.actions import ActionGrid
from teamsight.policies.check import sample_percept
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import GainReward, own_reward

pytestmark = pytest.mark.short


def parts(seed: int, transitions: int, own: int = 4, added: int = 3, levels: int = 3) -> tuple[Any, ...]:
    """Situations, actions, next situations and facts, so coarse that many transitions are equally near or equally good."""
    rng = np.random.default_rng(seed)
    before, after = rng.integers(0, levels + 1, (2, transitions, own + added)) / levels
    action = np.stack([rng.integers(-3, 4, transitions) / 1.1, rng.integers(0, 4, transitions) / 3], axis=1)
    facts = {name: rng.integers(0, 2, transitions) for name in ("gained", "lost")}
    return before, action, after, facts


def made_up(seed: int, transitions: int, **settings: Any) -> LazyMemory:
    return LazyMemory.of(*parts(seed, transitions), own=4, settings=settings)


def percept_of(seed: int, size: int, inputs: int, levels: int = 3) -> Any:
    rng = np.random.default_rng(seed)
    situation = (rng.integers(0, levels + 1, (size, inputs)) / levels).astype(np.float32)
    return sample_percept(size, rng)._replace(situation=situation)


def rotation_of(percept: Any, action: Any, i: int) -> complex:
    return complex(*action.heading[i]) / complex(*percept.heading[i])


@given(
    seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 100), k=st.integers(1, 12), cooperative=st.booleans(),
    rotations=st.integers(1, 7), distances=st.integers(1, 3),
)  # fmt: skip
def test_as_the_slow_twins(seed: int, transitions: int, k: int, cooperative: bool, rotations: int, distances: int) -> None:
    memory, k = made_up(seed, transitions), min(k, transitions)
    inputs = 7 if cooperative else 4
    percept = percept_of(seed + 1, 5, inputs)
    constants = {"inputs": inputs, "k": k, "discount": 0.5, "sweeps": 2}
    rewards = own_reward(memory).tolist()
    values = naive_learners.action_values(memory, rewards, inputs, k, 0.5, 2)
    optimist = LazyQ(memory, **constants)
    shares = tuple((part + 1) / distances for part in range(distances))
    pessimist = PessimisticLazyQ(memory, **constants, actions=ActionGrid(rotations, shares))
    for policy in (optimist, pessimist):
        action, _ = policy.decide(percept, policy.start(5), np.zeros((0, 5)))
        for i in range(5):
            seen = percept.situation[i]
            if policy is optimist:
                rotation, share = naive_learners.lazy_q(memory, values, seen, inputs, k)
            else:
                rotation, share = naive_learners.pessimistic(memory, values, seen, inputs, k, rotations, shares)
            assert rotation_of(percept, action, i) == pytest.approx(complex(math.cos(rotation), math.sin(rotation)))
            assert action.distance[i] == pytest.approx(share * percept.speed[i])


def test_the_best_of_the_nearest_on_a_memory_where_the_answer_is_known() -> None:
    # Three transitions stand where the robot is: a loss, nothing, and a gain; the best of all is far away.
    situation = [[0.0], [0.0], [0.1], [1.0]]
    action = [[0.1, 1], [0.2, 0.5], [-0.3, 0.25], [3.0, 1]]
    facts = {"gained": [0, 0, 1, 5], "lost": [1, 0, 0, 0]}
    memory = LazyMemory.of(situation, action, [[0.5]] * 4, facts, own=1)
    percept = percept_of(1, 1, 1)._replace(situation=np.zeros((1, 1), np.float32))

    def answer(**constants: Any) -> tuple[float, float]:
        policy = LazyQ(memory, GainReward(both="net"), discount=0, **constants)
        found, _ = policy.decide(percept, policy.start(1), np.zeros((0, 1)))
        turn = rotation_of(percept, found, 0)
        return round(math.atan2(turn.imag, turn.real), 6), round(found.distance[0] / percept.speed[0], 6)

    assert answer(k=1) == (0.1, 1)
    assert answer(k=2) == (0.2, 0.5)
    assert answer(k=3) == (-0.3, 0.25)
    # Equally good with the far one among them: the nearer stays.
    assert answer(k=4) == (-0.3, 0.25)


def test_the_worst_that_is_known_of_an_action_counts() -> None:
    # Straight on once won and once lost; backwards nothing ever happened.
    action = [[0.1, 1], [-0.1, 1], [3.1, 1]]
    memory = LazyMemory.of([[0.0]] * 3, action, [[0.5]] * 3, {"gained": [1, 0, 0], "lost": [0, 1, 0]}, own=1)
    percept = percept_of(1, 1, 1)
    for policy, expected in (
        (LazyQ(memory, discount=0, k=3), 0.1),
        (PessimisticLazyQ(memory, discount=0, k=3, actions=ActionGrid(8, (1.0,))), math.pi),
    ):
        found, _ = policy.decide(percept, policy.start(1), np.zeros((0, 1)))
        turn = rotation_of(percept, found, 0)
        assert abs(math.atan2(turn.imag, turn.real)) == pytest.approx(expected)


@pytest.mark.parametrize("kind", [LazyQ, PessimisticLazyQ])
@given(seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 60))
def test_the_order_in_which_pairs_are_given_changes_nothing(kind: Any, seed: int, transitions: int) -> None:
    before, action, after, facts = parts(seed, transitions)
    order = np.random.default_rng(seed).permutation(transitions)
    percept = percept_of(seed + 1, 6, 7)
    answers = []
    for place in (np.arange(transitions), order):
        shuffled = {name: fact[place] for name, fact in facts.items()}
        memory = LazyMemory.of(before[place], action[place], after[place], shuffled, own=4)
        policy = kind(memory, k=min(5, transitions))
        answers.append((repr(policy), *policy.decide(percept, policy.start(6), np.zeros((0, 6)))[0]))
    assert answers[0][0] == answers[1][0]
    assert all(np.array_equal(one, other) for one, other in zip(answers[0][1:], answers[1][1:], strict=True))


@given(seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 60))
def test_where_nobody_is_seen_the_inputs_for_teammates_change_nothing(seed: int, transitions: int) -> None:
    before, action, after, facts = parts(seed, transitions)
    before[:, 4:] = after[:, 4:] = 1.0
    memory = LazyMemory.of(before, action, after, facts, own=4)
    percept = percept_of(seed + 1, 6, 7)
    percept.situation[:, 4:] = 1.0
    alone = percept._replace(situation=percept.situation[:, :4].copy())
    for kind in (LazyQ, PessimisticLazyQ):
        cooperative, collective = kind(memory, k=min(5, transitions)), kind(memory, k=min(5, transitions), inputs=4)
        assert np.array_equal(cooperative.values, collective.values)
        one = cooperative.decide(percept, cooperative.start(6), np.zeros((0, 6)))[0]
        other = collective.decide(alone, collective.start(6), np.zeros((0, 6)))[0]
        assert all(np.array_equal(*transition) for transition in zip(one, other, strict=True))


@pytest.mark.parametrize("kind", [LazyQ, PessimisticLazyQ])
def test_the_contract_and_the_way_to_other_processes(kind: Any) -> None:
    policy = kind(made_up(1, 100), k=7)
    check_policy(policy)
    copy = pickle.loads(pickle.dumps(policy))
    assert repr(copy) == repr(policy)
    percept = percept_of(2, 9, 7)
    one, other = (one.decide(percept, one.start(9), np.zeros((0, 9)))[0] for one in (policy, copy))
    assert all(np.array_equal(*transition) for transition in zip(one, other, strict=True))


def test_the_search_table_is_made_once_and_holds_what_is_compared() -> None:
    memory = made_up(1, 100)
    for inputs in (4, 7):
        policy = LazyQ(memory, inputs=inputs)
        assert policy.table is policy.table
        assert np.array_equal(policy.table[:-1], memory.table[:inputs, policy.search_table.kept])


def test_policies_that_differ_have_different_reprs() -> None:
    memory = made_up(1, 100)
    policies = [
        LazyQ(memory), LazyQ(memory, inputs=4), LazyQ(memory, k=3), LazyQ(memory, discount=0.1), LazyQ(memory, sweeps=1),
        LazyQ(memory, lambda memory: memory.fact("gained")), LazyQ(memory, lambda memory: memory.fact("lost")),
        LazyQ(made_up(2, 100)), PessimisticLazyQ(memory), PessimisticLazyQ(memory, actions=ActionGrid(4)),
    ]  # fmt: skip
    assert len({repr(policy) for policy in policies}) == len(policies)
    assert repr(LazyQ(memory)) == repr(LazyQ(made_up(1, 100)))


def test_what_cannot_be_learned_from_is_refused() -> None:
    memory = made_up(1, 9)
    for kind in (LazyQ, PessimisticLazyQ):
        with pytest.raises(ValueError, match="k=10: the memory has only 9 transitions; use a smaller k, or explore longer"):
            kind(memory, k=10)
        with pytest.raises(ValueError, match="k=1000: must be at most 128; use a smaller k, up to the size of the memory"):
            kind(memory, k=1000)
        with pytest.raises(ValueError, match="is nan for transition 0, and not finite for 9 of 9"):
            kind(memory, lambda memory: np.full(9, np.nan), k=3)
    with pytest.raises(ValueError, match="has 300 actions; at most 256 fit"):
        PessimisticLazyQ(memory, k=3, actions=ActionGrid(100, (0.0, 0.5, 1.0)))
    with pytest.raises(TypeError, match="actions=8: must be an ActionGrid"):
        PessimisticLazyQ(memory, k=3, actions=8)  # type: ignore[arg-type]


def test_rounding_does_not_add_up_to_a_heading_that_is_no_unit_vector() -> None:
    policy = LazyQ(made_up(1, 60), k=3)
    percept = percept_of(1, 20, 7)
    longer = percept._replace(heading=percept.heading * (1 + 1e-6))
    action, _ = policy.decide(longer, policy.start(20), np.zeros((0, 20)))
    assert np.abs(np.linalg.norm(action.heading, axis=1) - 1).max() < 1e-11


def test_percepts_that_do_not_fit_are_refused() -> None:
    policy = LazyQ(made_up(1, 9), k=3)
    percept = percept_of(1, 2, 4)
    with pytest.raises(ValueError, match="situations have 4 components; it compares 7"):
        policy.decide(percept, policy.start(2), np.zeros((0, 2)))
    percept = percept_of(1, 2, 7)
    percept.situation[1, 3] = np.nan
    for reading in (np.nan, np.inf, -2e30):
        percept.situation[1, 3] = reading
        with pytest.raises(
            ValueError, match=r"situation of robot 1 holds NaN or more than 1e\+30; give 1 where nothing"
        ):
            policy.decide(percept, policy.start(2), np.zeros((0, 2)))
