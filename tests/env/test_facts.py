"""The facts of a step, compared with their slow twin, and the rewards that are computed from them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from naive import environments as naive

from teamsight import CMOMMT, Disc, Failures, Robot, Target, World
from teamsight.env import REWARDS, Facts, parallel_env, vector_env
from teamsight.policies.rewards import GainReward, keep_reward

CROWD: dict[str, Any] = {"robots": 12, "targets": 30, "radius": 2.5}
OF_TARGETS = ("sensed", "gained", "lost", "alone", "alone_gained", "alone_lost", "team_sensed", "team_gained", "team_lost")


class Watched:
    """A reward that keeps copies of the facts."""

    def __init__(self) -> None:
        self.seen: list[dict[str, np.ndarray]] = []

    def __call__(self, facts: Facts) -> np.ndarray:
        names = (*OF_TARGETS, "share", "neighbours", "travelled", "active", "observed", "targets")
        self.seen.append({name: facts.fact(name).copy() for name in names})
        return facts.sensed


def sets(world: World) -> list[set[int]]:
    robots, targets = world.groups[:2]
    return naive.sensed(robots.bodies.position, targets.bodies.position, robots.bodies.sensing_range)


@pytest.mark.parametrize("observation", ["ring", "shared"])
def test_facts_are_those_of_the_slow_twin(observation: str) -> None:
    watched, rng = Watched(), np.random.default_rng(1)
    env = parallel_env(**CROWD, observation=observation, reward=watched)
    env.reset(seed=1)
    twin = CMOMMT(**CROWD, policy="stationary", seed=1)
    twin.close()
    before = sets(env.world)
    for _ in range(25):
        _, rewards, *_ = env.step(dict(zip(env.agents, rng.uniform(-1, 1, (12, 2)), strict=True)))
        after, facts = sets(env.world), watched.seen[-1]
        expected = naive.facts(before, after)
        for name in OF_TARGETS:
            assert facts[name][0].tolist() == expected[name], name
        assert facts["share"][0] == pytest.approx(expected["share"])
        assert facts["neighbours"][0].tolist() == [len(robot.neighbours) for robot in env.world.robots]
        assert list(rewards.values()) == expected["sensed"]
        assert facts["observed"] == len(set().union(*after))
        # The difference reward: what the team observes, less what it would observe without the robot.
        without = [len(set().union(*after[:i], *after[i + 1 :])) for i in range(12)]
        assert facts["alone"][0].tolist() == [facts["observed"] - rest for rest in without]
        moved = env.world.robots.bodies.moved
        assert facts["travelled"][0] == pytest.approx(np.hypot(*moved.T) / 0.1, abs=1e-12)
        before = after


def test_facts_of_robots_that_fail() -> None:
    watched, rng = Watched(), np.random.default_rng(1)
    env = parallel_env(**CROWD, events=Failures(20, 20), reward=watched)
    env.reset(seed=1)
    inactive = 0
    for _ in range(60):
        env.step(dict(zip(env.agents, rng.uniform(-1, 1, (12, 2)), strict=True)))
        facts = watched.seen[-1]
        failed = facts["active"][0] == 0
        inactive += failed.sum()
        assert not facts["sensed"][0][failed].any()
        assert not facts["neighbours"][0][failed].any()
        assert not facts["travelled"][0][failed].any()
        assert (facts["targets"] == 30).all()
    assert inactive > 100


@pytest.mark.parametrize("scope", ["own", "team", "alone"])
def test_the_rewards_of_learners_are_rewards_here(scope: str) -> None:
    name = {"own": "gain", "team": "team-gain", "alone": "alone-gain"}[scope]
    by_name = vector_env(3, **CROWD, reward=name)
    by_object = vector_env(3, **CROWD, reward=GainReward(scope))
    rng, total = np.random.default_rng(2), 0.0
    for env in (by_name, by_object):
        env.reset(seed=1)
    for _ in range(30):
        given = rng.uniform(-1, 1, (3, 12, 2))
        one, other = by_name.step(given), by_object.step(given)
        assert np.array_equal(one.rewards, other.rewards)
        total += np.abs(one.rewards).sum()
    assert total > 50
    lost = vector_env(2, **CROWD, reward=keep_reward)
    lost.reset(seed=1)
    assert (lost.step(given[:2]).rewards <= 0).all()


def test_rewards_by_name_are_shares_that_add_up() -> None:
    rewards = {name: vector_env(2, **CROWD, reward=name) for name in REWARDS}
    mixed = vector_env(2, **CROWD, reward={"observed": 2.0, "neighbours": -0.5})
    rng = np.random.default_rng(3)
    for env in (*rewards.values(), mixed):
        env.reset(seed=4)
    for _ in range(10):
        given = rng.uniform(-1, 1, (2, 12, 2))
        made = {name: env.step(given).rewards for name, env in rewards.items()}
        step = mixed.step(given)
        assert made["observed"] == pytest.approx(np.repeat(step.info["observed"][:, None], 12, axis=1))
        assert made["share"].sum(axis=1) == pytest.approx(step.info["observed"])
        assert (made["alone"] <= made["share"] + 1e-15).all()
        assert (made["share"] <= made["sensed"] + 1e-15).all()
        assert step.rewards == pytest.approx(2 * made["observed"] - 0.5 * made["neighbours"])
        for name in ("observed", "share", "sensed", "alone", "neighbours", "travelled"):
            assert ((made[name] >= 0) & (made[name] <= 1)).all(), name


def two_groups(rng: int | None = None, scouts: int = 6) -> World:
    world = World(Disc(1.0), rng=rng)
    targets = world.add(Target, 2, policy="random-walk")
    for name, size in (("robots", 3), ("scouts", scouts)):
        world.senses(world.add(Robot, size, policy="random-walk", awareness_range=9.0, name=name), targets)
    return world


def test_teammates_of_another_group_are_a_part_of_all_teammates() -> None:
    env = vector_env(2, model=two_groups, observation=None, reward="neighbours")
    env.reset(seed=1)
    made = env.step(np.zeros((2, 3, 2)))
    assert (made.info["neighbours"] == 8).all()
    assert (made.rewards == 1.0).all()


def test_facts_cannot_be_written() -> None:
    def spoil(facts: Facts) -> np.ndarray:
        facts.sensed[:] = 0
        return facts.sensed

    env = parallel_env(reward=spoil)
    env.reset(seed=1)
    with pytest.raises(ValueError, match="read-only"):
        env.step({agent: np.zeros(2) for agent in env.agents})


@pytest.mark.parametrize(
    ("reward", "error", "message"),
    [
        ("observd", ValueError, "reward='observd'.*'observed'"),
        ({}, ValueError, "must have a term.*'observed'"),
        ({"observed": np.nan}, ValueError, r"reward\['observed'\]=nan: must be a finite number"),
        ({"neighbors": 1.0}, ValueError, "'neighbours'"),
        (3, TypeError, "reward=3: must be a name .*function"),
        (GainReward, TypeError, r"is a class; give an object, GainReward\(\)"),
    ],
)
def test_rewards_that_are_none_are_refused(reward: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        parallel_env(reward=reward)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "returned None; it must be .1, 10."),
        (np.zeros(10), r"returned the shape \(10,\); it must be \(1, 10\), as facts.sensed is"),
        (np.full((1, 10), np.inf), "is inf for robot 0 of world 0; return a finite number, 0 for none"),
        (1j * np.ones((1, 10)), "returned ndarray; it must return one number for each robot"),
        ("much", "returned str; it must return one number for each robot"),
    ],
)
def test_answers_of_rewards_are_checked(answer: Any, message: str) -> None:
    env = parallel_env(reward=lambda facts: answer)
    env.reset(seed=1)
    with pytest.raises((TypeError, ValueError), match=message):
        env.step({agent: np.zeros(2) for agent in env.agents})
