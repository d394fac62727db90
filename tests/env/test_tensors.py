"""What environments return is shared with tensor libraries, without a copy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight.env import vector_env

ACTIONS = np.full((3, 4, 2), 0.5, np.float32)


@pytest.mark.parametrize("copy", [True, False])
def test_arrays_are_exchanged_by_dlpack(copy: bool) -> None:
    env = vector_env(3, robots=4, max_cycles=3, copy=copy)
    env.reset(seed=1)
    for _ in range(3):
        *arrays, info = env.step(ACTIONS)
        for array in (*arrays, *info.values()):
            assert np.shares_memory(np.from_dlpack(array), array)
            assert array.flags.writeable, "a tensor cannot be read-only"
    assert "final_observations" in info


@pytest.mark.filterwarnings("error")
def test_torch_shares_the_memory() -> None:
    torch: Any = pytest.importorskip("torch")
    env = vector_env(3, robots=4, max_cycles=3, copy=False)
    env.reset(seed=1)
    first = torch.from_numpy(env.step(ACTIONS).observations)
    made = env.step(torch.from_numpy(ACTIONS))
    for array in (*made[:4], *made.info.values()):
        for tensor in (torch.from_numpy(array), torch.from_dlpack(array)):
            assert tensor.data_ptr() == array.ctypes.data
            assert tensor.shape == array.shape
    assert first.data_ptr() == made.observations.ctypes.data, "one tensor shows every step"
    assert np.array_equal(first.numpy(), made.observations)


def test_torch_chooses_the_actions() -> None:
    torch: Any = pytest.importorskip("torch")
    env = vector_env(2, robots=3, max_cycles=20)
    seen, _ = env.reset(seed=1)
    policy = torch.nn.Linear(env.observation_space.shape[0], 2)
    with pytest.raises(RuntimeError, match=r"requires grad. Use tensor.detach\(\)"):
        env.step(torch.tanh(policy(torch.from_numpy(seen))))
    with torch.no_grad():
        for _ in range(25):
            seen = env.step(torch.tanh(policy(torch.from_numpy(seen)))).observations
    other = vector_env(2, robots=3, max_cycles=20)
    again, _ = other.reset(seed=1)
    with torch.no_grad():
        for _ in range(25):
            again = other.step(torch.tanh(policy(torch.from_numpy(again))).numpy()).observations
    assert np.array_equal(seen, again)
