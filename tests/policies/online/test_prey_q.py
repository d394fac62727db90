"""Online Q-learning decides, learns and averages like its slow twin, bit for bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from naive import online as naive

from teamsight.policies import BoundedPreyQ, BoundedWalk, LatticeWalk, Policy, PreyQ, check_policy
from teamsight.policies.percept_of_one import percept_of_one
from teamsight.tasks.pursuit import Pursuit


class Watched(Policy):
    """A policy in Python that decides as the compiled one and as its slow twin; and compares."""

    def __init__(self, policy: PreyQ) -> None:
        self.policy, self.draws, self.columns = policy, policy.draws, policy.columns
        self.decisions = self.ends = 0

    def start(self, size: int) -> Any:
        return self.policy.start(size), naive.QTeam(self.policy, size, naive.prey_row)

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        own, twin = state
        action, own = self.policy.decide(percept, own, noise)
        expected = twin.decide([percept_of_one(percept, i) for i in range(len(percept.heading))], noise)
        for i, (heading, distance) in enumerate(expected):
            assert tuple(action.heading[i].tolist()) == heading, f"tick {percept.time[0]}, robot {i}"
            assert action.distance[i] == distance
        assert np.array_equal(own.floats, twin.tables)
        self.decisions += len(expected)
        self.ends += int(percept.ended.sum())
        return action, (own, twin)


SMALL: dict[str, Any] = {"hunters": 2, "prey": 1, "side": 5, "depth": 2}
WORLDS: list[tuple[PreyQ, dict[str, Any]]] = [
    (PreyQ(2), SMALL),
    (PreyQ(2, values_ends=True), {**SMALL, "prey": 2}),
    (PreyQ(1, moves=5, temperature=0.0, learning_rate=0.3), {**SMALL, "side": 6, "torus": True}),
    (PreyQ(1, partner=1), {**SMALL, "hunters": 3, "rule": "pair", "awareness": "pairwise"}),
    (PreyQ(1, reach=4), {**SMALL, "depth": 1, "prey": 2, "awareness": "shared", "teammate_depth": 4}),
    (PreyQ(1, average_every=7), SMALL),
    (PreyQ(1, one_table=True, discount=0.5), {**SMALL, "hunters": 3}),
    (BoundedPreyQ(2, side=5), {**SMALL, "order": "in turn", "prey_policy": BoundedWalk(side=5)}),
    (BoundedPreyQ(1, side=4, moves=5, temperature=0.0), {**SMALL, "side": 4, "depth": 1, "rule": "pair", "order": "in turn"}),
]


@pytest.mark.parametrize(("policy", "world"), WORLDS, ids=str)
def test_it_is_its_slow_twin(policy: PreyQ, world: dict[str, Any]) -> None:
    watched = Watched(policy)
    Pursuit(**world, policy=watched, rng=5).run(300)
    assert watched.decisions == 300 * world["hunters"]
    assert watched.ends > 0


@pytest.mark.parametrize(("policy", "world"), WORLDS, ids=str)
def test_both_paths_learn_the_same(policy: PreyQ, world: dict[str, Any]) -> None:
    compiled, stepped = (Pursuit(**world, policy=policy, rng=3) for _ in range(2))
    compiled.run(200)
    assert compiled.path == "compiled"
    for steps in (1, 40, 1, 58):
        for _ in range(steps):
            stepped.step()
        stepped.run(25)
    assert stepped.tick == 200
    assert np.array_equal(compiled.hunters.policy_state.floats, stepped.hunters.policy_state.floats)
    assert compiled.hunters.policy_state.floats.any()
    assert compiled.recording.history.equals(stepped.recording.history)


def test_frozen_tables_stay_as_they_are_and_choose_the_best() -> None:
    policy = PreyQ(2)
    world = Pursuit(side=5, depth=2, policy=policy, rng=1)
    world.run(2000)
    learned = world.hunters.policy_state.floats.copy()
    world.hunters.policy = frozen = policy.frozen(learned)
    world.run(500)
    assert np.array_equal(world.hunters.policy_state.floats, learned)
    assert (frozen.learning_rate, frozen.temperature) == (0.0, 0.0)
    world.hunters.policy = soft = policy.frozen(learned, policy.temperature)
    world.run(500)
    assert np.array_equal(world.hunters.policy_state.floats, learned)
    assert (soft.learning_rate, soft.temperature) == (0.0, 0.4)


def test_frozen_hunters_choose_as_in_training_if_wished() -> None:
    """One row of known values: greedy hunters make the best move always, soft ones with the shares of exp(Q / T)."""
    values = np.array([0.0, 0.4, -0.4, 0.1])
    policy = PreyQ(1, temperature=0.4)
    tables = np.tile(values, (policy.rows, 1))
    shares = np.exp(values / 0.4) / np.exp(values / 0.4).sum()
    for temperature, expected in ((0.0, [0.0, 1.0, 0.0, 0.0]), (0.4, shares)):
        # On a torus, so that no move is lost.
        world = Pursuit(1, 1, 50, depth=1, torus=True, policy=policy.frozen(tables, temperature), rng=4)
        made = np.zeros(4)
        for _ in range(2000):
            world.step()
            if world.recording.history["trial_steps"].iloc[-1] > 0:
                made[int(np.argmax(world.hunters.bodies.moved[0] @ np.array([[0, 1, 0, -1], [1, 0, -1, 0]])))] += 1
        # Five standard errors of a binomial share.
        assert np.all(np.abs(made / made.sum() - expected) <= 5 * np.sqrt(shares * (1 - shares) / made.sum()))


def test_averaging_makes_all_tables_equal() -> None:
    world = Pursuit(hunters=3, side=5, depth=1, policy=PreyQ(1, average_every=10), rng=2)
    world.run(10)
    tables = world.hunters.policy_state.floats
    assert not np.array_equal(tables[0], tables[1])
    mean = tables.mean(axis=0)
    world.hunters.policy = PreyQ(1, average_every=10, learning_rate=0.0, tables=tables)
    world.run(1)
    assert np.allclose(world.hunters.policy_state.floats, mean, rtol=1e-15)


def test_one_table_learns_from_all() -> None:
    world = Pursuit(hunters=3, side=5, depth=1, policy=PreyQ(1, one_table=True), rng=2)
    world.run(200)
    tables = world.hunters.policy_state.floats
    assert np.array_equal(tables[0], tables[1])
    assert np.array_equal(tables[0], tables[2])


def test_a_robot_that_joins_uses_the_one_table() -> None:
    world = Pursuit(hunters=2, side=5, depth=1, policy=PreyQ(1, one_table=True), rng=2)
    world.run(500)
    learned = world.hunters.policy_state.floats[0].copy()
    world.hunters.add(1)
    world.run(1)
    tables = world.hunters.policy_state.floats
    assert learned.any()
    # One step corrects one value of each robot that has decided before.
    assert ((tables[2] != learned).sum()) <= 2
    world.run(100)
    assert (tables == tables[:1]).all()


def test_a_frozen_table_of_all_is_one_table() -> None:
    world = Pursuit(hunters=2, side=5, depth=1, policy=PreyQ(1, one_table=True), rng=2)
    world.run(500)
    world.hunters.policy = world.hunters.policy.frozen(world.hunters.policy_state.floats)
    tables = world.hunters.policy_state.floats[0].copy()
    world.hunters.add(1)
    world.run(10)
    assert np.array_equal(world.hunters.policy_state.floats[2], tables)
    with pytest.raises(ValueError, match=r"tables: those of 2 robots differ, and one_table=True; give one table"):
        PreyQ(1, one_table=True, tables=np.arange(80.0).reshape(2, 10, 4))


def test_frozen_hunters_keep_their_own_tables_when_one_has_left() -> None:
    world = Pursuit(hunters=3, side=5, depth=1, policy=PreyQ(1), rng=2)
    world.run(500)
    tables = world.hunters.policy_state.floats.copy()
    world.hunters.policy = world.hunters.policy.frozen(tables)
    world.hunters[0].remove()
    world.run(10)
    state = world.state()
    world.reset()
    assert np.array_equal(world.hunters.policy_state.floats, tables[1:])
    world.run(10)
    world.restore(state)
    world.run(10)
    # There is no table for a fourth.
    with pytest.raises(ValueError, match="of 3 robots, and the group has 4; give one table for all"):
        world.hunters.add(1)


@pytest.mark.parametrize("how", [{"average_every": 10}, {"one_table": True}], ids=str)
def test_robots_that_share_tables_must_decide_together(how: dict[str, Any]) -> None:
    world = Pursuit(hunters=3, side=5, depth=1, policy=PreyQ(1, **how), rng=2)
    world.run(10)
    world.hunters.cycle = 5
    with pytest.raises(ValueError, match=r"PreyQ.*needs the state of all robots .*'hunters'.*leave out cycles"):
        world.run(10)
    alone = Pursuit(hunters=3, side=5, depth=1, policy=PreyQ(1), rng=2)
    alone.hunters.cycle = 5
    alone.run(10)


def test_rows_of_tan() -> None:
    assert PreyQ(2).rows == 26
    assert PreyQ(2, reach=10).rows == 442
    assert PreyQ(4, partner=4).rows == 6724
    assert PreyQ(4).entries == 82 * 4


@pytest.mark.parametrize(
    "policy",
    [
        PreyQ(1), PreyQ(1, partner=2, average_every=3), BoundedPreyQ(1, side=4), LatticeWalk(), LatticeWalk(5),
        BoundedWalk(5, side=4),
    ],
    ids=str,
)  # fmt: skip
def test_contract(policy: Policy) -> None:
    check_policy(policy)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"depth": 4, "reach": 3}, "reach=3"), ({"tables": np.zeros((3, 4))}, r"\(3, 4\)"),
        ({"depth": 1, "tables": np.full((10, 4), np.nan)}, "tables: have values that are not finite; all must be"),
    ],
)  # fmt: skip
def test_wrong_values_are_named(given: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        PreyQ(**given)


def test_a_partner_that_no_degree_shows_is_refused() -> None:
    with pytest.raises(ValueError, match="PreyQ.*needs 'teammates', which awareness 'none' does not deliver; use"):
        Pursuit(hunters=2, depth=1, policy=PreyQ(1, partner=1), rng=1)


def test_tables_of_another_team_are_refused() -> None:
    with pytest.raises(ValueError, match="of 3 robots, and the group has 2"):
        Pursuit(hunters=2, depth=1, policy=PreyQ(1, tables=np.zeros((3, 10, 4))), rng=1)
