"""The card of a world: how notebooks show it, with a picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body
from teamsight.agents.engine.engine import Engine, kernels_needed
from teamsight.agents.group import Group
from teamsight.agents.group_card import HEADER, group_row
from teamsight.agents.outline import COLOURS, obstacles, walls
from teamsight.agents.world_data import WorldData
from teamsight.core.card import card, table
from teamsight.core.checks import shown

Floats = npt.NDArray[np.float64]
Map = Callable[[Floats], Floats]

# The longer side of the picture [pixels].
_SIDE = 260.0
_MARGIN = 6.0
# Radius of an agent, and the length of its heading [pixels].
_DOT, _NOSE = 3.0, 8.0
#: Of more agents, every second or every tenth is drawn.
MOST_DRAWN = 150


def svg(data: WorldData, is_observed: Callable[[Body], bool]) -> str:
    """Return a picture of the arena, the agents, and the sensing ranges and headings of teams.

    Parameters
    ----------
    data : WorldData
        The world.
    is_observed : callable
        Whether an agent that is on no team is drawn filled.
    """
    low, high = data.arena.bounds
    scale = _SIDE / float(np.max(high - low))
    width, height = (high - low) * scale + 2 * _MARGIN

    def on_page(points: Floats) -> Floats:
        # The y of a page points down.
        return _MARGIN + np.stack([points[..., 0] - low[0], high[1] - points[..., 1]], axis=-1) * scale

    dashes = ' stroke-dasharray="6 4"' if any(data.arena.period) else ""
    parts = [_path(map(on_page, obstacles(data.arena)), 'fill="#8888" stroke="none"')]
    every = max(-(-sum(map(len, data.groups)) // MOST_DRAWN), 1)
    for group in data.groups:
        parts += _group(group, every, on_page, scale, is_observed)
    parts.append(_path(map(on_page, walls(data.arena)), f'fill="none" stroke="currentColor"{dashes}'))
    box = f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box} style="display:block">{"".join(parts)}</svg>'


def _group(
    group: Group[Body], every: int, on_page: Map, scale: float, is_observed: Callable[[Body], bool]
) -> list[str]:
    """Draw every k-th agent of a group."""
    colour, agents = COLOURS[group.number % len(COLOURS)], group.agents[::every]
    rows = slice(None, None, every)
    places, ways = on_page(group.position[rows]), group.heading[rows] * (1, -1)
    if group.team is None:
        filled = np.array([is_observed(agent) for agent in agents], bool)
        return [
            _dots(places[filled], np.full(len(agents), _DOT), f'fill="{colour}" stroke="{colour}"'),
            _dots(places[~filled], np.full(len(agents), _DOT), f'fill="none" stroke="{colour}"'),
        ]
    active, inactive = group.active[rows], places[~group.active[rows]]
    places, ways = places[active], ways[active]
    noses = [np.stack([place, place + _NOSE * way]) for place, way in zip(places, ways, strict=True)]
    return [
        (_dots if group.range_shape == "disc" else _squares)(
            places, group.sensing_range[rows][active] * scale, f'fill="{colour}" fill-opacity="0.12" stroke="none"'
        ),
        _dots(places, np.full(len(places), _DOT), f'fill="{colour}" stroke="none"'),
        _dots(inactive, np.full(len(inactive), _DOT), f'fill="none" stroke="{colour}" stroke-dasharray="2 2"'),
        _path(noses, f'fill="none" stroke="{colour}" stroke-width="1.5"'),
    ]


def _dots(places: Floats, radii: Floats, look: str) -> str:
    """Return circles as one path."""
    half = "a{r:.1f} {r:.1f} 0 1 0 {d:.1f} 0"
    arcs = (half.format(r=r, d=2 * r) + half.format(r=r, d=-2 * r) for r in radii)
    steps = [f"M{x - r:.1f} {y:.1f}{arc}" for (x, y), r, arc in zip(places, radii, arcs, strict=False)]
    return f'<path {look} d="{"".join(steps)}"/>' if steps else ""


def _squares(places: Floats, halves: Floats, look: str) -> str:
    """Return squares of these half sides as one path."""
    steps = [
        f"M{x - half:.1f} {y - half:.1f}h{2 * half:.1f}v{2 * half:.1f}h{-2 * half:.1f}z"
        for (x, y), half in zip(places, halves, strict=False)
    ]
    return f'<path {look} d="{"".join(steps)}"/>' if steps else ""


def _path(lines: Iterable[Floats], look: str) -> str:
    """Return lines as one path."""
    steps = ["M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in line) for line in lines]
    return f'<path {look} d="{"".join(steps)}"/>' if steps else ""


def world_html(name: str, data: WorldData, engine: Engine) -> str:
    """Return a card of a world: its groups, what its team observes, and a picture. Nothing is compiled.

    Parameters
    ----------
    name : str
        The name of its class.
    data, engine : WorldData, Engine
        Its parts.
    """
    rows: list[tuple[str, object]] = [("arena", shown(data.arena)), ("tick", data.timeline.tick), ("seed", data.seed)]
    observed = data.history.observed_fraction
    if not math.isnan(observed):
        rows.append(("observed fraction so far", f"{observed:.1%}"))
    knows = _knows_neighbours(data, engine)
    picture = svg(data, lambda agent: knows and agent.is_observed)
    total = sum(map(len, data.groups))
    notes = []
    if total > MOST_DRAWN:
        notes.append(f"a part of the {total:,} agents is drawn")
    if any(group.team is None for group in data.groups):
        notes.append("filled: observed" if knows else "which are observed is known after the first step")
    caption = f"<small>{'; '.join(notes)}</small>"
    return card(name, rows, table(HEADER, map(group_row, data.groups)), picture, caption)


def _knows_neighbours(data: WorldData, engine: Engine) -> bool:
    """Whether the neighbour lists of the present positions are there, or can be made without compiling."""
    if engine.is_bound and engine.is_seen:
        return True
    if data.timeline.inside or any(kernel.is_missing() for kernel in kernels_needed(data)()):
        return False
    engine.prepare()
    return True
