"""Slow twins of the three measures of evenness: from positions, one step, robot and target at a time."""

from __future__ import annotations

import math
import statistics
from typing import Any


class Evenness:
    """Who was observed by how many, read from a world after each of its steps."""

    def __init__(self) -> None:
        self.seen: dict[int, list[int]] = {}

    def look(self, robots: Any, targets: Any) -> None:
        """Write down for each active target how many active robots are within their sensing range of it."""
        for target in targets:
            if target.active:
                near = sum(
                    robot.active and math.dist(robot.position, target.position) <= robot.sensing_range
                    for robot in robots
                )
                self.seen.setdefault(target.unique_id, []).append(near)

    @property
    def counts(self) -> dict[int, tuple[int, int, int]]:
        """For each target its steps, those in which it was observed, and by how many robots in all."""
        return {one: (len(row), sum(near > 0 for near in row), sum(row)) for one, row in self.seen.items()}

    @property
    def spread(self) -> float:
        return statistics.pstdev(observed / steps for steps, observed, _ in self.counts.values())

    @property
    def entropy(self) -> float:
        times = [observed for _, observed, _ in self.counts.values() if observed]
        return math.log(sum(times)) - sum(one * math.log(one) for one in times) / sum(times)

    @property
    def redundancy(self) -> float:
        return statistics.mean(near for row in self.seen.values() for near in row if near)
