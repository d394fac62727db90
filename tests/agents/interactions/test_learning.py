"""What interactions give reaches learners: facts of transitions, facts and rewards of environments, recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from interactions import Capture, hunt

from teamsight import CMOMMT, Robot, Target, World
from teamsight.agents.recording.explore import explore
from teamsight.agents.recording.transitions import FACTS
from teamsight.env import Facts, parallel_env, vector_env
from teamsight.policies.rewards import interaction_reward, rewards_of
from teamsight.view.scene import MOST_PART


@pytest.mark.parametrize("steps", [1, 60])
def test_transitions_have_the_rewards(steps: int) -> None:
    world, twin = hunt(awareness="ring"), hunt(awareness="ring")
    for one in (world, twin):
        one.recording.record_transitions(one.groups[0])
    rewards, ended = [], []
    for _ in range(60 // steps):
        world.run(steps)
    for _ in range(60):
        twin.step()
        rewards += twin.groups[0].bodies.reward.tolist()
        ended += twin.groups[0].bodies.ended.tolist()
    facts = world.recording.transitions(world.groups[0]).facts
    assert list(facts) == [*FACTS, "reward", "ended"]
    assert facts["reward"] == pytest.approx(rewards)
    assert facts["ended"].tolist() == ended
    assert any(ended)


def test_an_exploration_keeps_them_as_facts() -> None:
    memory = explore(hunt(awareness="ring"), 50)
    rewards = rewards_of(memory, interaction_reward)
    assert len(rewards) == 300
    assert set(np.round(rewards, 6)) >= {-0.1, 0.9}
    assert (memory.fact("ended") == (rewards > 0)).all()


def test_transitions_before_the_interaction_have_no_reward() -> None:
    world = hunt(awareness="ring")
    other = World(world.arena, rng=1)
    hunters = other.add(Robot, 6, policy="centroid", awareness="ring", sensing_range=2.0, speed=0.2)
    prey = other.add(Target, 5, policy="random-walk", speed=0.1)
    other.senses(hunters, prey)
    other.recording.record_transitions(hunters)
    other.run(10)
    other.interact(Capture(), hunters=hunters, prey=prey)
    other.run(10)
    reward = other.recording.transitions(hunters).facts["reward"]
    assert not reward[:60].any()
    assert reward[60:].all()


def hunting(rng: int | None = None, **options: Any) -> World:
    world = CMOMMT(robots=6, targets=5, radius=2.0, rng=rng, **options)
    world.interact(Capture(side=1.0), hunters=world.robots, prey=world.targets)
    return world


def test_environments_give_the_rewards() -> None:
    seen: list[tuple[Any, Any]] = []

    def reward(facts: Facts) -> Any:
        seen.append((facts.reward.copy(), facts.ended.copy()))
        return facts.fact("reward")

    env = parallel_env(model=hunting, reward=reward)
    env.reset(seed=1)
    rng = np.random.default_rng(1)
    for _ in range(80):
        _, rewards, *_ = env.step({name: rng.uniform(-1, 1, 2) for name in env.agents})
        assert list(rewards.values()) == env.world.robots.bodies.reward.tolist()
        assert seen[-1][1][0].tolist() == env.world.robots.bodies.ended.tolist()
    assert any((facts > 0).any() for facts, _ in seen)


def test_a_robot_with_a_cycle_gets_the_reward_of_each_step_in_an_environment() -> None:
    env = vector_env(1, model=hunting, reward="interaction", cycle=4)
    env.reset(seed=1)
    found = np.array([env.step(np.zeros((1, 6, 2)))[1][0] for _ in range(12)])
    assert found.min() == -0.1
    assert set(np.unique(np.round(found, 6))) <= {-0.1, 0.9, 1.9}


def test_the_reward_of_interactions_by_name() -> None:
    found = []
    for reward in ("interaction", lambda facts: facts.reward):
        env = vector_env(3, model=hunting, reward=reward)
        env.reset(seed=1)
        rng = np.random.default_rng(1)
        found.append([env.step(rng.uniform(-1, 1, (3, 6, 2)))[1].copy() for _ in range(40)])
    assert np.array_equal(*found)
    assert np.ptp(found) > 0.5


def test_the_reward_without_an_interaction_is_nothing() -> None:
    env = vector_env(2, robots=3, reward="interaction")
    env.reset(seed=1)
    assert not env.step(np.zeros((2, 3, 2)))[1].any()


def test_recordings_show_the_positions_after_the_interaction() -> None:
    world, twin = hunt(Capture(reach=1.0)), hunt(Capture(reach=1.0))
    replay = world.record()
    world.run(30)
    replay.stop()
    frames = replay.frames
    for tick in range(1, 31):
        twin.step()
        shown = np.concatenate([group.bodies.position for group in twin.groups])
        found = 6.0 * np.stack([frames[tick].x, frames[tick].y], axis=-1) / MOST_PART - 3.0
        assert found == pytest.approx(shown, abs=1e-3)
    world.recording.record_positions()
    world.run(1)
    last = world.recording.trajectory.groupby("identity").last()[["x", "y"]].to_numpy()
    assert last == pytest.approx(np.concatenate([group.bodies.position for group in world.groups]))
