"""Errors and Ctrl-C within a step: no world stays a step ahead of what was returned."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT
from teamsight.env import batch, parallel_env, vector_env


def actions(env: Any) -> dict[str, Any]:
    return {agent: np.zeros(2) for agent in env.possible_agents}


def fails_at_4(rng: int | None = None) -> CMOMMT:
    world = CMOMMT(robots=2, policy="random-walk", rng=rng)
    if rng == 2:
        world.clock.at(3, lambda: 1 / 0)
    return world


def test_after_an_error_all_worlds_begin_anew_so_that_none_is_ahead() -> None:
    env, still = vector_env(3, model=fails_at_4, max_cycles=5, autoreset="disabled"), np.zeros((3, 2, 2))
    env.reset(seed=1)
    for _ in range(3):
        env.step(still)
    with pytest.raises(ZeroDivisionError):
        env.step(still)
    assert env.world(1).tick == 3, "the world can be looked at"
    env.reset(seed=7, worlds=[1])
    with pytest.raises(RuntimeError, match="world 0 has not begun an episode"):
        env.step(still)
    env.reset(seed=7)
    for _ in range(5):
        made = env.step(still)
    assert made.truncated.all()
    assert [env.world(place).tick for place in range(3)] == [5, 5, 5]


def test_ctrl_c_leaves_no_world_ahead_of_what_was_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    env, still = vector_env(2, robots=2), np.zeros((2, 2, 2))
    env.reset(seed=1)
    step_all = batch.STEP_ALL

    def interrupted(record: Any) -> int:
        step_all(record)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(batch, "STEP_ALL", interrupted)
        with pytest.raises(KeyboardInterrupt):
            env.step(still)
    with pytest.raises(RuntimeError, match=r"has not begun an episode; call reset\(\) first"):
        env.step(still)
    env.reset(seed=1)
    env.step(still)
    assert env.world(0).tick == 1


def test_an_episode_ends_even_if_its_last_reward_fails() -> None:
    def reward(facts: Any) -> Any:
        if broken:
            raise ZeroDivisionError
        return facts.sensed

    one, many = parallel_env(robots=2, max_cycles=2, reward=reward), vector_env(1, robots=2, max_cycles=2, reward=reward)
    broken = False
    one.reset(seed=1)
    many.reset(seed=1)
    one.step(actions(one))
    many.step(np.zeros((1, 2, 2)))
    broken = True
    with pytest.raises(ZeroDivisionError):
        one.step(actions(one))
    with pytest.raises(ZeroDivisionError):
        many.step(np.zeros((1, 2, 2)))
    broken = False
    with pytest.raises(RuntimeError, match="the episode has ended"):
        one.step(actions(one))
    many.step(np.zeros((1, 2, 2)))
    assert many.world(0).tick == 0, "the next episode"


def test_a_model_that_returns_the_same_world_again_is_refused() -> None:
    one = CMOMMT(robots=2, policy="random-walk", rng=1)
    for make in (parallel_env, lambda **how: vector_env(2, **how)):
        with pytest.raises(ValueError, match="model: returned a world that is closed, or was stopped; build a new one"):
            make(model=lambda rng: one).reset(seed=1)


def test_cmommt_as_the_model_is_the_default() -> None:
    assert len(parallel_env(model=CMOMMT, robots=3).possible_agents) == 3
