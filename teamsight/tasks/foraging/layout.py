"""The area of foraging robots: a square with round obstacles on a share of it, and home in the middle."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from teamsight.core import checks
from teamsight.world.arena import Arena, Box
from teamsight.world.shapes import Circle

#: x, y and radius of a round obstacle, from the middle of the area [length].
Round = tuple[float, float, float]

# Radii of obstacles, and the width of the gaps between them, which bodies can pass.
_RADII = (1.0, 3.0)
_GAP = 1.5
_MOST_TRIES = 100_000


def scattered(side: float, share: float, layout: int, clear: float) -> tuple[Round, ...]:
    """Return obstacles that cover a share of a square area.

    Parameters
    ----------
    side : float
        The side of the area [length].
    share : float
        The share of the area under obstacles, in [0, 0.3].
    layout : int
        The seed of their places.
    clear : float
        The distance from the middle within which there are none [length].

    Raises
    ------
    TypeError, ValueError
        If the share is outside its limits, or the obstacles find no room.
    """
    return _scattered(side, checks.number("obstacles", share, least=0, most=0.3), layout, clear)


@cache
def _scattered(side: float, share: float, layout: int, clear: float) -> tuple[Round, ...]:
    rng, left, found = np.random.default_rng(layout), share * side * side, list[Round]()
    for _ in range(_MOST_TRIES):
        if left <= 0.0:
            return tuple(found)
        # The last one covers what is left; a tiny one is not worth a place.
        radius = min(float(rng.uniform(*_RADII)), math.sqrt(max(left, 0.01) / math.pi))
        x, y = (float(one) for one in rng.uniform(-0.5 * side + radius + _GAP, 0.5 * side - radius - _GAP, 2))
        near = (math.hypot(x - other[0], y - other[1]) - other[2] < radius + _GAP for other in found)
        if math.hypot(x, y) - radius > clear and not any(near):
            found.append((x, y, radius))
            left -= math.pi * radius * radius
    raise ValueError(
        f"obstacles={share:g}: find no room in a square of side {side:g}; take a smaller share or a larger side"
    )


def check_circles(obstacles: tuple[Round, ...]) -> None:
    """Refuse what are no round obstacles.

    Raises
    ------
    TypeError, ValueError
        Naming the first that is none.
    """
    if not isinstance(obstacles, tuple) or not all(isinstance(one, tuple) and len(one) == 3 for one in obstacles):
        shown = checks.shown(obstacles)
        raise TypeError(f"obstacles={shown}: must be a tuple of (x, y, radius), such as ((0.0, 2.0, 1.0),)")
    for x, y, radius in obstacles:
        checks.number("obstacles: x", x)
        checks.number("obstacles: y", y)
        checks.number("obstacles: radius", radius, above=0)


def refuse_torus(name: str, arena: Arena) -> None:
    """Refuse an arena that repeats.

    Raises
    ------
    ValueError
        Naming the interaction and the arena.
    """
    if any(side > 0.0 for side in arena.period):
        raise ValueError(f"{name}: measures distances in a plane, and {arena} repeats; take one that does not: Box")


def area(side: float, obstacles: tuple[Round, ...]) -> Arena:
    """Return the arena of these obstacles."""
    box = Box(side, side)
    return box.with_obstacles(*(Circle((x, y), radius) for x, y, radius in obstacles)) if obstacles else box
