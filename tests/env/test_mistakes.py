"""Wrong actions, steps at wrong times, and worlds that change: the errors name the cure, and nothing is changed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT
from teamsight.env import gymnasium_env, parallel_env, vector_env

Settings = dict[str, Any]


def actions(env: Any, **changed: Any) -> dict[str, Any]:
    return {agent: np.zeros(2) for agent in env.possible_agents} | changed


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"robot_2": np.zeros(3)}, ValueError, r"actions\['robot_2'\]: has the shape \(3,\); it must be \(2,\)"),
        ({"robot_2": [0, np.nan]}, ValueError, r"actions\['robot_2'\]=\[0.0, nan\]: must be finite .*np.clip"),
        ({"robot_0": [0, 1.5]}, ValueError, r"\[0.0, 1.5\]: must be finite and between -1 and 1; clip it"),
        ({"robot_0": None}, TypeError, r"actions\['robot_0'\]=None: must be of shape \(2,\)"),
        ({"robot_0": [[1], [1, 2]]}, TypeError, "must be of shape"),
        ({"robot_1": np.array(["a", "b"])}, TypeError, "must be of shape"),
        ({"robot_1": np.array([True, False])}, TypeError, "must be of shape"),
        ({"robot_99": np.zeros(2)}, ValueError, "has an action for 'robot_99'; give one to each of the 10 agents"),
    ],
)
def test_wrong_actions_change_nothing(given: Settings, error: type[Exception], message: str) -> None:
    env = parallel_env()
    env.reset(seed=1)
    before = env.state()
    with pytest.raises(error, match=message):
        env.step(actions(env, **given))
    assert np.array_equal(env.state(), before)
    env.step(actions(env))
    assert env.world.tick == 1


def test_missing_actions() -> None:
    env = parallel_env()
    env.reset(seed=1)
    given = actions(env)
    del given["robot_4"]
    with pytest.raises(ValueError, match="has no action for 'robot_4'"):
        env.step(given)
    with pytest.raises(TypeError, match="must be a dict"):
        env.step(None)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("form", "bad", "message"),
    [
        ("grid", 16, "=16: must be one of the 16 actions of the grid, 0 to 15"),
        ("grid", -1, "=-1: must be one of the 16 actions"),
        ("grid", 0.5, "whole numbers"),
        ("heading", [1.0, 0.0, np.inf], r"=\[1.0, 0.0, inf\]: must be finite: a direction x, y .* and a distance"),
        ("heading", [np.nan, 0.0, 0.0], "must be finite: a direction"),
    ],
)
def test_other_forms_are_checked_too(form: Any, bad: Any, message: str) -> None:
    env = parallel_env(robots=2, action=form)
    env.reset(seed=1)
    good: Any = 0 if form == "grid" else [0.0, 0.0, 1.0]
    with pytest.raises((TypeError, ValueError), match=message):
        env.step({"robot_0": good, "robot_1": bad})
    env.step({"robot_0": good, "robot_1": good})


def test_steps_at_the_wrong_time() -> None:
    env = parallel_env(max_cycles=2)
    with pytest.raises(RuntimeError, match=r"no episode has begun; call reset\(\) first"):
        env.step(actions(env))
    with pytest.raises(RuntimeError, match=r"no episode has begun; call reset\(\) first"):
        env.world  # noqa: B018
    for one in (env, vector_env(2)):
        with pytest.raises(RuntimeError, match=r"state\(\): no episode has begun; call reset\(\) first"):
            one.state()
    env.reset(seed=1)
    env.step(actions(env))
    *_, truncations, _ = env.step(actions(env))
    assert all(truncations.values())
    assert env.agents == []
    with pytest.raises(RuntimeError, match=r"the episode has ended; call reset\(\) first"):
        env.step(actions(env))
    env.reset()
    env.close()
    env.close()
    with pytest.raises(RuntimeError, match="call reset"):
        env.step(actions(env))
    with pytest.raises(RuntimeError, match=r"world: no episode has begun; call reset\(\) first"):
        env.world  # noqa: B018
    with pytest.raises(ValueError, match="seed=-1: must be at least 0"):
        env.reset(seed=-1)
    with pytest.raises(ValueError, match="agent='robot_10'.*robot_1"):
        env.action_space("robot_10")


def test_many_worlds_check_their_actions() -> None:
    env = vector_env(3, robots=4)
    with pytest.raises(RuntimeError, match=r"world 0 has not begun an episode; call reset\(\) first"):
        env.step(np.zeros((3, 4, 2)))
    env.reset(seed=1)
    before = env.state()
    for given, message in (
        (np.zeros((3, 4)), r"actions: has the shape \(3, 4\); it must be \(3, 4, 2\), the way ahead"),
        (np.full((3, 4, 2), "a"), "actions: must be numbers"),
        (None, "actions: must be numbers, in an array of shape .3, 4, 2., and is None"),
    ):
        with pytest.raises((TypeError, ValueError), match=message):
            env.step(given)  # type: ignore[arg-type]
    bad = np.zeros((3, 4, 2))
    bad[2, 1, 1] = np.nan
    with pytest.raises(ValueError, match=r"actions\[2, 1\]=\[0.0, nan\]: must be finite"):
        env.step(bad)
    assert np.array_equal(env.state(), before)
    for given in (np.zeros((3, 2)), [[0.0], [0.0, 0.0]]):
        with pytest.raises(ValueError, match=r"actions: have the shape .*; it must be \(12, 2\), one for each robot"):
            gymnasium_env(3, robots=4).step(given)


def test_worlds_and_seeds_are_checked() -> None:
    env = vector_env(3, robots=4)
    for settings, error, message in (
        ({"seed": "one"}, TypeError, "must be a whole number"),
        ({"seed": [1, 2]}, ValueError, "has 2 numbers; give one to each of the 3 worlds"),
        ({"seed": 1.5}, TypeError, "seed=1.5: must be a whole number"),
        ({"seed": np.array(5)}, TypeError, r"seed=array\(5\): must be a whole number"),
        ({"worlds": [3]}, ValueError, r"worlds=\[3\]: must be numbers from 0 to 2"),
        ({"worlds": [0.5]}, TypeError, "must be numbers of worlds, or 3 flags"),
        ({"worlds": [True, False]}, TypeError, "must be numbers of worlds, or 3 flags"),
        ({"worlds": [[1], [1, 2]]}, TypeError, "must be numbers of worlds, or 3 flags"),
    ):
        with pytest.raises(error, match=message):
            env.reset(**settings)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="worlds=0: must be at least 1"):
        vector_env(0)
    with pytest.raises(ValueError, match="autoreset='same'.*same-step"):
        vector_env(1, autoreset="same")
    with pytest.raises(ValueError, match="begin together"):
        gymnasium_env(2, robots=2).reset(options={"reset_mask": np.array([True, False, False, False])})


def test_robots_that_leave_are_an_error_and_reset_cures_it() -> None:
    env = parallel_env(robots=3)
    env.reset(seed=1)
    env.world.robots[1].remove()
    with pytest.raises(RuntimeError, match=r"robots have come or left.*Failures\(500, 50\), or reset\(\)"):
        env.step(actions(env))
    env.reset(seed=1)
    env.step(actions(env))
    env.world.policy = "a-cmommt"
    with pytest.raises(RuntimeError, match=r"have another policy.*reset\(\)"):
        env.step(actions(env))
    env.reset(seed=1)
    env.step(actions(env))


def test_targets_may_come_and_leave() -> None:
    env = parallel_env(robots=3, targets=5, reward="gain")
    env.reset(seed=1)
    env.world.targets[0].remove()
    env.world.targets.add(3)
    *_, infos = env.step(actions(env))
    assert env.world.observed * 7 == pytest.approx(infos["robot_0"]["observed"] * 7)
    assert len(env.state()) == 8 * 5


def test_a_world_that_stops_ends_the_episode() -> None:
    def stops(rng: int | None = None) -> CMOMMT:
        world = CMOMMT(robots=2, policy="random-walk", rng=rng)
        world.clock.at(3, lambda: setattr(world, "running", False))
        return world

    env = parallel_env(model=stops)
    env.reset(seed=1)
    ends = [list(env.step(actions(env))[2].values()) for _ in range(4) if env.agents]
    assert ends == [[False, False]] * 3 + [[True, True]]
    many = vector_env(2, model=stops)
    many.reset(seed=1)
    ended = [many.step(np.zeros((2, 2, 2))).terminated.tolist() for _ in range(6)]
    assert ended == [[False] * 2] * 3 + [[True] * 2] + [[False] * 2] * 2


def test_an_error_of_the_users_names_the_world() -> None:
    def fails(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        if rng.random() < 0.02:
            raise ZeroDivisionError("a policy of the user's")
        return 0.0, 0.1

    env = vector_env(3, robots=2, target_policy=fails)
    env.reset(seed=1)
    with pytest.raises(ZeroDivisionError) as caught:
        for _ in range(100):
            env.step(np.zeros((3, 2, 2)))
    assert "teamsight.env: in world" in caught.value.__notes__[0]
    with pytest.raises(RuntimeError, match="has not begun an episode"):
        env.step(np.zeros((3, 2, 2)))
    env.reset()


def test_a_world_can_be_had_during_an_episode_only() -> None:
    env = vector_env(2, robots=2)
    for number in range(2):
        with pytest.raises(RuntimeError, match=r"world: no episode has begun; call reset\(\) first"):
            env.world(number)
    env.reset(seed=1, worlds=[])
    env.reset(seed=1, worlds=[1])
    assert env.world(1).seed_used == 2
    env.close()
    with pytest.raises(RuntimeError, match="no episode has begun"):
        env.world(1)


def test_slips_in_names_of_options_are_answered_with_the_nearest() -> None:
    for slip, near in (("robotts", "robots"), ("max_cycle", "max_cycles"), ("rewards", "reward"), ("sensr", "sensor")):
        with pytest.raises(TypeError, match=rf"{slip}=3: unknown; did you mean '{near}'\?"):
            parallel_env(**{slip: 3})  # type: ignore[arg-type]
