"""The law of the box as its sentences say it, one body after the other."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

GOLDEN = 2 * math.pi * 0.6180339887498949


class Outcome(NamedTuple):
    """Where all are after a step, who pushes, and how far the box moved."""

    robots: np.ndarray
    box: np.ndarray
    pushes: np.ndarray
    moved: float


def gap(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.hypot(*(one - other)))


def put_back(place: np.ndarray, centre: np.ndarray, reach: float) -> np.ndarray:
    """A place inside a rim is put on it, straight away from the centre."""
    distance = gap(place, centre)
    if distance >= reach:
        return place
    way = (place - centre) / distance if distance > 1e-9 * reach else np.array([1.0, 0.0])
    return np.asarray(centre + reach * way)


def settled(law: Any, i: int, wanted: np.ndarray, before: np.ndarray, others: dict[int, np.ndarray], box: Any) -> Any:
    """Where robot i comes to rest among the box and the others, given where each of them is now."""
    reach, apart = law.box_radius + law.robot_radius, 2 * law.robot_radius

    def hit(place: np.ndarray) -> list[int]:
        return [j for j in sorted(others) if gap(place, others[j]) < apart * (1 - 1e-9)]

    def fits(place: np.ndarray) -> bool:
        is_inside = np.abs(place).max() <= law.side / 2
        return bool(is_inside and gap(place, box) >= reach * (1 - 1e-9) and not hit(place))

    place = wanted
    for _ in range(16):
        place = put_back(place, box, reach)
        if not hit(place):
            break
        place = put_back(place, others[hit(place)[0]], apart)
    if fits(place):
        return place
    if fits(before):
        return before
    for k in range(400):
        way = np.array([math.cos(k * GOLDEN), math.sin(k * GOLDEN)])
        place = before + 0.5 * apart * math.sqrt(k + 1) * way
        if fits(place):
            return place
    return np.full(2, np.nan)


def pushed(law: Any, wanted: np.ndarray, before: np.ndarray, heading: np.ndarray, box: np.ndarray) -> Outcome:
    """What follows from the places where robots want to go, from where they were, their headings, and the box."""
    reach, apart, count = law.box_radius + law.robot_radius, 2 * law.robot_radius, len(wanted)
    limit = law.side / 2 * (1 - 1e-9) - reach
    box = np.clip(box, -limit, limit)
    place = before.copy()
    for i in range(count):
        place[i] = settled(law, i, wanted[i], before[i], {j: place[j] for j in range(count) if j != i}, box)
    pushes = np.array([
        gap(place[i], box) <= reach + law.contact and (wanted[i] != before[i]).any() and heading[i] @ (box - place[i]) > 0
        for i in range(count)
    ], bool)  # fmt: skip
    force = heading[pushes].sum(axis=0)
    strength = float(np.hypot(*force))
    if strength <= law.threshold:
        return Outcome(place, box, pushes, 0.0)
    to = np.clip(box + law.box_speed * (strength - law.threshold) * force / strength, -limit, limit)
    aside = np.array([put_back(one, to, reach) for one in place])
    for i in range(count):
        others = [gap(aside[i], aside[j]) for j in range(count) if j != i]
        if (aside[i] != place[i]).any() and min(others, default=apart) < apart * (1 - 1e-9):
            return Outcome(place, box, pushes, 0.0)
    return Outcome(aside, to, pushes, gap(to, box))
