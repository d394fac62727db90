"""Slow twins of what environments show: the facts of a step and the layout "nearest", robot by robot."""

from __future__ import annotations

import math
from typing import Any


def sensed(robots: Any, targets: Any, reach: Any) -> list[set[int]]:
    """The targets within the range of each robot, by number."""
    return [
        {t for t in range(len(targets)) if math.dist(robots[i], targets[t]) <= reach[i]} for i in range(len(robots))
    ]


def facts(before: list[set[int]], after: list[set[int]]) -> dict[str, list[float]]:
    """The facts about targets, of each robot, from the sets of targets that robots sensed before and after a step."""

    def alone(all_sets: list[set[int]], i: int) -> set[int]:
        others = set().union(*(one for j, one in enumerate(all_sets) if j != i))
        return all_sets[i] - others

    team_before, team_after = set().union(*before), set().union(*after)
    found: dict[str, list[float]] = {}
    for i in range(len(after)):
        own = {
            "sensed": len(after[i]), "gained": len(after[i] - before[i]), "lost": len(before[i] - after[i]),
            "alone": len(alone(after, i)), "alone_gained": len(alone(after, i) - alone(before, i)),
            "alone_lost": len(alone(before, i) - alone(after, i)), "team_sensed": len(team_after),
            "team_gained": len(team_after - team_before), "team_lost": len(team_before - team_after),
            "share": sum(1 / sum(t in one for one in after) for t in after[i]),
        }  # fmt: skip
        for name, value in own.items():
            found.setdefault(name, []).append(value)
    return found


def nearest(offsets: Any, heading: Any, reach: float, most: int) -> list[float]:
    """The nearest bodies at these offsets: 1, and how far ahead and to the left they are, in ranges; else 0."""
    row: list[float] = []
    for x, y in sorted((tuple(offset) for offset in offsets), key=lambda offset: math.hypot(*offset))[:most]:
        row += [1.0, (x * heading[0] + y * heading[1]) / reach, (y * heading[0] - x * heading[1]) / reach]
    return row + [0.0] * (3 * most - len(row))
