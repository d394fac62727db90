"""Basis behaviours: decisions and values like those of a robot by sentences; the correct policy; bad input."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from naive import collecting as naive

from teamsight.policies import Policy, check_policy
from teamsight.policies.basis import (
    BEHAVIOURS,
    CLEAR_ROWS,
    CORRECT,
    DISPERSION,
    HOMING,
    RESTING,
    WANDERING,
    BasisBehaviours,
    correct_table,
    share_correct,
)
from teamsight.tasks.collecting import PuckCollecting

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

SMALL: dict[str, Any] = {
    "robots": 5, "pucks": 8, "side": 12.0, "home_radius": 2.0, "reach": 0.7, "period": 40, "night": 12,
}  # fmt: skip
POLICIES = [
    BasisBehaviours(),
    BasisBehaviours(scheme="events", exploration=0.3, punishment=2.0),
    BasisBehaviours(scheme="delayed", exploration=0.3, discount=0.97, learning_rate=0.3),
    BasisBehaviours(weights=(0.5, 0.5, 0.0), patience=2, timeout=9, progress=0.3),
    BasisBehaviours(weights=(0.2, 0.0, 0.8), patience=1, exploration=1.0),
    BasisBehaviours(intruders="count", delta=3),
    BasisBehaviours(intruders="ring", delta=3, intruder_range=4.0),
    BasisBehaviours.correct(),
]


class Watched(Policy):
    """A policy in Python that decides as the compiled one and as its slow twins; and compares."""

    channels, columns = BasisBehaviours.channels, BasisBehaviours.columns

    def __init__(self, policy: BasisBehaviours) -> None:
        self.policy, self.draws = policy, policy.draws
        self.taken: set[int] = set()

    def start(self, size: int) -> Any:
        twins = [naive.Robot(self.policy) for _ in range(size)]
        if self.policy.tables is not None:
            for twin in twins:
                for row, values in enumerate(self.policy.tables):
                    rest, crowd = divmod(row, self.policy.codes)
                    twin.values[(bool(rest & 4), bool(rest & 2), bool(rest & 1), crowd)] = values.tolist()
        return self.policy.start(size), twins

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        own, twins = state
        action, own = self.policy.decide(percept, own, noise)
        for i, twin in enumerate(twins):
            where = f"tick {percept.time[0]}, robot {i}"
            behaviour = twin.decide(percept, i, noise[:, i])
            assert own.ints[i, 0, 0] == behaviour, where
            self.taken.add(behaviour)
            angle, sure, distance = naive.course(behaviour, percept, i, self.policy, noise[2:, i])
            assert action.distance[i] == distance, where
            if sure > 1e-6:
                assert action.heading[i] == pytest.approx((math.cos(angle), math.sin(angle)), abs=1e-6), where
            assert self.policy.values(own)[i] == pytest.approx(twin.table(), abs=1e-9), where
        return action, (own, twins)


@pytest.mark.parametrize("policy", POLICIES, ids=str)
def test_it_is_its_slow_twin(policy: BasisBehaviours) -> None:
    watched = Watched(policy)
    PuckCollecting(**SMALL, policy=watched, rng=5).run(200)
    assert watched.taken == set(range(4))


@pytest.mark.parametrize("policy", POLICIES, ids=str)
def test_it_keeps_the_contract(policy: BasisBehaviours) -> None:
    check_policy(policy)


def test_a_table_has_64_values_with_a_bit() -> None:
    assert (BasisBehaviours().rows, len(BEHAVIOURS)) == (16, 4)
    assert BasisBehaviours(intruders="count", delta=3).rows == 8 * 4
    assert BasisBehaviours(intruders="ring", delta=3).rows == 8 * 8
    assert BasisBehaviours().start(3).floats[:, :16].shape == (3, 16, 4)


def test_the_weights_of_the_schemes() -> None:
    weights = {scheme: BasisBehaviours(scheme=scheme).parameters[:4] for scheme in ("none", "delayed", "events", "progress")}
    assert weights == {
        "none": (0.0, 0.0, 0.0, 0.0), "delayed": (1.0, 0.0, 0.0, 0.0), "events": (0.0, 1.0, 0.0, 0.0),
        "progress": (0.0, 0.5, 0.25, 0.25),
    }  # fmt: skip
    # Sums are not discounted; only Q-learning is.
    assert [BasisBehaviours(scheme=one).parameters[7] for one in ("delayed", "events", "progress")] == [0.99, 1.0, 1.0]


def test_the_correct_policy_and_its_clear_rows() -> None:
    puck, home, night, intruder = 8, 4, 2, 1
    assert CORRECT[0] == CORRECT[home] == WANDERING
    assert CORRECT[intruder] == CORRECT[home | intruder] == DISPERSION
    assert {CORRECT[row] for row in (night, puck, puck | night, puck | intruder, night | intruder)} == {HOMING}
    assert CORRECT[home | night] == CORRECT[home | night | intruder] == RESTING
    assert sorted(CLEAR_ROWS) == [0, intruder, night, home | intruder, home | night, puck, puck | night]


def test_rows_count_if_the_correct_behaviour_is_above_all_others() -> None:
    table = correct_table(2)
    assert share_correct(table[None]) == 1.0
    # A tie is not learned.
    assert share_correct(np.zeros((3, 16, 4))) == 0.0
    wrong = table.copy()
    wrong[0] = wrong[0, ::-1]
    assert share_correct(np.stack([table, wrong])) == pytest.approx(1.0 - 0.5 / len(CLEAR_ROWS))
    assert share_correct(np.stack([table, wrong]), (0,)) == 0.5
    # With a count, a row with an intruder stands for several.
    many = correct_table(4)
    many[2] = 0.0
    assert share_correct(many[None], (1,)) == pytest.approx(2 / 3)


def test_a_frozen_policy_learns_nothing() -> None:
    policy = BasisBehaviours()
    world = PuckCollecting(**SMALL, policy=policy, rng=1)
    world.run(500)
    tables = policy.values(world.robots.policy_state)
    assert tables.any()
    frozen = policy.frozen(tables)
    other = PuckCollecting(**SMALL, policy=frozen, rng=2)
    other.run(300)
    assert np.array_equal(frozen.values(other.robots.policy_state), tables)


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"weights": (0.5, 0.5, 0.5)}, r"weights=.*have the sum 1\.5; must be 1"),
    ({"weights": (0.5, 0.5)}, r"weights=.*must be a tuple of u, v and w"),
    ({"weights": (1.0, 0.0, 0.0), "scheme": "events"}, r"weights: belong to scheme='progress'.*leave them out"),
    ({"delta": 2}, r"delta=2: must be .*1"),
    ({"intruders": "ring", "delta": 9}, r"delta=9: must be .*8"),
    ({"tables": np.zeros((8, 4))}, r"tables: have the shape \(8, 4\); must be \(robots, 16, 4\)"),
    ({"tables": np.full((16, 4), np.inf)}, r"tables: have values that are not finite; all must be"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "message"), WRONG, ids=str)
def test_bad_options_are_named(options: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        BasisBehaviours(**options)


def test_tables_of_another_team_are_refused() -> None:
    policy = replace(BasisBehaviours(), tables=np.zeros((3, 16, 4)))
    with pytest.raises(ValueError, match=r"tables: are of 3 robots, and the group has 5"):
        PuckCollecting(**SMALL, policy=policy)
