"""Slow twin of `LazyRegression`: what a situation shows as a list, and the rule that follows it, one robot at a time."""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

Numbers = Sequence[float]


class Reading(NamedTuple):
    """Something that is sensed, relative to the heading, in units of its range."""

    kind: str
    distance: float
    way: complex  # its direction, of length 1

    @property
    def place(self) -> complex:
        return self.distance * self.way


def sensed(situation: Numbers, own: int, layout: str, ratio: float) -> list[Reading]:
    """All that a situation shows; `ratio` is the awareness range over the sensing range."""

    def shown(kind: str, distance: float, turns: float) -> list[Reading]:
        return [Reading(kind, max(distance, 0.0), cmath.rect(1.0, 2 * math.pi * turns))] if distance < 1 else []

    added = situation[own:]
    targets = [one for k in range(own) for one in shown("free target", situation[k], k / own)]
    teammates = []
    if layout == "sectors":
        teammates = [one for k in range(len(added)) for one in shown("teammate", added[k], k / len(added))]
    if layout == "offsets":
        teammates = [one for k in range(0, len(added), 2) for one in shown("teammate", added[k], added[k + 1])]

    def is_taken(target: Reading) -> bool:
        # A tie goes to nobody; rounding does not decide one.
        return any(abs(ratio * teammate.place - target.place) < target.distance - 1e-9 for teammate in teammates)

    return [one._replace(kind="taken target") if is_taken(one) else one for one in targets] + teammates


def read(memory: Any, inputs: int, layout: str, ratio: float, stride: float) -> list[tuple[str, int, float, float]]:
    """Kind, transition, and distance before and after the robot's own move, of all readings of a memory."""
    found = []
    for number, (situation, (rotation, share)) in enumerate(zip(memory.situation, memory.action, strict=True)):
        move = cmath.rect(stride * float(share), float(rotation))
        for one in sensed([float(reading) for reading in situation[:inputs]], memory.own, layout, ratio):
            own_move = move / ratio if one.kind == "teammate" else move
            found.append((one.kind, number, one.distance, abs(one.place - own_move)))
    return found


def force(law: Numbers, distance: float) -> float:
    """The force at a distance, linear between the points of the law."""
    at = distance * (len(law) - 1)
    point = min(math.floor(at), len(law) - 2)
    return law[point] + (at - point) * (law[point + 1] - law[point])


def decide(forces: Any, situation: Numbers, own: int, layout: str, ratio: float) -> complex:
    """The sum of the forces, relative to the heading."""
    return sum((force(forces[one.kind], one.distance) * one.way for one in sensed(situation, own, layout, ratio)), 0j)
