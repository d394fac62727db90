"""Rewards: the paper's rule on hand-made facts, one's own in five lines, and what is no reward."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from naive import learners as naive_learners

from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import GainReward, alone_reward, own_reward, rewards_of, tabulate, team_reward

pytestmark = pytest.mark.short

GAINED, LOST = [0, 0, 1, 1, 2, 1], [0, 1, 0, 1, 1, 3]


def memory_of(**facts: Any) -> LazyMemory:
    """Return transitions that stand in the order in which their facts are given."""
    transitions = len(next(iter(facts.values())))
    situation = np.arange(transitions)[:, None] / transitions
    return LazyMemory.of(situation, np.zeros((transitions, 2)), situation, facts, own=1)


@pytest.mark.parametrize("scope", ["own", "team", "alone"])
@pytest.mark.parametrize("both", ["gain", "loss", "none", "net"])
def test_plus_one_minus_one_and_the_rule_for_both(scope: str, both: str) -> None:
    prefix = "" if scope == "own" else f"{scope}_"
    noise = {f"{other}{name}": [9] * 6 for other in ("", "team_", "alone_") for name in ("gained", "lost")}
    memory = memory_of(**noise | {f"{prefix}gained": GAINED, f"{prefix}lost": LOST})
    expected = [naive_learners.gain_reward(gained, lost, both) for gained, lost in zip(GAINED, LOST, strict=True)]
    assert GainReward(scope, both)(memory).tolist() == expected


def test_the_named_ones() -> None:
    assert (own_reward, team_reward, alone_reward) == tuple(GainReward(scope) for scope in ("own", "team", "alone"))
    assert repr(own_reward) == "GainReward(scope='own', both='gain')"


def test_ones_own() -> None:
    def crowd(memory: LazyMemory) -> Any:
        """A point for each target in sight."""
        return memory.fact("sensed")

    assert rewards_of(memory_of(sensed=[2, 0, 5]), crowd).tolist() == [2, 0, 5]


@pytest.mark.parametrize(
    ("reward", "message"),
    [
        (lambda memory: [0, np.nan, np.inf], r"reward <lambda>: is nan for transition 1, and not finite for 2 of 3"),
        (lambda memory: [1, 2], r"returned the shape \(2,\); for 3 transitions it must be \(3,\)"),
        (lambda memory: 1.0, r"returned the shape \(\)"),
        (lambda memory: np.zeros((3, 1)), r"returned the shape \(3, 1\)"),
        (lambda memory: None, r"reward <lambda>: returned None; return one number"),
        (lambda memory: ["a", "b", "c"], r"returned list; it must return one number for each transition"),
        (lambda memory: np.full(3, 1j), r"returned ndarray; it must return one number for each transition"),
        (GainReward, r"is a class; give an object, GainReward\(\)"),
        (GainReward("team"), r"fact='team_gained': unknown"),
        ("own", r"reward='own': must be a callable"),
    ],
)
def test_what_is_no_reward_is_named(reward: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        rewards_of(memory_of(gained=[0, 1, 0], lost=[0, 0, 1]), reward)


def test_a_memory_without_facts_says_so() -> None:
    with pytest.raises(ValueError, match=r"fact='gained': the memory has no facts; explore"):
        rewards_of(LazyMemory.of([[1.0]], [[0.0, 0.0]], [[1.0]], {}, own=1), own_reward)


@pytest.mark.parametrize("both", ["gain", "loss", "none", "net"])
def test_a_table_of_gained_and_lost(both: str) -> None:
    table = tabulate(GainReward(both=both), 3)
    assert table.tolist() == [[naive_learners.gain_reward(g, lost, both) for lost in range(4)] for g in range(4)]
    difference = tabulate(lambda memory: memory.fact("gained") - 2 * memory.fact("lost"), 4)
    assert difference[3, 1] == 1


def test_a_robot_on_the_way_does_not_know_of_its_team() -> None:
    with pytest.raises(ValueError, match=r"reward GainReward.*must depend only on the facts gained and lost"):
        tabulate(team_reward, 3)
