"""mesa's own visualisation draws worlds: in solara without a browser, with what mesa's viz extra installs."""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import pytest

from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.agents import make_world_component, portrayal

solara: Any = pytest.importorskip("solara", reason="mesa's visualisation is not installed: pip install 'teamsight[viz]'")
pytest.importorskip("altair", reason="mesa's visualisation is not installed: pip install 'teamsight[viz]'")
viz = pytest.importorskip("mesa.visualization")

Show = Callable[..., Any]


@pytest.fixture(autouse=True)
def _their_warnings() -> Iterator[None]:
    with warnings.catch_warnings():
        # mesa's warnings about dicts, and solara's about mesa's hooks.
        warnings.simplefilter("ignore")
        yield


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The figures and charts that were given to solara."""
    figures: list[Any] = []
    charts: list[Any] = []
    mpl, altair = solara.FigureMatplotlib, solara.FigureAltair
    monkeypatch.setattr(solara, "FigureMatplotlib", lambda fig, *a, **k: (figures.append(fig), mpl(fig, *a, **k))[1])
    monkeypatch.setattr(solara, "FigureAltair", lambda chart, *a, **k: (charts.append(chart), altair(chart, *a, **k))[1])
    return SimpleNamespace(figures=figures, charts=charts)


def show(model: World, **settings: Any) -> None:
    """Render a page as solara's server does, and fail as it fails."""
    _, context = solara.render(viz.SolaraViz(model, **settings), handle_error=False)
    context.close()


def world_in(arena: Any) -> World:
    world = World(arena, rng=1)
    robots = world.add(Robot, 4, policy="a-cmommt")
    world.senses(robots, world.add(Target, 6, policy="random-walk"))
    return world


def dots(figure: Any) -> np.ndarray:
    """Return the places of all dots of a figure."""
    return np.concatenate([np.asarray(dots.get_offsets()) for dots in figure.axes[0].collections])


def in_order(places: np.ndarray) -> np.ndarray:
    return places[np.lexsort(places.T)]


@pytest.mark.parametrize("arena", [Disc(3.0), Box(4, 2), Torus(6, 4)], ids=str)
def test_mesas_own_component_draws_every_agent_at_its_place(arena: Any, drawn: SimpleNamespace) -> None:
    world = world_in(arena)
    style = viz.AgentPortrayalStyle if hasattr(viz, "AgentPortrayalStyle") else viz.components.AgentPortrayalStyle
    component = viz.make_space_component(lambda agent: style())
    for _ in range(2):
        show(world, components=[component, viz.make_plot_component("observed")])
        np.testing.assert_array_equal(in_order(dots(drawn.figures[-2])), in_order(world.space.agent_positions))
        world.run(3)
    assert drawn.figures[0].axes[0].get_xlim()[0] < world.space.x_min


def test_mesas_own_component_for_altair_draws_too(drawn: SimpleNamespace) -> None:
    world = world_in(Disc(3.0))
    show(world, components=[viz.make_space_component(lambda agent: {"color": "red"}, backend="altair")])
    show(world, components="default")
    values = drawn.charts[0].to_dict()["data"]["values"]
    np.testing.assert_allclose([[row["x"], row["y"]] for row in values], world.space.agent_positions)


@pytest.mark.parametrize("backend", ["matplotlib", "altair"])
def test_mesas_renderer_draws_too(backend: str, drawn: SimpleNamespace) -> None:
    world = world_in(Disc(3.0))
    if backend == "altair" and not hasattr(world, "time"):
        pytest.skip("mesa 3.3 does not draw altair charts with pandas 3")
    renderer = viz.SpaceRenderer(world, backend=backend).render(agent_portrayal=portrayal)
    show(world, renderer=renderer)
    assert drawn.figures or drawn.charts


@pytest.mark.parametrize("arena", [Disc(3.0), Torus(6, 4)], ids=str)
def test_a_world_component_draws_agents_walls_headings_and_ranges(arena: Any, drawn: SimpleNamespace) -> None:
    world = world_in(arena)
    world.run(10)
    show(world, components=[make_world_component()])
    axes = drawn.figures[0].axes[0]
    np.testing.assert_array_equal(in_order(dots(drawn.figures[0])), in_order(world.space.agent_positions))
    assert len(axes.lines) == 1 + 4
    assert len(axes.patches) == 4
    np.testing.assert_allclose([line.get_xydata()[0] for line in axes.lines[1:]], world.groups[0].position)
    assert axes.lines[0].get_linestyle() == ("--" if world.space.torus else "-")
    # A dot that mesa leaves out, or draws in one colour, shows in the picture alone.
    picture = io.BytesIO()
    drawn.figures[0].savefig(picture, format="png")
    pixels = np.round(255 * matplotlib.image.imread(io.BytesIO(picture.getvalue()))[..., :3]).astype(int)
    observed = [target for target in world.groups[1] if target.is_observed]
    assert 0 < len(observed) < 6
    for colour in ([0x1F, 0x77, 0xB4], [0xFF, 0x7F, 0x0E]):
        assert np.count_nonzero((pixels == colour).all(axis=-1)) > 20


def test_a_world_component_for_altair_draws_the_same(drawn: SimpleNamespace) -> None:
    world = world_in(Box(6, 3))
    show(world, components=[make_world_component(backend="altair")])
    chart = json.loads(drawn.charts[0].to_json())
    *lines, agents = chart["layer"]
    np.testing.assert_allclose(
        [[row["x"], row["y"]] for row in agents["data"]["values"]], world.space.agent_positions
    )
    assert agents["encoding"]["x"]["type"] == "quantitative"
    assert len(lines) == 1 + 4 + 4
    assert chart["width"] == 2 * chart["height"]


def test_the_buttons_step_and_reset_the_model() -> None:
    from ipyvuetify import Btn
    from mesa.visualization.solara_viz import ModelController

    model = CMOMMT(robots=3, targets=2, radius=2.0, rng=1)
    shown = solara.reactive(model)
    every = {name: solara.reactive(value) for name, value in (("play_interval", 10), ("render_interval", 2))}
    parameters = solara.reactive({"robots": 4, "radius": 3.0, "rng": 7})
    controls = ModelController(shown, model_parameters=parameters, use_threads=solara.reactive(False), **every)
    _, context = solara.render(controls, handle_error=False)
    buttons = {button.children[0]: button for button in context._find(Btn).widgets}
    buttons["Step"].click()
    assert model.tick == model.steps == 2
    buttons["Reset"].click()
    assert shown.value is not model
    assert (len(shown.value.robots), shown.value.arena, shown.value.seed_used) == (4, Disc(3.0), 7)
    context.close()


def test_the_example_can_be_shown(drawn: SimpleNamespace) -> None:
    import runpy

    path = Path(__file__).resolve().parents[2] / "examples" / "watch.py"
    page = runpy.run_path(str(path))["page"]
    _, context = solara.render(page, handle_error=False)
    context.close()
    assert len(drawn.figures) == 2
    assert len(dots(drawn.figures[0])) == 25


def test_an_unknown_backend_is_refused() -> None:
    with pytest.raises(ValueError, match="backend='cairo'.*matplotlib, altair"):
        make_world_component(backend="cairo")
