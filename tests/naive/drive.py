"""Slow twins of the drives: one body, in plain Python, with the integral of the motion along the arc."""

from __future__ import annotations

import math


def integrated(heading: float, length: float, turn: float, parts: int = 2000) -> tuple[float, float]:
    """The displacement along an arc, by the midpoint rule."""
    angles = [heading + turn * (part + 0.5) / parts for part in range(parts)]
    return length * sum(map(math.cos, angles)) / parts, length * sum(map(math.sin, angles)) / parts


def towards(wanted: float, before: float, change: float | None) -> float:
    if change is None:
        return wanted
    return before + math.copysign(min(abs(wanted - before), change), wanted - before)


def differential(
    turn: float, distance: float, speed: float, wheels: tuple[float, float], base: float, acceleration: float | None
) -> tuple[tuple[float, float], float, float]:
    """The wheel speeds, the length of the arc and the turn."""
    left, right = distance - base * turn / 2, distance + base * turn / 2
    while max(abs(left), abs(right)) > speed * (1 + 1e-15):
        share = speed / max(abs(left), abs(right))
        left, right = left * share, right * share
    wheels = towards(left, wheels[0], acceleration), towards(right, wheels[1], acceleration)
    return wheels, (wheels[0] + wheels[1]) / 2, (wheels[1] - wheels[0]) / base


def car(
    turn: float, distance: float, state: tuple[float, float], base: float, largest: float, rate: float | None,
    acceleration: float | None,
) -> tuple[tuple[float, float], float, float]:  # fmt: skip
    """The velocity and the steering angle, the length of the arc and the turn."""
    wanted = math.copysign(largest, turn) if turn else 0.0
    if distance:
        wanted = math.copysign(min(abs(math.atan(turn * base / distance)), largest), turn)
    steering = towards(wanted, state[1], rate)
    velocity = towards(distance, state[0], acceleration)
    return (velocity, steering), velocity, velocity * math.tan(steering) / base
