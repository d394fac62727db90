"""Percepts in a notebook: drawn as the inspector of the pages draws them, straight ahead at the top."""

from __future__ import annotations

import math
from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any, TypeAlias

import numpy as np

from teamsight.core.card import ARROW, COLOURS, card, legend, legible, table
from teamsight.core.neighbour_list import NeighbourList

# Percepts draw themselves with this module, so it cannot import them.
Percept: TypeAlias = Any
PerceptOfOne: TypeAlias = Any
NeighboursOfOne: TypeAlias = Any

# Pixels: the side of a picture, what is left around the larger range, a body, and the robot itself.
_SIDE, _MARGIN, _DOT, _OWN = 168.0, 14.0, 3.5, 5.0
# A triangle of equal sides, which points nowhere: a teammate whose heading is not known.
_TRIANGLE = [(1.4 * math.cos(angle), 1.4 * math.sin(angle)) for angle in (0.0, 2 * math.pi / 3, -2 * math.pi / 3)]
# Of more neighbours the nearest are listed, and of more robots the first are drawn.
_MOST_ROWS, _MOST_ROBOTS = 12, 6
_ROBOTS, _TARGETS = map(legible, COLOURS[:2])
_COLOURS = {"targets": _TARGETS, "teammates": _ROBOTS, "relayed": _TARGETS}
# Of a channel of the user's own, and of lines; as those of cards, it can be seen on any page.
_GREY = "#888888"


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
    return card(title, facts, _svg(percept, senses), _legend([percept], senses), listed)


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
    return card(f"Percept of {size:,} robots", [], table(("", *names), rows), pictures, _legend(ones, names), more)


def _one(percept: Percept, i: int) -> PerceptOfOne:
    """Return what is drawn of robot `i` of a group."""

    def row(seen: NeighbourList) -> NeighboursOfOne:
        mine = slice(seen.start[i], seen.start[i + 1])
        return SimpleNamespace(identity=seen.identity[mine], offset=seen.offset[mine], distance=seen.distance[mine])

    return SimpleNamespace(
        **{name: getattr(percept, name)[i] for name in ("heading", "sensing_range", "awareness_range")},
        **{name: row(getattr(percept, name)) for name in ("targets", "teammates", "relayed")},
        identity=int(percept.identity[i]) if len(percept.identity) else -1,
        columns=percept.columns,
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


def _headings(seen: NeighboursOfOne, percept: PerceptOfOne) -> list[float]:
    """Return the angle from the robot's heading to that of each teammate; NaN where the percept does not have it."""
    if not {"heading_x", "heading_y"} <= {*percept.columns._fields}:
        return [math.nan] * len(seen.identity)
    columns = (percept.columns.heading_x, percept.columns.heading_y)
    return [
        math.nan if one < 0 else _bearing(np.array([column[one] for column in columns]), percept)
        for one in seen.identity
    ]


def _shape(corners: Iterable[tuple[float, float]], x: float, y: float, angle: float, size: float, colour: str) -> str:
    """Return a filled shape at (x, y), whose corners are ahead and to the left, turned anticlockwise from up."""
    sine, cosine = math.sin(angle), math.cos(angle)
    points = (
        f"{x - size * (ahead * sine + left * cosine):.1f} {y - size * (ahead * cosine - left * sine):.1f}"
        for ahead, left in corners
    )
    return f'<path d="M{"L".join(points)}z" fill="{colour}"/>'


def _legend(percepts: Iterable[PerceptOfOne], names: Iterable[str]) -> str:
    """Return what the marks of the pictures mean."""
    headings = [math.isnan(one) for percept in percepts for one in _headings(percept.teammates, percept)]
    notes = {"teammates": ", without their headings" * any(headings)}
    marks = {"teammates": "▲", "relayed": "○"}
    entries = ((marks.get(name, "●"), _COLOURS.get(name, _GREY), name + notes.get(name, "")) for name in names)
    return legend([*entries, ("- -", "", "awareness range")])


def _svg(percept: PerceptOfOne, senses: dict[str, NeighboursOfOne]) -> str:
    """Draw the ranges, what is sensed, and the robot in the middle, which goes up."""
    ranges = [one for one in (percept.sensing_range, percept.awareness_range) if math.isfinite(one)]
    far = [float(distance) for seen in senses.values() for distance in seen.distance]
    middle = _SIDE / 2
    scale = (middle - _MARGIN) / (max([*ranges, *far], default=0.0) or 1.0)
    circle = '<circle cx="{0}" cy="{0}" r="{1:.1f}" {2}/>'
    looks = (
        f'fill="{_ROBOTS}" fill-opacity="0.12" stroke="{_ROBOTS}" stroke-opacity="0.5"',
        f'fill="none" stroke="{_GREY}" stroke-dasharray="4 3"',
    )
    parts = [
        circle.format(middle, reach * scale, look)
        for reach, look in zip((percept.sensing_range, percept.awareness_range), looks, strict=True)
        if math.isfinite(reach)
    ]
    for name, seen in senses.items():
        colour = _COLOURS.get(name, _GREY)
        fill = "none" if name == "relayed" else colour
        headings = _headings(seen, percept) if name == "teammates" else [math.nan] * len(seen.distance)
        for offset, distance, heading in zip(seen.offset, seen.distance, headings, strict=True):
            bearing = _bearing(offset, percept)
            x, y = (middle - distance * scale * part(bearing) for part in (math.sin, math.cos))
            parts.append(f'<path d="M{middle} {middle}L{x:.1f} {y:.1f}" stroke="{colour}" stroke-opacity="0.5"/>')
            if name != "teammates":
                parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{_DOT}" fill="{fill}" stroke="{colour}"/>')
            elif math.isnan(heading):
                parts.append(_shape(_TRIANGLE, x, y, 0.0, _DOT, colour))
            else:
                parts.append(_shape(ARROW, x, y, heading, 1.4 * _DOT, colour))
    # The robot itself, in the colour of the first group.
    parts.append(_shape(ARROW, middle, middle, 0.0, _OWN, _ROBOTS))
    box = f'width="{_SIDE:.0f}" height="{_SIDE:.0f}" viewBox="0 0 {_SIDE:.0f} {_SIDE:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box} role="img">{"".join(parts)}</svg>'
