"""The walls of the package's arenas: kernels that end a step inside, and reflect the heading at a wall."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined, kernel


@inlined
def confine_disc(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    end_x = x + step_x
    end_y = y + step_y
    if end_x * end_x + end_y * end_y <= size[0] * size[0]:
        return end_x, end_y, heading_x, heading_y
    return _bounce(x, y, step_x, step_y, heading_x, heading_y, size[0])


@kernel
def _bounce(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, radius: float
) -> tuple[float, float, float, float]:
    square = radius * radius
    for _ in range(64):
        end_x = x + step_x
        end_y = y + step_y
        if end_x * end_x + end_y * end_y <= square:
            return end_x, end_y, heading_x, heading_y
        # The path meets the wall where |place + share · step| = radius.
        a = step_x * step_x + step_y * step_y
        if a == 0.0:
            # The step ends on the wall, but rounding has put the position just outside.
            break
        b = x * step_x + y * step_y
        c = min(x * x + y * y - square, 0.0)
        share = min(max((math.sqrt(max(b * b - a * c, 0.0)) - b) / a, 0.0), 1.0)
        x += share * step_x
        y += share * step_y
        normal = 1.0 / math.sqrt(x * x + y * y)
        normal_x = x * normal
        normal_y = y * normal
        outward = 2.0 * (1.0 - share) * (step_x * normal_x + step_y * normal_y)
        step_x = (1.0 - share) * step_x - outward * normal_x
        step_y = (1.0 - share) * step_y - outward * normal_y
        turned = 2.0 * (heading_x * normal_x + heading_y * normal_y)
        heading_x -= turned * normal_x
        heading_y -= turned * normal_y
    # A step of very many bounces, or one along the wall: stop on the wall.
    inside = radius * (1.0 - 1e-12) / max(math.sqrt(x * x + y * y), radius)
    return x * inside, y * inside, heading_x, heading_y


@inlined
def fold(place: float, half: float) -> tuple[float, float]:
    # The mirror images of a segment repeat every 4 · half. Return the position in the first, and −1 if it is mirrored.
    if place >= -half and place <= half:
        return place, 1.0
    shifted = (place + half) % (4.0 * half)
    if shifted <= 2.0 * half:
        return min(max(shifted - half, -half), half), 1.0
    return min(max(3.0 * half - shifted, -half), half), -1.0


@inlined
def confine_box(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    x, turned_x = fold(x + step_x, 0.5 * size[0])
    y, turned_y = fold(y + step_y, 0.5 * size[1])
    return x, y, heading_x * turned_x, heading_y * turned_y


@inlined
def wrap(place: float, side: float) -> float:
    if place >= -0.5 * side and place < 0.5 * side:
        return place
    place -= side * math.floor(place / side + 0.5)
    # Rounding can put a position just outside.
    return place if place >= -0.5 * side and place < 0.5 * side else -0.5 * side


@inlined
def confine_torus(
    x: float, y: float, step_x: float, step_y: float, heading_x: float, heading_y: float, size: Any
) -> tuple[float, float, float, float]:
    return wrap(x + step_x, size[0]), wrap(y + step_y, size[1]), heading_x, heading_y
