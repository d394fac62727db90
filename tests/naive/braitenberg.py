"""Braitenberg behaviours and logic trees as their sentences say them, for one robot among places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np


def bearing(heading: np.ndarray, offset: np.ndarray) -> float:
    """The angle from the heading to an offset, anticlockwise."""
    angle = math.atan2(offset[1], offset[0]) - math.atan2(heading[1], heading[0])
    return (angle + math.pi) % (2 * math.pi) - math.pi


def obstacles(policy: Any, heading: np.ndarray, others: Sequence[np.ndarray]) -> tuple[float, float]:
    """How near the nearest obstacle within 60° of the heading is, to the left and to the right."""
    side = {True: [0.0], False: [0.0]}
    for offset in others:
        angle, near = bearing(heading, offset), 1 - float(np.hypot(*offset)) / policy.obstacle_range
        if near > 0 and abs(angle) <= math.pi / 3:
            side[angle >= 0].append(near)
    return max(side[True]), max(side[False])


def nearest(offsets: Sequence[np.ndarray], reach: float) -> np.ndarray | None:
    """The nearest of offsets within reach."""
    near = sorted((float(np.hypot(*one)), k) for k, one in enumerate(offsets) if np.hypot(*one) <= reach)
    return offsets[near[0][1]] if near else None


def cues(policy: Any, heading: Any, others: Sequence[np.ndarray], box: Any, mate: Any) -> set[str]:
    """The names of the cues that are set; `box` and `mate` are offsets or None."""
    left, right = obstacles(policy, heading, others)
    found = {
        "obstacle left": left > 0, "obstacle right": right > 0, "obstacle near left": left > 0.2,
        "obstacle near right": right > 0.2,
    }  # fmt: skip
    if box is not None:
        found |= {"box": True, "box left": bearing(heading, box) >= 0, "box touched": np.hypot(*box) <= policy.contact}
    if mate is not None:
        found |= {"teammate": True, "teammate left": bearing(heading, mate) >= 0}
        if abs(bearing(heading, mate)) <= math.pi / 3:
            near = float(np.hypot(*mate)) / policy.slow_range
            found |= {
                "teammate ahead": True,
                "teammate ahead in slow range": near <= 1,
                "teammate ahead near": near <= 0.5,
            }
    return {name for name, is_set in found.items() if is_set}


def by_priority(found: set[str]) -> str:
    """The first behaviour whose condition holds."""
    if found & {"obstacle left", "obstacle right"}:
        return "avoid"
    if "box" in found:
        return "goal"
    if "teammate ahead in slow range" in found:
        return "slow"
    return "follow" if "teammate ahead" in found else "find"


def action(policy: Any, behaviour: str, heading: Any, others: Any, box: Any, mate: Any) -> tuple[float, float]:
    """The rotation [rad] and the distance [share of the speed] of a behaviour without swerving."""
    if behaviour == "avoid":
        left, right = obstacles(policy, heading, others)
        wheels = 1.2 - 4 * right, 1.0 - 4 * left
    elif behaviour in ("goal", "follow"):
        angle = bearing(heading, box if behaviour == "goal" else mate)
        eyes = [(1 + math.cos(angle - side)) / 2 for side in (math.pi / 4, -math.pi / 4)]
        wheels = eyes[1], eyes[0]
    else:
        wheels = (0.5, 0.5) if behaviour == "slow" else (1.0, 1.0)
    left, right = (min(max(wheel, -1.0), 1.0) for wheel in wheels)
    return policy.agility * math.pi * (right - left), max((left + right) / 2, 0.0)


def tree(row: Sequence[float], bits: int, node: int = 0) -> bool:
    """The value of a logic tree, from the root to the leaves."""
    leaves = (len(row) + 1) // 2
    if node >= leaves - 1:
        literal = int(row[node - leaves + 1])
        return bool(bits >> (abs(literal) - 1) & 1) == (literal > 0)
    left, right = tree(row, bits, 2 * node + 1), tree(row, bits, 2 * node + 2)
    return {0: left and right, 1: right, 2: left, 3: left or right}[int(row[leaves + node])]


def elected(rows: Sequence[Sequence[float]], options: int, bits: int) -> int:
    """The option with the most votes of its trees, the first of several."""
    each = len(rows) // options
    votes = [sum(tree(row, bits) for row in rows[k * each : (k + 1) * each]) for k in range(options)]
    return votes.index(max(votes))
