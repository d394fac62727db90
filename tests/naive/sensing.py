"""The slow twin of the kernel of sensors: one observer and one agent at a time, in plain Python."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from naive.paper import Vector, philox


class Noise(NamedTuple):
    """The four numbers of one observer and one agent at one tick."""

    first: float
    second: float
    third: float
    fourth: float


def noise(key: Any, salt: Any, stream: int, tick: int, member: int, identity: int) -> Noise:
    """A block of Philox, as four uniform numbers."""
    both = (int(key[0]) ^ int(salt[0]), int(key[1]) ^ int(salt[1]))
    return Noise(*((word + 0.5) / 2**32 for word in philox((tick, member, identity, stream), both)))


def normals(one: float, other: float) -> Vector:
    """Two normal numbers from two uniform ones, by Box and Muller (1958)."""
    length = math.sqrt(-2 * math.log(one))
    return length * math.cos(2 * math.pi * other), length * math.sin(2 * math.pi * other)


def sense(sensor: Any, view: Any, is_blocked: Callable[[Vector, Vector], bool]) -> list[dict[int, Vector]]:
    """What each observer senses: for each index, or −1 − index for a false detection, the offset."""
    return [_sense_one(sensor, view, i, is_blocked) for i in range(len(view.heading))]


def _sense_one(sensor: Any, view: Any, i: int, is_blocked: Callable[[Vector, Vector], bool]) -> dict[int, Vector]:
    def draw(identity: int) -> Noise:
        return noise(view.key, view.salt, view.stream, int(view.tick[0]), int(view.member[i]), identity)

    ahead = complex(*view.heading[i])
    reach = float(view.reach[i])
    found: dict[int, Vector] = {}
    for k in range(view.in_range.start[i], view.in_range.start[i + 1]):
        j = int(view.in_range.identity[k])
        way = complex(*view.in_range.offset[k])
        if not in_view(way, ahead, sensor.field_of_view) or is_blocked(view.position[i], (way.real, way.imag)):
            continue
        numbers = draw(int(view.everyone[j]))
        if numbers.third < sensor.missed:
            continue
        away, turn = normals(numbers.first, numbers.second)
        if sensor.range_noise > 0:
            distance = abs(way) + sensor.range_noise * away
            distance = min(max(distance, 1e-6 * reach), reach * view.farthest)
            way = distance * (way / abs(way) if abs(way) > 1e-6 * reach else ahead)
        if sensor.bearing_noise > 0:
            angle = sensor.bearing_noise * turn
            way *= complex(math.cos(angle), math.sin(angle))
        found[j] = (way.real, way.imag)
    numbers = draw(2**32 - 1)
    others = [j for j in range(len(view.everyone)) if j not in found and not (view.own >= 0 and j == view.own + i)]
    if numbers.first < sensor.false_positives and others:
        angle = (numbers.fourth - 0.5) * sensor.field_of_view
        way = ahead * complex(math.cos(angle), math.sin(angle))
        if view.farthest > 1:
            way = on_square(ahead, sensor.field_of_view, numbers.fourth)
        way *= reach * math.sqrt(numbers.third)
        found[-1 - others[int(numbers.second * len(others))]] = (way.real, way.imag)
    return found


def on_square(ahead: complex, field_of_view: float, share: float) -> complex:
    """The end of the ray, on the sides of the square of half-width 1, that has this share of the area in view behind it."""

    def area(angle: float) -> float:
        # A quarter of the square has the area 1; within it, the triangle up to the angle.
        quarters = round(angle / (math.pi / 2))
        return quarters + math.tan(angle - quarters * math.pi / 2) / 2

    low = first = math.atan2(ahead.imag, ahead.real) - field_of_view / 2
    high = last = first + field_of_view
    wanted = area(first) + share * (area(last) - area(first))
    for _ in range(100):
        middle = (low + high) / 2
        low, high = (middle, high) if area(middle) < wanted else (low, middle)
    ray = complex(math.cos(low), math.sin(low))
    return ray / max(abs(ray.real), abs(ray.imag))


def in_view(way: complex, ahead: complex, field_of_view: float) -> bool:
    """Whether the angle between way and heading is at most half the field of view."""
    if way == 0:
        return True
    angle = math.atan2((way * ahead.conjugate()).imag, (way * ahead.conjugate()).real)
    return abs(angle) <= field_of_view / 2
