"""Modular Q-learning: its slow twin, and with one module plain Q-learning, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from naive import online as naive

from teamsight.agents.awareness import NearestAwareness
from teamsight.policies import Policy, PreyQ, check_policy
from teamsight.policies.interface import PolicyState
from teamsight.policies.online.modular_q import ModularQ
from teamsight.policies.percept_of_one import percept_of_one
from teamsight.tasks.pursuit import Pursuit

WORLD: dict[str, Any] = {"side": 5, "depth": 1, "rule": "pair", "awareness": "pairwise"}


class Watched(Policy):
    """A policy in Python that decides as the compiled one and as its slow twin; and compares."""

    def __init__(self, policy: ModularQ) -> None:
        self.policy, self.draws = policy, policy.draws

    def start(self, size: int) -> Any:
        return self.policy.start(size), naive.ModularTeam(self.policy, size)

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        own, twin = state
        action, own = self.policy.decide(percept, own, noise)
        expected = twin.decide([percept_of_one(percept, i) for i in range(len(percept.heading))], noise)
        for i, (heading, distance) in enumerate(expected):
            assert tuple(action.heading[i].tolist()) == heading, f"tick {percept.time[0]}, robot {i}"
            assert action.distance[i] == distance
        return action, (own, twin)


@pytest.mark.parametrize(
    "policy",
    [
        ModularQ(1), ModularQ(1, modules=2, moves=4, values_ends=True, temperature=0.4), ModularQ(1, temperature=0.0),
        ModularQ(1, by="distance", learning_rate=0.8), ModularQ(1, monolithic=True), ModularQ(1, 2, "distance", True),
    ],
    ids=str,
)  # fmt: skip
def test_it_is_its_slow_twin(policy: ModularQ) -> None:
    world = Pursuit(5, 2, **WORLD, policy=Watched(policy), rng=5)
    with pytest.warns(UserWarning, match="one by one"):
        world.run(300)
    assert (world.recording.history["captures"] > 0).sum() > 5


@pytest.mark.parametrize(
    "how", [{}, {"by": "distance"}, {"monolithic": True}, {"monolithic": True, "by": "distance"}], ids=str
)
@pytest.mark.parametrize("values_ends", [False, True])
def test_with_one_module_it_is_plain_q_learning_bit_for_bit(how: dict[str, Any], values_ends: bool) -> None:
    common: dict[str, Any] = {"moves": 5, "values_ends": values_ends, "learning_rate": 0.8, "temperature": 0.4}
    modular, plain = (
        Pursuit(2, 2, **WORLD, policy=policy, rng=9)
        for policy in (ModularQ(1, modules=1, **how, **common), PreyQ(1, partner=1, **common))
    )
    for world in (modular, plain):
        world.run(5000)
    tables = modular.hunters.policy_state.floats[:, :-1]
    assert np.array_equal(tables, plain.hunters.policy_state.floats)
    assert np.array_equal(modular.hunters.position, plain.hunters.position)
    assert tables.any()


@pytest.mark.parametrize("how", [{}, {"by": "distance"}, {"monolithic": True}], ids=str)
def test_both_paths_learn_the_same(how: dict[str, Any]) -> None:
    compiled, stepped = (Pursuit(4, 1, **WORLD, policy=ModularQ(1, **how), rng=3) for _ in range(2))
    compiled.run(300)
    for _ in range(150):
        stepped.step()
    stepped.run(150)
    for one, other in zip(compiled.hunters.policy_state, stepped.hunters.policy_state, strict=True):
        assert np.array_equal(one, other)


def test_a_frozen_team_keeps_its_tables_and_its_partners() -> None:
    world = Pursuit(4, 1, **WORLD, policy=ModularQ(1), rng=3)
    world.run(1000)
    state = world.hunters.policy_state
    partners, tables = state.ints[:, :-1, 1].copy(), state.floats[:, :-1].copy()
    assert sorted(partners[0]) == sorted(world.hunters.bodies.identity[1:])
    world.hunters.policy = world.hunters.policy.frozen(state)
    world.run(200)
    assert np.array_equal(world.hunters.policy_state.floats[:, :-1], tables)
    assert np.array_equal(world.hunters.policy_state.ints[:, :-1, 1], partners)


def test_its_tables_grow_with_the_number_of_partners() -> None:
    # Touzet §9: Θ(N). One table of all would have 50^4 rows.
    assert [ModularQ(3, modules=n).entries for n in (1, 2, 3)] == [2500 * 5, 5000 * 5, 7500 * 5]


def test_one_table_over_all_grows_as_a_power() -> None:
    # Touzet's p^d: 26 places of the prey and of each partner at depth 2, 50 at depth 3.
    whole = {depth: ModularQ(depth, monolithic=True) for depth in (2, 3)}
    assert {depth: policy.rows for depth, policy in whole.items()} == {2: 456_976, 3: 6_250_000}
    assert whole[2].start(2).floats.shape == (2, 456_977, 5)
    with pytest.raises(ValueError, match=r"depth=4, modules=3.*226,060,880 values.*at most 50,000,000.*100,860"):
        ModularQ(4, monolithic=True)


@pytest.mark.parametrize(
    ("policy", "degree", "cure"),
    [
        (ModularQ(1), "nearest", "awareness='pairwise'"),
        (ModularQ(1), "ring", "awareness='pairwise'"),
        (ModularQ(1), "none", "awareness='pairwise'"),
        (ModularQ(1, by="distance"), "none", "awareness='ring'"),
    ],
)
def test_a_degree_that_does_not_show_partners_is_refused(policy: ModularQ, degree: str, cure: str) -> None:
    with pytest.raises(ValueError, match=f"policy=ModularQ.*needs.*awareness {degree!r} does not deliver; use {cure}"):
        Pursuit(4, 1, **{**WORLD, "awareness": degree}, policy=policy, rng=1)


def test_by_distance_partners_need_no_identity() -> None:
    world = Pursuit(4, 1, **{**WORLD, "awareness": NearestAwareness(3)}, policy=ModularQ(1, by="distance"), rng=1)
    world.run(3000)
    others = np.arange(100) % 10 != 9
    modules = world.hunters.policy_state.floats[:, :-1].reshape(4, 3, 100, 5)
    assert (modules[:, :, others] != 0).any(axis=(0, 2, 3)).all(), "a module has never seen a partner"


def test_a_frozen_team_begins_again_without_one_that_has_left() -> None:
    world = Pursuit(4, 1, **WORLD, policy=ModularQ(1), rng=3)
    world.run(1000)
    world.hunters.policy = world.hunters.policy.frozen(world.hunters.policy_state)
    tables, partners = (part.copy() for part in world.hunters.policy_state)
    world.hunters[1].remove()
    world.run(10)
    world.reset()
    left = [0, 2, 3]
    assert np.array_equal(world.hunters.policy_state.floats[:, :-1], tables[left, :-1])
    assert np.array_equal(world.hunters.policy_state.ints[:, :-1, 1], partners[left, :-1, 1])
    world.run(10)


@pytest.mark.parametrize("how", [{}, {"by": "distance"}, {"monolithic": True}], ids=str)
def test_contract(how: dict[str, Any]) -> None:
    check_policy(ModularQ(1, modules=2, **how))


def _state(floats: Any = None, ints: Any = None) -> PolicyState:
    """Return a state of four robots, whose ints or floats may be others."""
    fine = ModularQ(1).start(4)
    return PolicyState(fine.floats if floats is None else floats, fine.ints if ints is None else ints)


def _ints(place: int, value: int) -> Any:
    ints = ModularQ(1).start(4).ints
    ints[0, place, 0] = value
    return ints


@pytest.mark.parametrize(
    ("first", "message"),
    [
        (np.zeros((4, 301, 5)), r"first=.*must be a PolicyState, such as world\.hunters\.policy_state"),
        (_state(floats=np.zeros((4, 300, 5))), r"floats have the shape \(4, 300, 5\); must be \(robots, 301, 5\); freeze"),
        (_state(floats=np.full((4, 301, 5), np.nan)), "its floats finite; freeze"),
        (_state(ints=np.full((4, 1, 2), -1)), r"ints have the shape \(4, 1, 2\); must be \(robots, 4, 2\); freeze"),
        (_state(ints=np.full((3, 4, 2), -1)), r"ints have the shape \(3, 4, 2\); must be \(robots, 4, 2\); freeze"),
        (_state(ints=np.full((4, 4, 2), -1.0)), "its ints must be whole numbers"),
        (_state(ints=_ints(0, 300)), "rows of tables below 300 and actions below 5 only; freeze"),
        (_state(ints=_ints(3, 5)), "rows of tables below 300 and actions below 5 only; freeze"),
        (_state(ints=_ints(3, -2)), "rows of tables below 300 and actions below 5 only; freeze"),
    ],
)
def test_a_first_state_that_is_none_is_refused(first: Any, message: str) -> None:
    with pytest.raises((TypeError, ValueError), match=message):
        ModularQ(1, first=first)


def test_a_first_state_is_that_of_its_team_and_stays_as_it_was() -> None:
    state = _state()
    policy = ModularQ(1, first=state)
    state.floats[:], state.ints[:] = 1.0, 7
    assert not policy.start(4).floats.any()
    assert (policy.start(4).ints == -1).all()
    assert policy.first is not None
    for part in policy.first:
        assert not part.flags.writeable
    with pytest.raises(ValueError, match="first: is the state of 4 robots, and the group has 3; freeze"):
        policy.start(3)
