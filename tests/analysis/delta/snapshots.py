"""A model small enough to see through: in each step all robots are thrown anew, uniformly over the arena."""

from __future__ import annotations

import numpy as np

from teamsight import Disc, Robot, World
from teamsight.policies import Stationary


class Snapshots(World):
    """For these robots the closed form is exact but for their dependence within a snapshot."""

    opened = closed = 0

    def __init__(self, seed: int, robots: int = 8, radius: float = 2.5) -> None:
        super().__init__(Disc(radius), rng=seed)
        self.throws = np.random.default_rng(seed)
        # Their speed is that of the throws, which are as good as independent.
        self.robots = self.add(Robot, robots, policy=Stationary(), speed=10.0)
        type(self).opened += 1

    def _throw(self) -> None:
        size = len(self.robots)
        places = self.arena.place(*self.throws.uniform(size=(2, size)))
        for robot, place, heading in zip(self.robots, places, self.throws.normal(size=(size, 2)), strict=True):
            robot.position, robot.heading = place, heading

    def run(self, steps: int) -> None:
        for _ in range(steps):
            self._throw()
            super().run(1)

    def close(self) -> None:
        type(self).closed += 1
        super().close()
