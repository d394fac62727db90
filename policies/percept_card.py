"""Percepts in a notebook: drawn as the inspector of the pages draws them, straight ahead at the top."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from teamsight.core.card import card, table
from teamsight.core.neighbour_list import NeighbourList

# Percepts draw themselves with this module, so it cannot import them.
Percept: TypeAlias = Any
PerceptOfOne: TypeAlias = Any
NeighboursOfOne: TypeAlias = Any

# Pixels: the side of a picture, what is left around the larger range, and a body.
_SIDE, _MARGIN, _DOT = 168.0, 14.0, 3.5
# Of more neighbours the nearest are listed, and of more robots the first are drawn.
_MOST_ROWS, _MOST_ROBOTS = 12, 6
_COLOURS = {"targets": "#ff7f0e", "teammates": "#1f77b4", "relayed": "#ff7f0e"}


def percept_html(percept: PerceptOfOne) -> str:
    """Return a card of what one robot perceives: drawn, and as a table."""
    senses, heading = _senses(percept), math.degrees(_angle(percept.heading)) % 360
    facts = [
        ("heading", f"{heading:.0f}°"), ("sensing range", f"{percept.sensing_range:.4g}"),
        ("awareness range", f"{percept.awareness_range:.4g}"), ("speed", f"{percept.speed:.4g}"),
        *((name, str(len(seen.distance))) for name, seen in senses.items()),
    ]  # fmt: skip
    if len(percept.lidar):
        facts.append(("lidar", f"{len(percept.lidar)} rays, nearest {percept.lidar.min():.3g}"))
    rows = [row for name, seen in senses.items() for row in _rows(name, seen, percept)]
    listed = table(("senses", "agent", "range", "bearing"), rows) if rows else "<small>It senses nobody.</small>"
    title = f"Percept of robot {percept.identity}" if percept.identity >= 0 else "Percept of a robot"
    return card(title, facts, _svg(percept, senses), listed)


def percepts_html(percept: Percept) -> str:
    """Return a card of what a group perceives: a table of its robots, and pictures of the first."""
    size = len(percept.heading)
    ones = [_one(percept, i) for i in range(min(size, _MOST_ROBOTS))]
    # Not all have relayed targets.
    names = list(dict.fromkeys(name for one in ones for name in _senses(one)))
    rows = []
    for i, one in enumerate(ones):
        known, senses = one.identity >= 0, _senses(one)
        counts = (str(len(senses[name].distance)) if name in senses else "0" for name in names)
        rows.append((f"robot {one.identity}" if known else f"row {i}", *counts))
    pictures = "".join(_svg(one, _senses(one)) for one in ones)
    more = f"<small>the first {len(ones)} of {size:,}</small>" if size > len(ones) else ""
    return card(f"Percept of {size:,} robots", [], table(("", *names), rows), pictures, more)


def _one(percept: Percept, i: int) -> PerceptOfOne:
    """Return what is drawn of robot `i` of a group."""

    def row(seen: NeighbourList) -> NeighboursOfOne:
        mine = slice(seen.start[i], seen.start[i + 1])
        return SimpleNamespace(identity=seen.identity[mine], offset=seen.offset[mine], distance=seen.distance[mine])

    return SimpleNamespace(
        **{name: getattr(percept, name)[i] for name in ("heading", "sensing_range", "awareness_range")},
        **{name: row(getattr(percept, name)) for name in ("targets", "teammates", "relayed")},
        identity=int(percept.identity[i]) if len(percept.identity) else -1,
        channels=percept.channels._replace(**{name: row(seen) for name, seen in percept.channels._asdict().items()}),
    )


def _senses(percept: PerceptOfOne) -> dict[str, NeighboursOfOne]:
    """Return what is sensed by name; relayed targets only where there are some."""
    named = {"targets": percept.targets, "teammates": percept.teammates}
    if len(percept.relayed.distance):
        named["relayed"] = percept.relayed
    others: Any = percept.channels
    return {**named, **others._asdict()}


def _rows(name: str, seen: NeighboursOfOne, percept: PerceptOfOne) -> list[tuple[str, ...]]:
    nearest = np.argsort(seen.distance, kind="stable")[:_MOST_ROWS].tolist()
    return [
        # The ring, for example, shows teammates without saying who they are.
        (name, str(seen.identity[k]) if seen.identity[k] >= 0 else "–", f"{seen.distance[k]:.3g}",
         _side(_bearing(seen.offset[k], percept)))
        for k in nearest
    ]  # fmt: skip


def _angle(way: np.ndarray[Any, Any]) -> float:
    return math.atan2(way[1], way[0])


def _bearing(offset: np.ndarray[Any, Any], percept: PerceptOfOne) -> float:
    """Return the angle of an offset from the heading, anticlockwise from −π to π."""
    return math.remainder(_angle(offset) - _angle(percept.heading), 2 * math.pi)


def _side(bearing: float) -> str:
    whole = round(math.degrees(bearing))
    return f"{abs(whole)}°{' left' if 0 < whole < 180 else ' right' if -180 < whole < 0 else ''}"


def _svg(percept: PerceptOfOne, senses: dict[str, NeighboursOfOne]) -> str:
    """Draw the ranges, what is sensed, and the robot in the middle, which goes up."""
    ranges = [one for one in (percept.sensing_range, percept.awareness_range) if math.isfinite(one)]
    far = [float(distance) for seen in senses.values() for distance in seen.distance]
    middle = _SIDE / 2
    scale = (middle - _MARGIN) / (max([*ranges, *far], default=0.0) or 1.0)
    circle = '<circle cx="{0}" cy="{0}" r="{1:.1f}" {2}/>'
    looks = (
        'fill="#1f77b4" fill-opacity="0.12" stroke="#1f77b4" stroke-opacity="0.4"',
        'fill="none" stroke="#8888" stroke-dasharray="4 3"',
    )
    parts = [
        circle.format(middle, reach * scale, look)
        for reach, look in zip((percept.sensing_range, percept.awareness_range), looks, strict=True)
        if math.isfinite(reach)
    ]
    for name, seen in senses.items():
        colour = _COLOURS.get(name, "#8888")
        fill = "none" if name == "relayed" else colour
        for offset, distance in zip(seen.offset, seen.distance, strict=True):
            bearing = _bearing(offset, percept)
            x, y = (middle - distance * scale * part(bearing) for part in (math.sin, math.cos))
            line = f'<path d="M{middle} {middle}L{x:.1f} {y:.1f}" stroke="{colour}" stroke-opacity="0.4"/>'
            parts.append(f'{line}<circle cx="{x:.1f}" cy="{y:.1f}" r="{_DOT}" fill="{fill}" stroke="{colour}"/>')
    # The arrow of the pages, in the colour of the first group.
    nose = f"M{middle} {middle - 7.5}l5 13l-5 -3l-5 3z"
    parts.append(f'<path d="{nose}" fill="{_COLOURS["teammates"]}"/>')
    box = f'width="{_SIDE:.0f}" height="{_SIDE:.0f}" viewBox="0 0 {_SIDE:.0f} {_SIDE:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box} role="img">{"".join(parts)}</svg>'
