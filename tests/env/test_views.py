"""Pictures of environments: what is where, and what happens without a display."""

from __future__ import annotations

import matplotlib.pyplot
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from teamsight import Box, Circle, Obstructed, Polygon, Robot, Target, World
from teamsight.env import parallel_env
from teamsight.env.rendering import MARGIN, SIDE


def box(rng: int | None = None) -> World:
    arena = Obstructed(Box(10, 6), (Circle((-2, 0), 0.8), Polygon([(1, -2), (3, -1.5), (2, 0)])))
    world = World(arena, rng=rng)
    robots = world.add(Robot, 2, policy="random-walk", position=[(-4, 2), (3, 2)], heading=(1, 0))
    targets = world.add(Target, 2, policy="stationary", position=[(-3.5, 2), (0, -2.5)])
    world.senses(robots, targets)
    return world


def test_bodies_walls_and_obstacles_are_where_they_are() -> None:
    env = parallel_env(model=box, render_mode="rgb_array")
    env.reset(seed=1)
    pixels = env.render()
    assert pixels is not None
    scale = (SIDE - 2 * MARGIN) / 10

    def at(x: float, y: float) -> list[int]:
        return pixels[round(MARGIN + (3 - y) * scale), round(MARGIN + (x + 5) * scale)].tolist()

    blue, green, grey, white = [31, 120, 181], [43, 161, 43], [184, 184, 184], [255, 255, 255]
    assert at(-4, 2) == at(3, 2) == blue
    assert at(-3.5, 2) == green
    assert at(0, -2.5) == white, "a target that nobody observes is hollow"
    assert at(-2, 0) == at(2, -1.2) == grey
    assert max(at(4.99, -1)) < 100
    assert at(4.5, -2.5) == white
    assert at(3, 2.5) not in (white, blue), "the sensing range is shaded"
    env.world.groups[0][0].active = False
    changed = env.render()
    assert changed is not None
    assert changed[round(MARGIN + scale), round(MARGIN + scale)].tolist() == [158, 158, 158]


def test_the_same_world_has_the_same_picture() -> None:
    pictures = []
    for _ in range(2):
        env = parallel_env(render_mode="rgb_array")
        env.reset(seed=1)
        env.step({agent: np.zeros(2) for agent in env.agents})
        pictures.append(env.render())
    assert np.array_equal(*pictures)


def test_without_a_display_the_error_names_the_cure() -> None:
    matplotlib.pyplot.switch_backend("agg")
    env = parallel_env(render_mode="human")
    env.reset(seed=1)
    with pytest.raises(RuntimeError, match="there is no display; use render_mode='rgb_array'"):
        env.render()
    assert not matplotlib.pyplot.get_fignums()


def test_a_window_shows_each_step(monkeypatch: pytest.MonkeyPatch) -> None:
    matplotlib.pyplot.switch_backend("agg")
    # Stands for a canvas with a display: pictures are drawn into it, and nobody sees it.
    monkeypatch.setattr(FigureCanvasAgg, "required_interactive_framework", "headless", raising=False)
    monkeypatch.setattr(Figure, "show", lambda figure: None)
    env = parallel_env(robots=2, render_mode="human", max_cycles=10)
    env.reset(seed=1)
    shown = []
    for _ in range(2):
        env.step({agent: np.ones(2) for agent in env.agents})
        shown.append(matplotlib.pyplot.gcf().axes[0].images[0].get_array().copy())
    assert not np.array_equal(*shown)
    matplotlib.pyplot.close("all")
    env.step({agent: np.ones(2) for agent in env.agents})
    env.close()
    assert not matplotlib.pyplot.get_fignums()


def test_rendering_at_the_wrong_time() -> None:
    env = parallel_env()
    env.reset(seed=1)
    with pytest.raises(RuntimeError, match="has no render_mode; make it with render_mode='rgb_array'"):
        env.render()
    with pytest.raises(RuntimeError, match=r"no episode has begun; call reset\(\) first"):
        parallel_env(render_mode="rgb_array").render()
