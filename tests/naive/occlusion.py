"""The slow twin of occlusion by bodies: each body, and each of its images, one at a time."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

from naive.paper import Vector

#: Position, radius and identity.
Body = tuple[Vector, float, int]


def clearances(here: Vector, way: Vector, both: tuple[int, int], bodies: Iterable[Body], period: Vector) -> list[float]:
    """How far the line of sight passes from the edge of each body but those of the two; negative if it is hidden."""
    found = []
    for place, radius, identity in bodies:
        if radius > 0 and identity not in both:
            for across, up in product((-1, 0, 1), repeat=2):
                to = complex(*place) - complex(*here) + complex(across * period[0], up * period[1])
                step = complex(*way)
                share = min(max((to * step.conjugate()).real / abs(step) ** 2, 0), 1) if step else 0
                found.append(abs(to - share * step) - radius)
    return found
