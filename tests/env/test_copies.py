"""Copies of environments, as libraries make them that run many: each is a new one of the same settings."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from teamsight import Failures, Sensor
from teamsight.env import Nearest, gymnasium_env, parallel_env, vector_env

COPIES: list[Callable[[Any], Any]] = [copy.copy, copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]
KINDS: list[dict[str, Any]] = [
    {},
    {"reward": {"observed": 1.0, "travelled": -0.1}, "layout": Nearest(2, 2), "action": "grid"},
    {"events": Failures(20, 10), "sensor": Sensor(range_noise=0.1), "observation": "pairwise", "reward": "gain"},
]


@pytest.mark.parametrize("kind", KINDS, ids=str)
@pytest.mark.parametrize("copied", COPIES)
def test_a_copy_is_a_new_environment_of_these_settings(copied: Callable[[Any], Any], kind: dict[str, Any]) -> None:
    env = parallel_env(robots=3, max_cycles=5, **kind)
    env.reset(seed=1)
    again = copied(env)
    actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    with pytest.raises(RuntimeError, match="no episode has begun; call reset"):
        again.step(actions)
    assert again.max_cycles == 5
    assert again.observation_spaces == env.observation_spaces
    for one in (env, again):
        one.reset(seed=7)
    for _ in range(5):
        first, second = env.step(actions), again.step(actions)
        assert np.array_equal(list(first[0].values()), list(second[0].values()))
        assert first[1:] == second[1:]


@pytest.mark.parametrize("copied", COPIES)
@pytest.mark.parametrize("make", [vector_env, gymnasium_env])
def test_so_are_copies_of_many_worlds(make: Callable[..., Any], copied: Callable[[Any], Any]) -> None:
    env = make(2, robots=3, max_cycles=4, autoreset="next-step")
    env.reset(seed=1)
    again = copied(env)
    team, other = getattr(env, "team", env), getattr(again, "team", again)
    assert team is not other
    assert other.autoreset == "next-step"
    first, second = env.reset(seed=3)[0], again.reset(seed=3)[0]
    assert np.array_equal(first, second)
