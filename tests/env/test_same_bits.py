"""Environments give the same world as `CMOMMT` of the same seed and policies, to the last bit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, Batteries, Box, Failures, Robot, Sensor, Target, World
from teamsight.env import ActionGrid, gymnasium_env, parallel_env, vector_env
from teamsight.policies.actions import turned_by

KINDS: list[dict[str, Any]] = [
    {},
    {"events": Failures(20, 10)},
    {"events": [Failures(20, 10), Batteries(0.9, per_tick=0.02)]},
    {"cycle": 3, "target_policy": "evasive"},
    {"target_policy": lambda percept, rng: (rng.normal(), percept.speed)},
    {"sensor": Sensor(range_noise=0.2, missed=0.1), "uniform_target_speed": True, "preset": "touzet2000"},
    {"robots": 40, "targets": 60, "radius": 2.0},
]


def headings(world: World) -> np.ndarray:
    action = world.groups[0].action
    return np.column_stack([action.heading, action.distance])


def assert_same_world(one: World, other: World) -> None:
    for mine, theirs in zip(one.groups, other.groups, strict=True):
        for name in ("position", "heading", "moved", "active"):
            np.testing.assert_array_equal(getattr(mine.bodies, name), getattr(theirs.bodies, name))


def collected(world: World) -> pd.DataFrame:
    return pd.concat([world.datacollector.get_model_vars_dataframe(), world.recording.history], axis=1)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: ",".join(kind) or "default")
@pytest.mark.parametrize("degree", ["none", "ring", "nearest", "pairwise", "shared", "relayed"])
def test_the_actions_of_a_policy_give_its_world(degree: str, kind: dict[str, Any]) -> None:
    model = CMOMMT(policy="a-cmommt", awareness=degree, seed=7, **kind)
    env = parallel_env(observation=degree, action="heading", **kind)
    observations, _ = env.reset(seed=7)
    for _ in range(30):
        assert np.array_equal(list(observations.values()), 1 - situations(model))
        model.step()
        observations, *_, infos = env.step(dict(zip(env.agents, headings(model), strict=True)))
        assert infos["robot_0"]["observed"] == model.observed
        assert infos["robot_0"]["mean_neighbours"] == np.nan_to_num(model._engine.present("mean_degree"))
    assert_same_world(model, env.world)
    assert collected(env.world).equals(collected(model))
    assert env.world.steps == 30


def situations(model: World) -> np.ndarray:
    model._engine.prepare()
    group = model.groups[0]
    return group.perception.situate(group.awareness, (model.tick, model._engine.searches))


@pytest.mark.short
@pytest.mark.parametrize("policy", ["random-walk", "centroid", "evolved"])
def test_so_do_those_of_other_policies(policy: str) -> None:
    model = CMOMMT(policy=policy, seed=3)
    env = parallel_env(observation="pairwise", action="heading")
    env.reset(seed=3)
    for _ in range(50):
        model.step()
        env.step(dict(zip(env.agents, headings(model), strict=True)))
    assert_same_world(model, env.world)


def test_rotations_are_those_of_the_learners() -> None:
    rng, env = np.random.default_rng(1), parallel_env(robots=5, action="continuous", max_cycles=20)
    env.reset(seed=1)
    world = env.world
    for _ in range(20):
        given = rng.uniform(-1, 1, (5, 2))
        before = world.robots.heading.copy()
        env.step(dict(zip(env.agents, given, strict=True)))
        expected = [turned_by(*before[i], given[i, 0] / 2) for i in range(5)]
        assert world.robots.action.heading == pytest.approx(np.array(expected), abs=1e-15)
        assert np.array_equal(world.robots.action.distance, (0.5 * given[:, 1] + 0.5) * 0.1)


def test_directions_are_normalised() -> None:
    env = parallel_env(robots=3, action="heading")
    env.reset(seed=1)
    before = env.world.robots.heading.copy()
    env.step({"robot_0": [3.0, -4.0, 0.05], "robot_1": [0.0, 0.0, 9.0], "robot_2": [1e-150, 0.0, -1.0]})
    action = env.world.robots.action
    assert action.heading[0].tolist() == [0.6, -0.8]
    assert not action.heading[1:].any()
    assert np.array_equal(env.world.robots.heading[1:], before[1:])


def test_the_grid_is_that_of_the_learners() -> None:
    grid = ActionGrid(8, (0.0, 0.5, 1.0))
    numbers = np.random.default_rng(1).integers(0, len(grid), (30, 10))
    chosen = parallel_env(action=grid)
    free = parallel_env(action="continuous")
    chosen.reset(seed=4)
    free.reset(seed=4)
    for row in numbers:
        chosen.step(dict(zip(chosen.agents, row, strict=True)))
        # Exact: the rotations are multiples of π / 4, the shares of 1 / 2.
        actions = [(turn / np.pi, 2 * share - 1) for turn, share in grid.actions[row]]
        free.step(dict(zip(free.agents, map(np.array, actions), strict=True)))
    assert_same_world(chosen.world, free.world)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: ",".join(kind) or "default")
def test_many_worlds_are_as_each_alone(kind: dict[str, Any]) -> None:
    many, rng = vector_env(3, max_cycles=25, **kind), np.random.default_rng(2)
    alone = [parallel_env(max_cycles=25, **kind) for _ in range(3)]
    observations, _ = many.reset(seed=5)
    for place, env in enumerate(alone):
        shown, _ = env.reset(seed=5 + place)
        assert np.array_equal(observations[place], list(shown.values()))
    for _ in range(60):
        given = rng.uniform(-1, 1, (3, many.robots, 2))
        made = many.step(given)
        for place, env in enumerate(alone):
            shown, rewards, _, truncated, _ = env.step(dict(zip(env.agents, given[place], strict=True)))
            assert np.array_equal(made.rewards[place], list(rewards.values()))
            if made.truncated[place]:
                assert np.array_equal(made.info["final_observations"][place], list(shown.values()))
                shown, _ = env.reset()
            assert np.array_equal(made.observations[place], list(shown.values()))
            assert made.truncated[place] == truncated["robot_0"]
    for place, env in enumerate(alone):
        assert_same_world(many.world(place), env.world)


def test_robots_as_sub_environments_are_the_same() -> None:
    many, robots = vector_env(4, max_cycles=10), gymnasium_env(4, max_cycles=10, autoreset="same-step")
    first, _ = many.reset(seed=1)
    second, _ = robots.reset(seed=1)
    rng = np.random.default_rng(3)
    for _ in range(15):
        assert np.array_equal(first.reshape(40, -1), second)
        given = rng.uniform(-1, 1, (4, 10, 2)).astype(np.float32)
        made = many.step(given)
        second, rewards, *_ = robots.step(given.reshape(40, 2))
        first = made.observations
        assert np.array_equal(made.rewards.ravel(), rewards)


def hunt(rng: int | None = None, hunters: int = 4) -> World:
    world = World(Box(6, 4), rng=rng)
    preys = world.add(Target, 6, policy="random-walk", speed=0.05, name="preys")
    robots = world.add(Robot, hunters, policy="random-walk", awareness="pairwise", name="hunters")
    world.senses(robots, preys)
    return world


def test_a_world_of_the_users_own() -> None:
    env = parallel_env(model=hunt, hunters=3, group="hunters", observation=None, action="heading", max_cycles=40)
    assert env.possible_agents == ["robot_0", "robot_1", "robot_2"]
    model = hunt(rng=9, hunters=3)
    observations, _ = env.reset(seed=9)
    assert len(observations["robot_0"]) == 16 + 2 * 2
    for _ in range(40):
        model.step()
        action = model.groups[1].action
        given = np.column_stack([action.heading, action.distance])
        env.step(dict(zip(env.agents, given, strict=True)))
    assert_same_world(model, env.world)


def test_a_world_that_the_users_model_keeps_may_be_changed() -> None:
    kept: list[World] = []

    def keeps(rng: int | None = None) -> World:
        kept.append(hunt(rng, 3))
        return kept[-1]

    env, given = parallel_env(model=keeps, group="hunters"), np.full((3, 2), 0.5)
    env.reset(seed=1)
    for tick in range(6):
        if tick == 2:
            kept[-1].groups[1][0].active = False
        if tick == 3:
            kept[-1].step()
        if tick == 4:
            kept[-1].groups[1][1].position = (0.0, 0.0)
            kept[-1].groups[0][0].remove()
        before = kept[-1].groups[1].position.copy()
        *_, infos = env.step(dict(zip(env.agents, given, strict=True)))
        moved = np.hypot(*(kept[-1].groups[1].position - before).T) > 0
        assert moved.tolist() == [tick < 2, True, True]
        assert infos["robot_0"]["active"] == (tick < 2)
        assert kept[-1].steps == kept[-1].tick == tick + 1 + (tick >= 3)
    assert len(kept[-1].recording.history) == 7


def test_the_user_may_step_the_world_too() -> None:
    env = parallel_env(robots=3)
    env.reset(seed=1)
    for _ in range(3):
        env.step({agent: np.zeros(2) for agent in env.agents})
        env.world.step()
        env.world.run(2)
    assert env.world.steps == env.world.tick == len(env.world.recording.history) == 12
    assert len(collected(env.world)) == 13


def test_a_world_that_the_user_looks_at_goes_on_as_before() -> None:
    seen, unseen = parallel_env(), parallel_env()
    rng = np.random.default_rng(5)
    for env in (seen, unseen):
        env.reset(seed=2)
    for tick in range(20):
        given = rng.uniform(-1, 1, (10, 2))
        for env in (seen, unseen):
            env.step(dict(zip(env.agents, given, strict=True)))
        assert seen.world.tick == tick + 1
    assert_same_world(seen.world, unseen.world)
    assert collected(seen.world).equals(collected(unseen.world))
    seen.world.robots[0].active = False
    *_, infos = seen.step(dict(zip(seen.agents, given, strict=True)))
    assert infos["robot_0"]["active"] == 0
