"""The interface of stable-baselines3, which the tests stand in for: PyTorch is too large for them."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from teamsight.env import gymnasium_env, stable_baselines_env

ADAPTER = "teamsight.env.stable_baselines"
# The abstract methods of stable_baselines3.common.vec_env.VecEnv 2.9.
NEEDED = ("reset", "step_async", "step_wait", "close", "get_attr", "set_attr", "env_method", "env_is_wrapped")


class VecEnv:
    """What the adapter uses of stable-baselines3's class, as in its version 2.9."""

    def __init__(self, num_envs: int, observation_space: Any, action_space: Any) -> None:
        self.num_envs, self.observation_space, self.action_space = num_envs, observation_space, action_space
        self.render_mode = self.get_attr("render_mode")[0]  # type: ignore[attr-defined]
        self._reset_seeds()

    def _reset_seeds(self) -> None:
        self._seeds: list[int | None] = [None] * self.num_envs

    def _reset_options(self) -> None:
        self._options: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]

    def seed(self, seed: int) -> None:
        self._seeds = [seed + number for number in range(self.num_envs)]

    def _get_indices(self, indices: Any) -> Any:
        return range(self.num_envs) if indices is None else [indices] if isinstance(indices, int) else indices


@pytest.fixture
def make(monkeypatch: pytest.MonkeyPatch) -> Any:
    names = ("stable_baselines3", "stable_baselines3.common", "stable_baselines3.common.vec_env")
    for name in names:
        module: Any = ModuleType(name)
        module.__spec__, module.VecEnv = ModuleSpec(name, None), VecEnv
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, ADAPTER, raising=False)
    yield import_module(ADAPTER).stable_baselines_env
    # It is made of the stand-in.
    sys.modules.pop(ADAPTER, None)


@pytest.mark.skipif(find_spec("stable_baselines3") is not None, reason="it is installed")
def test_without_the_library_the_command_is_named() -> None:
    with pytest.raises(ImportError, match="needs stable_baselines3, which is not installed: pip install stable-base"):
        stable_baselines_env(1)


def test_steps_are_those_of_gymnasium(make: Any) -> None:
    env, same = make(2, robots=3, max_cycles=4), gymnasium_env(2, robots=3, max_cycles=4, autoreset="same-step")
    env.seed(5)
    assert np.array_equal(env.reset(), same.reset(seed=5)[0])
    assert all(callable(getattr(env, name)) for name in NEEDED)
    actions = np.random.default_rng(1).uniform(-1, 1, (6, 2))
    for step in range(9):
        env.step_async(actions)
        (observations, rewards, dones, infos), expected = env.step_wait(), same.step(actions)
        assert np.array_equal(observations, expected[0])
        assert rewards.dtype == np.float32
        assert rewards == pytest.approx(expected[1])
        assert dones.tolist() == [step % 4 == 3] * 6
        if dones.any():
            assert np.array_equal([one["terminal_observation"] for one in infos], np.stack(expected[4]["final_obs"]))
            assert [one["TimeLimit.truncated"] for one in infos] == [True] * 6
            assert [one["observed"] for one in infos] == expected[4]["observed"].tolist()
        else:
            assert infos == [{}] * 6
    # The seed is that of one reset.
    assert not np.array_equal(env.reset(), same.reset(seed=5)[0])


def test_what_algorithms_ask_of_environments(make: Any) -> None:
    env = make(2, robots=3, render_mode="rgb_array")
    env.reset()
    assert env.num_envs == 6
    assert env.action_space.shape == (2,)
    assert env.render_mode == "rgb_array"
    assert [picture.shape for picture in env.get_images()] == [(600, 600, 3)] * 2
    assert env.get_attr("num_envs", [1, 4]) == [6, 6]
    assert env.env_is_wrapped(object, 2) == [False]
    assert len(env.env_method("render", indices=[0])[0]) == 6
    with pytest.raises(AttributeError, match=r"speed: cannot be set, as the robots of a world share.*env.shared.team"):
        env.set_attr("speed", 1.0)
    with pytest.raises(TypeError, match="autoreset"):
        make(1, autoreset="disabled")
    env.close()
    env.close()
