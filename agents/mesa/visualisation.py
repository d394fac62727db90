"""Worlds in mesa's visualisation: a portrayal of agents, and a component that draws the arena too.

mesa's own ``make_space_component`` draws a world as well, without walls and ranges; see `World.space`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body
from teamsight.agents.drawing import circle, obstacles, square, walls
from teamsight.core import checks
from teamsight.core.card import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from teamsight.agents.world import World

Floats = npt.NDArray[np.float64]

_BACKENDS = ("matplotlib", "altair")
_MISSING = "mesa's visualisation needs packages that are not installed: pip install 'teamsight[viz]'"


def portrayal(agent: Body) -> Any:
    """Return how mesa draws an agent, with matplotlib or a ``SpaceRenderer``: in its group's colour.

    An agent that is on no team and that nobody observes is pale, one that is inactive grey.

    Parameters
    ----------
    agent : Body
        An agent of a world.

    Returns
    -------
    mesa.visualization.components.AgentPortrayalStyle

    Raises
    ------
    ImportError
        If mesa's visualisation is not installed.
    """
    try:
        from mesa.visualization.components import AgentPortrayalStyle
    except ImportError as error:
        raise ImportError(_MISSING) from error
    size, colour = _look(agent)
    # With some versions of mesa, agents of another zorder than 1 are not drawn, and the opacity is ignored.
    return AgentPortrayalStyle(color=colour, marker="o", size=size, zorder=1)


def draw_arena(axes: Axes, world: World, *, ranges: bool = True) -> None:
    """Draw the walls and obstacles of a world's arena, and the headings and sensing ranges of teams.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw, such as what mesa passes to `post_process`.
    world : World
        The world.
    ranges : bool
        Whether to draw the sensing ranges.
    """
    style = "--" if any(world.arena.period) else "-"
    for line in walls(world.arena):
        axes.plot(line[:, 0], line[:, 1], color="0.3", linestyle=style, linewidth=1.5, zorder=0.5)
    for line in obstacles(world.arena):
        axes.fill(line[:, 0], line[:, 1], color="0.6", zorder=0.5)
    for line in _headings(world):
        axes.plot(line[:, 0], line[:, 1], color="black", linewidth=1.5, zorder=2)
    for line, number in _ranges(world) if ranges else []:
        axes.fill(line[:, 0], line[:, 1], color=COLOURS[number % len(COLOURS)], alpha=0.1, zorder=0)
    axes.set_aspect("equal")
    axes.set_frame_on(False)


def make_world_component(
    agent_portrayal: Callable[[Any], Any] | None = None, *, backend: str = "matplotlib", ranges: bool = True
) -> Callable[[World], Any]:
    """Return a component for mesa's ``SolaraViz`` that draws agents, walls, obstacles and sensing ranges.

    The page needs a network: solara fetches its scripts from a CDN, unless ``solara[assets]`` is installed.

    Parameters
    ----------
    agent_portrayal : callable, optional
        Returns how mesa draws an agent; `portrayal` by default. For altair it returns a dict, with color and size.
    backend : {"matplotlib", "altair"}
        What draws.
    ranges : bool
        Whether to draw the sensing ranges of teams.

    Raises
    ------
    ImportError
        If mesa's visualisation is not installed.
    ValueError
        If the backend is unknown.
    """
    if backend not in _BACKENDS:
        raise ValueError(f"backend={checks.shown(backend)}: must be one of {', '.join(_BACKENDS)}")
    try:
        from mesa.visualization import make_space_component
    except ImportError as error:
        raise ImportError(_MISSING) from error
    chosen = agent_portrayal or (portrayal if backend == "matplotlib" else _altair_portrayal)

    def draw(world: World) -> Any:
        def add_walls(drawn: Any) -> Any:
            return _with_walls(drawn, world, ranges) if backend == "altair" else draw_arena(drawn, world, ranges=ranges)

        return make_space_component(chosen, post_process=add_walls, backend=backend)(world)

    return draw


def _look(agent: Body) -> tuple[int, str]:
    """Return the size and the colour of an agent."""
    colour = COLOURS[agent.group.number % len(COLOURS)]
    if not agent.active:
        return 45, "#999999"
    if agent.group.team is not None:
        return 70, colour
    return 45, colour if getattr(agent, "is_observed", True) else f"{colour}59"


def _altair_portrayal(agent: Body) -> dict[str, Any]:
    size, colour = _look(agent)
    return {"agent": f"{agent.group.name} {agent.unique_id}", "color": colour, "size": size}


def _headings(world: World) -> list[Floats]:
    """Return a short line ahead of each active agent on a team."""
    low, high = world.arena.bounds
    length = 0.03 * float(np.max(high - low))
    return [
        np.array([place, place + length * way])
        for group in world.groups
        if group.team is not None
        for place, way in zip(group.position[group.active], group.heading[group.active], strict=True)
    ]


def _ranges(world: World) -> list[tuple[Floats, int]]:
    """Return the sensing range of each active agent on a team as a line, and the number of its group."""
    return [
        (circle(x, y, reach, 48) if group.range_shape == "disc" else square(x, y, reach), group.number)
        for group in world.groups
        if group.team is not None
        for (x, y), reach in zip(group.position[group.active], group.sensing_range[group.active], strict=True)
    ]


def _with_walls(chart: Any, world: World, ranges: bool) -> Any:
    """Return a chart of agents, whose axes mesa declares to be names, on a plane with walls."""
    import altair

    low, high = world.arena.bounds
    margin = 0.05 * (high - low)
    axes = {
        name: kind(
            f"{name}:Q", axis=None, scale=altair.Scale(domain=[low[i] - margin[i], high[i] + margin[i]], nice=False)
        )
        for i, (name, kind) in enumerate((("x", altair.X), ("y", altair.Y)))
    }
    agents = chart.encode(**axes, size=altair.Size("size:Q", scale=None), color=altair.Color("color:N", scale=None))
    # Each line with its colour, the opacity of what it encloses, and its width.
    lines = [(line, COLOURS[number % len(COLOURS)], 0.1, 0.0) for line, number in (_ranges(world) if ranges else [])]
    lines += [(line, "#777777", 0.0, 1.5) for line in walls(world.arena)]
    lines += [(line, "#999999", 1.0, 0.0) for line in obstacles(world.arena)]
    lines += [(line, "#000000", 0.0, 1.5) for line in _headings(world)]
    layers = [agents]
    for line, colour, fill, width in reversed(lines):
        rows = [{"x": float(x), "y": float(y), "order": row} for row, (x, y) in enumerate(line)]
        mark = altair.Chart(altair.Data(values=rows)).mark_line(
            stroke=colour, strokeWidth=width, fill=colour if fill else None, fillOpacity=fill, clip=True
        )
        layers.insert(0, mark.encode(**axes, order="order:Q"))
    sides = (high - low) * 400 / np.max(high - low)
    return altair.layer(*layers).properties(width=float(sides[0]), height=float(sides[1]))
