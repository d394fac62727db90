"""PettingZoo's own tests of environments."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, render_test, seed_test
from pettingzoo.utils import aec_to_parallel, wrappers

from teamsight import Failures
from teamsight.env import ActionGrid, Nearest, env, parallel_env, views

pytestmark = pytest.mark.filterwarnings("error::UserWarning")

KINDS: list[dict[str, Any]] = [
    {},
    {"observation": "none", "action": "grid"},
    {"observation": "pairwise", "action": ActionGrid(4, (0.0, 0.5, 1.0)), "reward": "share"},
    {"observation": None, "action": "heading", "robots": 4},
    {"observation": "shared", "layout": Nearest(3, 2, 4), "reward": {"observed": 1.0, "neighbours": -0.1}},
    {"observation": "ring", "delta": 4, "layout": "nearest", "events": Failures(20, 10), "reward": "gain"},
]


@pytest.mark.short
@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_passes_the_tests_of_pettingzoo(kind: dict[str, Any]) -> None:
    parallel_api_test(parallel_env(**kind, max_cycles=60), 100)
    parallel_seed_test(lambda: parallel_env(**kind, max_cycles=60), 100)


def test_agents_in_turn_pass_them_too() -> None:
    # PettingZoo reports that observations are no pictures.
    api_test(env(robots=3, max_cycles=20), 60)
    seed_test(lambda: env(robots=3, max_cycles=20), 40)


def test_pettingzoos_wrappers_take_it() -> None:
    for wrapped in (
        wrappers.BaseParallelWrapper(parallel_env(robots=3, max_cycles=10)),
        wrappers.MultiEpisodeParallelEnv(parallel_env(robots=3, max_cycles=10), 3),
        aec_to_parallel(env(robots=3, max_cycles=10)),
    ):
        parallel_api_test(wrapped, 40)
        assert wrapped.unwrapped.metadata["name"] == "teamsight_cmommt_v0"
    api_test(wrappers.ClipOutOfBoundsWrapper(env(robots=3, max_cycles=10)), 40)


def test_episodes_have_the_length_that_is_asked_for() -> None:
    max_cycles_test(SimpleNamespace(parallel_env=parallel_env, env=env))


class Shown:
    """Stands for a window, since the tests have no display."""

    pictures = 0

    def __init__(self, pixels: Any) -> None:
        pass

    def show(self, pixels: Any) -> None:
        Shown.pictures += pixels.dtype == np.uint8

    def close(self) -> None:
        pass


def test_renders_in_all_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(views, "Window", Shown)
    render_test(lambda render_mode=None: env(robots=3, render_mode=render_mode))
    assert Shown.pictures > 5
