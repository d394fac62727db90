"""PettingZoo's own tests of environments."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.figure import Figure
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, render_test, seed_test
from pettingzoo.utils import aec_to_parallel, wrappers

from teamsight import CMOMMT, Failures
from teamsight.env import ActionGrid, Nearest, env, parallel_env, rendering

# A robot that senses nothing observes zeros.
pytestmark = pytest.mark.filterwarnings("error::UserWarning", "ignore:Observation numpy array is all zeros")

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


def test_a_step_without_agents_ends_nothing() -> None:
    env = parallel_env(robots=2, max_cycles=2)
    with pytest.raises(RuntimeError, match="no episode has begun"):
        env.step({})
    env.reset(seed=1)
    with pytest.raises(ValueError, match="has no action for 'robot_0'"):
        env.step({})
    for _ in range(2):
        env.step(dict.fromkeys(env.agents, np.zeros(2)))
    # As SuperSuit's black_death_v3 does, and twice.
    for _ in range(2):
        assert env.step({}) == ({}, {}, {}, {}, {})
    env.close()
    with pytest.raises(RuntimeError, match=r"call reset\(\) first"):
        env.step({})


def hunt(rng: int | None = None) -> CMOMMT:
    return CMOMMT(robots=2, policy="random-walk", rng=rng)


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ({}, "teamsight_cmommt_v0"),
        ({"model": "pursuit"}, "teamsight_pursuit_v0"),
        ({"model": hunt}, "teamsight_hunt_v0"),
        ({"model": partial(hunt)}, "teamsight_world_v0"),
    ],
)
def test_the_name_is_that_of_the_task(settings: dict[str, Any], name: str) -> None:
    made = parallel_env(**settings)
    assert made.metadata["name"] == str(made) == name


def test_episodes_have_the_length_that_is_asked_for() -> None:
    max_cycles_test(SimpleNamespace(parallel_env=parallel_env, env=env))


def test_renders_in_all_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    # Stands for a window, since the tests have no display.
    monkeypatch.setattr(rendering, "_window", lambda pyplot, pixels: Figure().add_axes((0, 0, 1, 1)).imshow(pixels))
    monkeypatch.setattr(Figure, "number", 0, raising=False)
    shown: list[np.ndarray] = []
    monkeypatch.setattr(FigureCanvasBase, "draw_idle", lambda canvas: shown.append(canvas.figure.axes[0].images[0].get_array()))
    monkeypatch.setattr(pyplot, "fignum_exists", lambda number: True)
    render_test(lambda render_mode=None: env(robots=3, render_mode=render_mode))
    assert len(shown) > 5
    assert {one.shape for one in shown} == {(600, 600, 3)}
