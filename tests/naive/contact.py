"""Contacts of bodies, event by event: the slow twin of `teamsight.world.contact`, without walls."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

Point = tuple[float, float]
Meet = Callable[[Point, Point], Point]


def minus(a: Point, b: Point) -> Point:
    """Return a − b."""
    return a[0] - b[0], a[1] - b[1]


def dot(a: Point, b: Point) -> float:
    """Return the product of two vectors."""
    return a[0] * b[0] + a[1] * b[1]


def along(place: Point, way: Point, share: float) -> Point:
    """Return where a body is after a share of its way."""
    return place[0] + share * way[0], place[1] + share * way[1]


# They stop so far from each other, so that one that slides along another is not stopped by rounding.
SKIN = 1e-9


def touching(off: Point, way: Point, apart: float) -> float | None:
    """Return the first share at which |off + share · way| falls to `apart`; None if it does not up to 1."""
    a, b, c = dot(way, way), dot(off, way), dot(off, off) - (apart + SKIN) ** 2
    if b >= 0:
        return None
    nearest = along(off, way, min(-b / a, 1.0))
    if math.hypot(*nearest) >= apart:
        return None
    return max((-b - math.sqrt(b * b - a * c)) / a, 0.0)


def hit(
    i: int, j: int, places: Sequence[Point], ways: Sequence[Point], radii: Sequence[float], ends: dict[int, float]
) -> float | None:
    """Return the share of its way at which body i drives into body j, whose way ends at ``ends[j]``, if it is there."""
    apart, end = radii[i] + radii[j], ends.get(j, 1.0)
    share = touching(minus(places[j], places[i]), minus(ways[j], ways[i]), apart)
    if share is not None and share <= end:
        off = minus(along(places[j], ways[j], share), along(places[i], ways[i], share))
        # One that slides along the other does not drive into it.
        return share if dot(ways[i], off) > SKIN * math.hypot(*ways[i]) else None
    off = minus(along(places[j], ways[j], end), along(places[i], ways[i], end))
    later = touching(off, (-ways[i][0], -ways[i][1]), apart)
    return None if later is None or end + later > 1 else end + later


def leg(
    places: Sequence[Point], ways: Sequence[Point], radii: Sequence[float]
) -> tuple[list[Point], dict[int, tuple[float, Point]]]:
    """Return where bodies are after a leg; and for those that have met one, the share of their way and the normal."""
    ends = {i: 0.0 for i, way in enumerate(ways) if way == (0.0, 0.0)}
    met: dict[int, tuple[float, Point]] = {}
    while True:
        # The earliest of all contacts that are still to come; nothing after it can change it.
        coming = [
            (share, i, j)
            for i in range(len(places)) if i not in ends
            for j in range(len(places)) if j != i and (share := hit(i, j, places, ways, radii, ends)) is not None
        ]  # fmt: skip
        if not coming:
            break
        share, i, j = min(coming)
        ends[i] = share
        other = along(places[j], ways[j], min(share, ends.get(j, 1.0)))
        off = minus(along(places[i], ways[i], share), other)
        met[i] = share, (off[0] / math.hypot(*off), off[1] / math.hypot(*off))
    return [along(place, way, ends.get(i, 1.0)) for i, (place, way) in enumerate(zip(places, ways, strict=True))], met


def step(
    places: Sequence[Point], ways: Sequence[Point], radii: Sequence[float], meet: Meet, legs: int
) -> tuple[list[Point], bool]:
    """Return where bodies are after a step of at most so many legs; and whether one met two others at once.

    Which of the two is then first depends on the last digits.
    """
    here, is_pocket = list(places), False
    for number in range(legs):
        here, met = leg(here, ways, radii)
        is_pocket = is_pocket or any(number > 0 and share < SKIN for share, _ in met.values())
        ways = [
            meet((way[0] * (1 - met[i][0]), way[1] * (1 - met[i][0])), met[i][1]) if i in met else (0.0, 0.0)
            for i, way in enumerate(ways)
        ]
    return here, is_pocket


def stop(way: Point, normal: Point) -> Point:
    """Stay where they meet."""
    return 0.0, 0.0


def slide(way: Point, normal: Point) -> Point:
    """Lose what leads into the other."""
    into = min(dot(way, normal), 0.0)
    return way[0] - into * normal[0], way[1] - into * normal[1]
