"""How a world is drawn: the outline of its arena as lines, and its card in notebooks, with a picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body
from teamsight.agents.engine.engine import Engine, kernels_needed
from teamsight.agents.group import Group
from teamsight.agents.group_card import HEADER, group_row
from teamsight.agents.world_data import WorldData
from teamsight.core.card import ARROW, COLOURS, card, legend, legible, table
from teamsight.core.checks import shown
from teamsight.world.arena import Arena, Box, Obstructed, Torus

Floats = npt.NDArray[np.float64]

# Cells along each side of the box around an arena whose shape is found with `contains`.
_CELLS = 48
# Each halves the error of a point of the wall: 2⁻¹⁶ of a cell.
_HALVINGS = 16


def walls(arena: Arena) -> list[Floats]:
    """Return lines along the walls of an arena, or along its seam where it repeats.

    Parameters
    ----------
    arena : Arena
        Any arena. Walls that its `boundary` does not describe are found with `contains`; narrow parts may be missing.

    Returns
    -------
    list of ndarray, shape (k, 2), float64
        Lines through k points [length].
    """
    if isinstance(arena, Obstructed):
        return walls(arena.arena)
    # A class that inherits `boundary` and defines `contains` has another shape than its base.
    boundary, contains = (
        next(home for home in type(arena).__mro__ if name in vars(home)) for name in ("boundary", "contains")
    )
    if type(arena) in (Box, Torus) or issubclass(boundary, contains):
        return [_closed(arena.boundary)]
    return _chained(_walls(arena))


def obstacles(arena: Arena) -> list[Floats]:
    """Return lines around the obstacles of an arena, each of shape (k, 2) [length]."""
    return [_closed(vertices) for vertices in arena.outline().obstacles]


def _closed(vertices: Floats) -> Floats:
    return np.concatenate([vertices, vertices[:1]])


def circle(x: float, y: float, radius: float, corners: int) -> Floats:
    """Return a closed line around a circle, shape (corners + 1, 2)."""
    angle = np.linspace(0.0, 2 * np.pi, corners + 1)
    line = np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=-1)
    line[-1] = line[0]
    return line


def square(x: float, y: float, half: float) -> Floats:
    """Return a closed line around a square of this half side, shape (5, 2)."""
    return np.array([x, y]) + half * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)], float)


def _walls(arena: Arena) -> Floats:
    """Return pieces of the walls, shape (pieces, 2, 2): marching squares with points found by bisection."""
    low, high = arena.bounds
    # One cell more on each side, so that walls along the box are crossed too.
    side = (high - low) / _CELLS
    ticks = [np.linspace(low[axis] - side[axis], high[axis] + side[axis], _CELLS + 3) for axis in (0, 1)]
    nodes = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1)
    along_x, along_y = _crossings(arena, nodes[:-1], nodes[1:]), _crossings(arena, nodes[:, :-1], nodes[:, 1:])
    # The four sides of each cell: below, left, above, right. Neighbouring sides are joined where all are crossed.
    sides = np.stack([along_x[:, :-1], along_y[:-1], along_x[:, 1:], along_y[1:]], axis=-2).reshape(-1, 4, 2)
    is_crossed = ~np.isnan(sides[..., 0])
    pairs = sides[is_crossed.sum(axis=1) == 2]
    once = pairs[~np.isnan(pairs[..., 0])].reshape(-1, 2, 2)
    return np.concatenate([once, sides[is_crossed.all(axis=1)].reshape(-1, 2, 2)])


def _chained(pieces: Floats) -> list[Floats]:
    """Return pieces, shape (pieces, 2, 2), as few lines: pieces that share an end follow each other."""
    following: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for (x0, y0), (x1, y1) in pieces.tolist():
        following.setdefault((x0, y0), []).append((x1, y1))
        following.setdefault((x1, y1), []).append((x0, y0))
    lines = []
    # Lines that end somewhere begin there; the others are closed.
    for start in sorted(following, key=lambda point: len(following[point]) != 1):
        line = [start]
        while following[line[-1]]:
            step = following[line[-1]].pop()
            following[step].remove(line[-1])
            line.append(step)
        if len(line) > 1:
            lines.append(np.array(line))
    return lines


def _crossings(arena: Arena, start: Floats, end: Floats) -> Floats:
    """Return where the wall crosses the way from each start to its end; NaN where both are on the same side."""
    shape, start, end = start.shape, start.reshape(-1, 2), end.reshape(-1, 2)
    points, is_inside = np.full(start.shape, np.nan), arena.contains(start)
    (crossed,) = np.nonzero(is_inside != arena.contains(end))
    one, two, first = start[crossed], end[crossed], is_inside[crossed]
    for _ in range(_HALVINGS):
        middle = (one + two) / 2
        is_before = (arena.contains(middle) == first)[:, None]
        one, two = np.where(is_before, middle, one), np.where(is_before, two, middle)
    points[crossed] = (one + two) / 2
    return points.reshape(shape)


Map = Callable[[Floats], Floats]

# The longer side of the picture [pixels].
_SIDE = 260.0
_MARGIN = 6.0
# Radius of a dot, and the least of one within a body [pixels]; an arrow is as much larger as on the live page.
_DOT, _LEAST_DOT, _ARROW = 3.0, 1.0, 1.4
# The corners of an arrow ahead and to its left, closed, and those of a cross within a dot, as in view.js.
_CORNERS = np.array([*ARROW, ARROW[0]])
_CROSS = 0.6 * np.array([[(-1, -1), (1, 1)], [(1, -1), (-1, 1)]], float)
#: Of more agents, every second or every tenth is drawn.
MOST_DRAWN = 150


def svg(data: WorldData, is_observed: Callable[[Body], bool]) -> str:
    """Return a picture of the arena and the agents as the live page draws them, with the sensing ranges of teams.

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
    parts = [_lines(map(on_page, obstacles(data.arena)), 'fill="#8888" stroke="none"')]
    every = max(-(-sum(map(len, data.groups)) // MOST_DRAWN), 1)
    for group in data.groups:
        parts += _group(group, every, on_page, scale, is_observed)
    parts.append(_lines(map(on_page, walls(data.arena)), f'fill="none" stroke="currentColor"{dashes}'))
    box = f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box} style="display:block">{"".join(parts)}</svg>'


def _group(
    group: Group[Body], every: int, on_page: Map, scale: float, is_observed: Callable[[Body], bool]
) -> list[str]:
    """Draw every k-th agent of a group."""
    colour, agents = _colour(group), group.agents[::every]
    rows = slice(None, None, every)
    places, ways = on_page(group.position[rows]), group.heading[rows] * (1, -1)
    radii = group.radius[rows] * scale
    # A dot is no larger than its body, as long as it can be seen.
    dots = np.where(radii > 0, np.clip(radii, _LEAST_DOT, _DOT), _DOT)
    wide = _dots(places[radii > 0], radii[radii > 0], f'fill="{colour}" fill-opacity="0.35" stroke="{colour}"')
    if group.team is None:
        filled = np.array([is_observed(agent) for agent in agents], bool)
        return [
            wide,
            _dots(places[filled], dots[filled], f'fill="{colour}" stroke="{colour}"'),
            _dots(places[~filled], dots[~filled], f'fill="none" stroke="{colour}"'),
        ]
    active = group.active[rows]
    inactive, unused = places[~active], dots[~active]
    places, ways, dots = places[active], ways[active], dots[active]
    left = np.stack([ways[:, 1], -ways[:, 0]], axis=-1)
    arrows = places[:, None] + _ARROW * dots[:, None, None] * (
        _CORNERS[:, :1] * ways[:, None] + _CORNERS[:, 1:] * left[:, None]
    )
    crosses = (inactive[:, None, None] + unused[:, None, None, None] * _CROSS).reshape(-1, 2, 2)
    return [
        wide,
        (_dots if group.range_shape == "disc" else _squares)(
            places, group.sensing_range[rows][active] * scale,
            f'fill="{colour}" fill-opacity="0.12" stroke="{colour}" stroke-opacity="0.4"',
        ),
        _lines(arrows, f'fill="{colour}" stroke="none"'),
        _dots(inactive, unused, f'fill="none" stroke="{colour}"'),
        _lines(crosses, f'fill="none" stroke="{colour}"'),
    ]  # fmt: skip


def _colour(group: Group[Body]) -> str:
    return legible(COLOURS[group.number % len(COLOURS)])


def _marks(groups: Iterable[Group[Body]], *, is_known: bool) -> Iterator[tuple[str, str, str]]:
    """Yield the marks of groups for the legend; which agents are observed may not be known."""
    for group in groups:
        if group.team is not None:
            yield "▲", _colour(group), group.name
        elif is_known:
            yield "●", _colour(group), f"{group.name}, observed"
            yield "○", _colour(group), "not observed"
        else:
            yield "○", _colour(group), f"{group.name}; which are observed is known after the first step"


def _dots(places: Floats, radii: Floats, look: str) -> str:
    """Return circles as one path."""
    half = "a{r:.1f} {r:.1f} 0 1 0 {d:.1f} 0"
    arcs = (half.format(r=r, d=2 * r) + half.format(r=r, d=-2 * r) for r in radii)
    return _path((f"{x - r:.1f} {y:.1f}{arc}" for (x, y), r, arc in zip(places, radii, arcs, strict=True)), look)


def _squares(places: Floats, halves: Floats, look: str) -> str:
    """Return squares of these half sides as one path."""
    steps = (
        f"{x - half:.1f} {y - half:.1f}h{2 * half:.1f}v{2 * half:.1f}h{-2 * half:.1f}z"
        for (x, y), half in zip(places, halves, strict=False)
    )
    return _path(steps, look)


def _lines(lines: Iterable[Floats], look: str) -> str:
    """Return lines as one path."""
    return _path(("L".join(f"{x:.1f} {y:.1f}" for x, y in line) for line in lines), look)


def _path(parts: Iterable[str], look: str) -> str:
    """Return a path of these parts, each from its first point on."""
    steps = "".join(f"M{part}" for part in parts)
    return f'<path {look} d="{steps}"/>' if steps else ""


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
    observed = data.history.sums.observed.mean_share
    if not math.isnan(observed):
        rows.append(("observed fraction so far", f"{observed:.1%}"))
    knows = _knows_neighbours(data, engine)
    picture = svg(data, lambda agent: knows and agent.is_observed)
    total = sum(map(len, data.groups))
    caption = legend(_marks(data.groups, is_known=knows))
    if total > MOST_DRAWN:
        caption += f"<small>a part of the {total:,} agents is drawn</small>"
    return card(name, rows, table(HEADER, map(group_row, data.groups)), picture, caption)


def _knows_neighbours(data: WorldData, engine: Engine) -> bool:
    """Whether the neighbour lists of the present positions are there, or can be made without compiling."""
    if engine.is_bound and engine.is_seen:
        return True
    if data.timeline.inside or any(kernel.is_missing() for kernel in kernels_needed(data)()):
        return False
    engine.prepare()
    return True
