"""A model small enough to see through: in each step all robots are thrown anew, uniformly over the arena."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from teamsight.world.arena import Disc
from teamsight.world.proximity import ProximityGraph, proximity_graph


class Robots:
    """As many robots, all alike."""

    def __init__(self, count: int) -> None:
        self.position = self.heading = np.zeros((count, 2))
        self.awareness_range = np.ones(count)
        self.bodies = SimpleNamespace(speed=np.full(count, 10.0))

    def __len__(self) -> int:
        return len(self.position)


class Snapshots:
    """For these robots the closed form is exact but for their dependence within a snapshot."""

    opened = closed = 0

    def __init__(self, seed: int, robots: int = 8, radius: float = 2.5) -> None:
        self.rng = np.random.default_rng(seed)
        self.arena, self.robots = Disc(radius), Robots(robots)
        self.max_neighbours = 0
        type(self).opened += 1
        self._throw()

    def _throw(self) -> None:
        size = len(self.robots)
        self.robots.position = self.arena.place(*self.rng.uniform(size=(2, size)))
        self.robots.heading = self.rng.normal(size=(size, 2))

    @property
    def proximity(self) -> ProximityGraph:
        return proximity_graph(self.robots.position, None, self.robots.awareness_range)

    def run(self, steps: int) -> None:
        for _ in range(steps):
            self._throw()
            self.max_neighbours = max(self.max_neighbours, int(self.proximity.degree.max()))

    def close(self) -> None:
        type(self).closed += 1
