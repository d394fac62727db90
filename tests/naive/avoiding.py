"""Slow twin of avoiding: velocity obstacles as shapes, and linear programmes by trying all corners."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]
#: What counts as equal [length/tick].
CLOSE = 1e-9


class Body(NamedTuple):
    """Another body, as a robot perceives it."""

    offset: Vector
    velocity: Vector
    radius: float
    speed: float
    is_teammate: bool = True


class HalfPlane(NamedTuple):
    """The velocities v with (v − point) · normal ≥ 0."""

    point: Vector
    normal: Vector

    def outside(self, velocity: Vector) -> float:
        return float((self.point - velocity) @ self.normal)


def way_out(offset: Vector, velocity: Vector, reach: float, time: float) -> HalfPlane:
    """The nearest point of the boundary of the velocity obstacle to a relative velocity, and the normal there."""
    distance, centre, radius = math.hypot(*offset), offset / time, reach / time
    from_centre = (velocity - centre) / math.hypot(*(velocity - centre))
    on_disc = HalfPlane(centre + radius * from_centre, from_centre)
    if distance <= reach:
        return on_disc
    found, ahead, half = [], offset / distance, math.asin(reach / distance)
    # The part of the disc's rim that is seen from the origin.
    if -(from_centre @ ahead) >= reach / distance:
        found.append(on_disc)
    for side in (1, -1):
        cosine, sine = math.cos(side * half), math.sin(side * half)
        leg = np.array([cosine * ahead[0] - sine * ahead[1], sine * ahead[0] + cosine * ahead[1]])
        # It begins where it touches the disc.
        along = max(float(velocity @ leg), math.sqrt(distance**2 - reach**2) / time)
        found.append(HalfPlane(along * leg, side * np.array([-leg[1], leg[0]])))
    return min(found, key=lambda one: math.hypot(*(one.point - velocity)))


def orca(policy: Any, own: Body, other: Body) -> HalfPlane:
    """The half plane of velocities with which a robot avoids another body, of which it does half or all."""
    reach = (1 + policy.margin) * (own.radius + other.radius)
    time = policy.horizon if math.hypot(*other.offset) > reach else 1.0
    relative = own.velocity - other.velocity
    out = way_out(other.offset, relative, reach, time)
    share = 0.5 if other.is_teammate else 1.0
    return HalfPlane(own.velocity + share * (out.point - relative), out.normal)


def cell(own: Body, other: Body) -> HalfPlane:
    """The half plane of velocities with which a robot stays on its side of the gap to another body."""
    distance = math.hypot(*other.offset)
    gap = distance - (1 + 1e-6) * (own.radius + other.radius)
    way = max(0.5 * gap if other.is_teammate else gap - other.speed, 0.0)
    return HalfPlane(way * other.offset / distance, -other.offset / distance)


def _crossings(lines: Iterable[HalfPlane], speed: float) -> Iterator[Vector]:
    """Where lines cross each other, and the circle of a speed."""
    lines = [HalfPlane(one.point, one.normal / math.hypot(*one.normal)) for one in lines if math.hypot(*one.normal) > CLOSE]
    for one, other in itertools.combinations(lines, 2):
        matrix = np.array([one.normal, other.normal])
        if abs(np.linalg.det(matrix)) > CLOSE:
            yield np.linalg.solve(matrix, [one.normal @ one.point, other.normal @ other.point])
    for one in lines:
        foot = (one.normal @ one.point) * one.normal
        if (square := speed**2 - foot @ foot) >= 0:
            for sign in (1, -1):
                yield foot + sign * math.sqrt(square) * np.array([-one.normal[1], one.normal[0]])


def nearest(planes: list[HalfPlane], speed: float, aim: Vector) -> Vector | None:
    """The velocity in all half planes that is nearest to the aim; None if there is none."""
    tried = [aim, *(aim + one.outside(aim) * one.normal for one in planes), *_crossings(planes, speed)]
    fit = [
        one for one in tried
        if math.hypot(*one) <= speed + CLOSE and all(plane.outside(one) <= CLOSE for plane in planes)
    ]  # fmt: skip
    return min(fit, key=lambda one: math.hypot(*(one - aim)), default=None)


def farthest(planes: list[HalfPlane], velocity: Vector) -> float:
    """How far a velocity is outside of the half planes, at most."""
    return max((plane.outside(velocity) for plane in planes), default=-math.inf)


def safest(planes: list[HalfPlane], cells: list[HalfPlane], speed: float) -> Vector:
    """The velocity in all cells that is least far outside of the half planes."""
    equal = []
    for one, other in itertools.combinations(planes, 2):
        normal = one.normal - other.normal
        if (square := normal @ normal) > CLOSE:
            equal.append(HalfPlane(normal * (one.normal @ one.point - other.normal @ other.point) / square, normal))
    tried = [*(speed * one.normal for one in planes), *_crossings([*equal, *cells], speed), np.zeros(2)]
    fit = [one for one in tried if math.hypot(*one) <= speed + CLOSE and farthest(cells, one) <= CLOSE]
    return min(fit, key=lambda one: farthest(planes, one))


def half_planes(policy: Any, own: Body, others: list[Body]) -> tuple[list[HalfPlane], list[HalfPlane]]:
    """The half planes of ORCA and of the cell, of the nearest bodies."""
    met = [other for other in others if other.radius > 0]
    near = sorted(met, key=lambda other: math.hypot(*other.offset))[: policy.neighbours]
    return [orca(policy, own, other) for other in near], [cell(own, other) for other in near] if policy.strict else []


def avoid(policy: Any, own: Body, others: list[Body], aim: Vector) -> Vector:
    """The velocity of a robot that prefers another one, the aim."""
    if own.radius <= 0:
        return aim
    planes, cells = half_planes(policy, own, others)
    found = nearest([*cells, *planes], own.speed, aim)
    return safest(planes, cells, own.speed) if found is None else found
