"""Environments of a task: by name or as an object, with its scenario and its team."""

from __future__ import annotations

import numpy as np
import pytest
from toy_tasks import GATHER

pytest.importorskip("pettingzoo")

from teamsight.env import parallel_env, vector_env


def test_an_environment_of_cmommt_as_a_task_is_that_of_the_model() -> None:
    one = parallel_env(model="cmommt", robots=3, radius=2.0, max_cycles=4)
    other = parallel_env(robots=3, radius=2.0, max_cycles=4)
    seen = [each.reset(seed=5)[0] for each in (one, other)]
    for name in other.possible_agents:
        np.testing.assert_array_equal(seen[0][name], seen[1][name])
    actions = {name: np.array([0.3, 1.0], np.float32) for name in other.possible_agents}
    assert one.step(actions)[1] == other.step(actions)[1]


def test_the_team_of_a_task_is_steered() -> None:
    env = parallel_env(model=GATHER, walkers=4, side=3.0, observation="none", max_cycles=3)
    env.reset(seed=1)
    assert len(env.possible_agents) == 4
    many = vector_env(3, model=GATHER, walkers=2, max_cycles=3)
    assert many.reset(seed=1)[0].shape[:2] == (3, 2)


def test_what_a_task_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match="walker: is no parameter of the task gather; did you mean 'walkers'"):
        parallel_env(model=GATHER, walker=4)
    with pytest.raises(ValueError, match="targets: is no parameter of the task gather"):
        parallel_env(model=GATHER, targets=3)
    with pytest.raises(ValueError, match="task='gathr': unknown"):
        parallel_env(model="gathr")
