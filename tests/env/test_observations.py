"""The layouts of observations and their spaces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from naive import environments as naive

from teamsight import CMOMMT, Lidar, Sensor
from teamsight.agents.awareness import OWN_SECTORS, Awareness, RingAwareness, situate_targets
from teamsight.core.kernel import kernel
from teamsight.env import Nearest, gymnasium_env, parallel_env, vector_env

CROWD: dict[str, Any] = {"robots": 12, "targets": 30, "radius": 2.5}


@pytest.mark.parametrize(("degree", "width"), [("none", 16), ("ring", 32), ("nearest", 48), ("pairwise", 38), ("shared", 192)])
def test_situation_vectors_of_each_degree(degree: str, width: int) -> None:
    env = parallel_env(**CROWD, observation=degree)
    observations, _ = env.reset(seed=1)
    for agent, shown in observations.items():
        assert shown.shape == (width,)
        assert shown.dtype == np.float32
        assert env.observation_space(agent).contains(shown)


def test_a_degree_as_an_object() -> None:
    env = parallel_env(observation=RingAwareness(3))
    assert env.observation_space("robot_0").shape == (19,)


@pytest.mark.parametrize("degree", ["none", "ring", "nearest", "pairwise", "shared", "relayed"])
def test_nearest_lists_what_the_percept_shows(degree: str) -> None:
    layout = Nearest(4, 3, 5)
    former: dict[str, Any] = {"observation": degree, "layout": layout, "encoding": "distance"}
    env, rng = parallel_env(**CROWD, **former), np.random.default_rng(1)
    observations, _ = env.reset(seed=1)
    filled = 0
    for _ in range(10):
        world = env.world
        group = world.robots
        world._engine.perceive(group)
        percept = group.percept
        for i, (agent, shown) in enumerate(observations.items()):
            lists = (percept.targets, percept.teammates, percept.relayed)
            expected: list[float] = []
            for seen, most in zip(lists, (4, 3, 5), strict=True):
                offsets = seen.offset[seen.start[i] : seen.start[i + 1]]
                expected += naive.nearest(offsets, percept.heading[i], 1.0, most)
            assert shown == pytest.approx(np.array(expected), abs=1e-6)
            assert env.observation_space(agent).contains(shown)
            filled += shown[[0, 12, 21]] == 1
        observations, *_ = env.step(dict(zip(env.agents, rng.uniform(-1, 1, (12, 2)), strict=True)))
    assert (filled > 0).tolist() == [True, degree != "none", degree in ("shared", "relayed")]


@pytest.mark.parametrize("encoding", ["nearness", "distance"])
@pytest.mark.parametrize("layout", ["sectors", Nearest(2, 1, 1)])
def test_observations_end_with_the_lidar_in_ranges(layout: Any, encoding: str) -> None:
    given: dict[str, Any] = {**CROWD, "robot_radius": 0.1, "layout": layout, "observation": "shared"}
    given["encoding"] = encoding
    env, other = parallel_env(**given, lidar=Lidar(12, 1.5)), parallel_env(**given)
    observations, _ = env.reset(seed=1)
    before, _ = other.reset(seed=1)
    rng = np.random.default_rng(1)
    for _ in range(5):
        readings = env.world.robots.percept.lidar
        assert readings.min() < 0.5
        for i, (agent, shown) in enumerate(observations.items()):
            assert np.array_equal(shown[:-12], before[agent])
            far = (readings[i] / 1.5).astype(np.float32)
            assert np.array_equal(shown[-12:], far if encoding == "distance" else 1 - far)
            space = env.observation_space(agent)
            assert space.shape == shown.shape
            assert space.contains(shown)
            assert (space.low[-12:].tolist(), space.high[-12:].tolist()) == ([0.0] * 12, [1.0] * 12)
        actions = dict(zip(env.agents, rng.uniform(-1, 1, (12, 2)), strict=True))
        observations, before = env.step(actions)[0], other.step(actions)[0]


@kernel
def situate_far(scene: Any, parameters: Any, situation: Any) -> None:
    situate_targets(scene, parameters, situation)
    situation[:, OWN_SECTORS] = -2.5


class OfOnesOwn(Awareness):
    """A degree whose values are not from 0 to 1."""

    situate = situate_far
    added = 1


@pytest.mark.parametrize("layout", ["sectors", Nearest(4, 3, 5)])
@pytest.mark.parametrize("degree", ["none", "ring", "nearest", "pairwise", "shared", "relayed", OfOnesOwn()])
@pytest.mark.parametrize("more", [{}, {"lidar": Lidar(8, 1.5), "robot_radius": 0.1, "sensor": Sensor(range_noise=0.3)}])
def test_nearness_is_one_minus_distance_on_all_paths(layout: Any, degree: Any, more: dict[str, Any]) -> None:
    given: dict[str, Any] = {**CROWD, **more, "layout": layout, "observation": degree, "max_cycles": 8}
    near, far = vector_env(2, **given), vector_env(2, **given, encoding="distance")
    alone, robots = parallel_env(**given), gymnasium_env(2, **given, autoreset="same-step")
    rng, shown, other = np.random.default_rng(3), near.reset(seed=4)[0], far.reset(seed=4)[0]
    single, rows = alone.reset(seed=4)[0], robots.reset(seed=4)[0]
    for _ in range(12):
        if layout == "sectors":
            assert np.array_equal(shown, 1 - other)
        else:
            lists, of_far = (one[..., : layout.width].reshape(2, 12, -1, 3) for one in (shown, other))
            assert np.array_equal(lists[..., 1:], of_far[..., 1:])
            distance = np.hypot(of_far[..., 1], of_far[..., 2])
            assert lists[..., 0] == pytest.approx(of_far[..., 0] * (1 - distance), abs=1e-6)
            assert np.array_equal(shown[..., layout.width :], 1 - other[..., layout.width :])
        assert np.array_equal(shown[0], list(single.values()))
        assert np.array_equal(shown.reshape(24, -1), rows)
        for env, values in ((near, shown), (far, other)):
            assert env.observation_space.low.shape == values.shape[2:]
            assert ((values >= env.observation_space.low) & (values <= env.observation_space.high)).all()
        actions = rng.uniform(-1, 1, (2, 12, 2)).astype(np.float32)
        single = alone.step(dict(zip(alone.possible_agents, actions[0], strict=True)))[0]
        rows, made, others = robots.step(actions.reshape(24, 2))[0], near.step(actions), far.step(actions)
        shown, other = made.observations, others.observations
        assert np.array_equal(made.rewards, others.rewards)
        if made.truncated[0]:
            assert np.array_equal(made.info["final_observations"][0], list(single.values()))
            single = alone.reset()[0]


@dataclass(frozen=True)
class Far(Sensor):
    """Could show agents anywhere."""


@pytest.mark.parametrize("layout", ["sectors", "nearest"])
def test_noisy_readings_are_in_the_space(layout: str) -> None:
    env = parallel_env(**CROWD, layout=layout, sensor=Sensor(range_noise=0.5, bearing_noise=2.0, delay=1))
    env.reset(seed=1)
    for _ in range(20):
        observations, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
        for agent, shown in observations.items():
            assert env.observation_space(agent).contains(shown)
    assert parallel_env(sensor=Far()).observation_space("robot_0").high.max() == np.inf


def test_the_state_has_all_bodies() -> None:
    env = parallel_env(**CROWD)
    env.reset(seed=1)
    rows = env.state().reshape(42, 5)
    assert env.state_space.contains(env.state())
    assert rows[:12, :2] == pytest.approx(env.world.robots.position / 2.5, abs=1e-6)
    assert rows[12:, 2:4] == pytest.approx(env.world.targets.heading, abs=1e-6)
    assert (rows[:, 4] == 1).all()
    env.world.robots[3].active = False
    assert env.state().reshape(42, 5)[3, 4] == 0


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"observation": "rings"}, ValueError, "observation='rings'.*'ring'"),
        ({"observation": "none", "delta": 8}, ValueError, "delta=8: applies to observation='ring' or observation='nearest'; leave it out"),
        ({"delta": 0}, ValueError, "delta=0: must be at least 1"),
        ({"layout": "near"}, ValueError, "layout='near'.*nearest"),
        ({"encoding": "nearnes"}, ValueError, "encoding='nearnes'.*did you mean 'nearness'"),
        ({"robots": 0}, ValueError, "robots=0: must be at least 1"),
        ({"max_cycles": 0}, ValueError, "max_cycles=0: must be at least 1"),
        ({"render_mode": "ansi"}, ValueError, "render_mode='ansi'.*rgb_array"),
        ({"policy": "a-cmommt"}, TypeError, "policy: is not a parameter of environments; .*action"),
        ({"awareness": "ring"}, TypeError, "awareness: is not a parameter.*observation"),
        ({"seed": 3}, TypeError, r"seed: is not a parameter.*reset\(seed=…\)"),
        ({"target_polcy": "evasive"}, TypeError, "target_policy"),
        ({"model": 3}, TypeError, "model=3: must be a function or a class that returns a World"),
        ({"model": lambda rng: None}, TypeError, "returned NoneType; it must return a World"),
        ({"model": lambda rng: None, "robots": 3}, TypeError, "robots"),
        ({"model": lambda seed: None, "size": 3}, TypeError, r"is called as model\(size=…, rng=…\), and refuses it"),
        ({"model": lambda rng: CMOMMT(rng=rng), "group": "men"}, ValueError, "no such group; it has 'robots', 'targets'"),
        ({"observation": 3}, TypeError, "observation=3: must be a degree of awareness, such as .* one of none, ring, nearest, pairwise"),
        ({"action": "discrete"}, ValueError, "action='discrete'.*grid"),
    ],
)
def test_settings_are_checked(settings: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        parallel_env(**settings)


def test_nearest_is_checked() -> None:
    with pytest.raises(ValueError, match="targets=-1: must be at least 0"):
        Nearest(-1)
    with pytest.raises(ValueError, match="one must be at least 1"):
        Nearest(0, 0, 0)
