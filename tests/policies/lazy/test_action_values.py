"""What transitions are worth: on a memory where the answer is known, against the slow twin, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import learners as naive_learners

from teamsight.policies.lazy.learner import action_values, next_matches
from teamsight.policies.memory import LazyMemory

pytestmark = pytest.mark.short


def chain(length: int) -> LazyMemory:
    """A corridor: from each place to the next, and from the last, where the reward is, to itself."""
    place = np.arange(length) / length
    after = np.append(place[1:], place[-1])
    won = np.arange(length) == length - 1
    return LazyMemory.of(place[:, None], np.zeros((length, 2)), after[:, None], {"won": won}, own=1)


def won(memory: LazyMemory) -> Any:
    return memory.fact("won")


def made_up(seed: int, transitions: int, own: int = 3, added: int = 2, levels: int = 3) -> LazyMemory:
    """Return transitions of coarse readings, of which many are equally near."""
    rng = np.random.default_rng(seed)
    before, after = rng.integers(0, levels + 1, (2, transitions, own + added)) / levels
    action = np.stack([rng.uniform(-np.pi, np.pi, transitions), rng.random(transitions)], axis=1)
    facts = {name: rng.integers(0, 3, transitions) for name in ("gained", "lost", "won")}
    return LazyMemory.of(before, action, after, facts, own=own)


@pytest.mark.parametrize("sweeps", range(7))
def test_a_reward_reaches_back_one_pair_a_sweep(sweeps: int) -> None:
    found = action_values(chain(5), won, k=1, discount=0.5, sweeps=sweeps)
    # The last leads to itself: 1 + 1/2 + 1/4 + … after so many sweeps; those before have it halved for each step.
    for steps_before, value in enumerate(found[::-1]):
        later = sweeps - steps_before
        assert value == (0.5**steps_before * (2 - 0.5**later) if later >= 0 else 0)


@given(
    seed=st.integers(0, 2**32 - 1), transitions=st.integers(1, 40), k=st.integers(1, 8), discount=st.floats(0, 1),
    sweeps=st.integers(0, 4), cooperative=st.booleans(),
)  # fmt: skip
def test_as_the_slow_twin(seed: int, transitions: int, k: int, discount: float, sweeps: int, cooperative: bool) -> None:
    memory, k = made_up(seed, transitions), min(k, transitions)
    inputs = memory.inputs if cooperative else memory.own
    found = action_values(memory, won, inputs=inputs, k=k, discount=discount, sweeps=sweeps)
    expected = naive_learners.action_values(memory, won(memory).tolist(), inputs, k, discount, sweeps)
    assert found.tolist() == expected


def test_nothing_is_stored_in_the_memory_and_rewards_share_the_search() -> None:
    memory = made_up(1, 50)
    before, digest = memory.table.copy(), memory.digest
    one = action_values(memory, won, k=5)
    assert next_matches(memory, 5) is not next_matches(memory, 5)
    assert np.shares_memory(next_matches(memory, 5), next_matches(memory, 3))
    other = action_values(memory, lambda memory: -memory.fact("won"), k=5)
    assert not np.array_equal(one, other)
    assert np.array_equal(memory.table, before)
    assert memory.digest == digest


def test_a_search_for_fewer_does_not_answer_for_more() -> None:
    memory = made_up(3, 50)
    action_values(memory, won, k=2)
    expected = naive_learners.action_values(memory, won(memory).tolist(), memory.inputs, 9, 0.7, 10)
    assert action_values(memory, won, k=9).tolist() == expected


def test_the_search_reports_its_progress() -> None:
    calls: list[tuple[int, int]] = []
    next_matches(made_up(2, 5000), 2, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(4096, 5000), (5000, 5000)]


def test_without_a_future_nothing_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    memory = made_up(3, 9)
    monkeypatch.setattr(LazyMemory, "nearest", None)
    assert np.array_equal(action_values(memory, won, discount=0, k=9), won(memory))
    assert np.array_equal(action_values(memory, won, sweeps=0, k=9), won(memory))


@pytest.mark.parametrize(
    ("memory", "wrong", "message"),
    [
        (made_up(4, 9), {"k": 10}, r"k=10: the memory has only 9 transitions; use a smaller k, or explore longer"),
        (made_up(4, 9), {"k": 0}, r"k=0: must be at least 1"),
        (made_up(4, 9), {"k": 129}, r"k=129: must be at most 128"),
        (made_up(4, 9), {"k": 2.5}, r"k=2.5: must be a whole number"),
        (made_up(4, 9), {"discount": 1.1}, r"discount=1.1: .*at most 1"),
        (made_up(4, 9), {"discount": np.nan}, r"discount=nan"),
        (made_up(4, 9), {"sweeps": -1}, r"sweeps=-1: must be at least 0"),
        (made_up(4, 9), {"inputs": 4}, r"inputs=4: .*use 3 \(collective\) or all 5 \(cooperative\)"),
        ("memory.safetensors", {}, r"must be a LazyMemory; load one with LazyMemory.load\(path\)"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(memory: Any, wrong: dict[str, Any], message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        action_values(memory, won, **{"k": 3} | wrong)
