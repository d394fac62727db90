"""Worlds that are not the paper's, for tests of analyses: several groups, teams and roles, and classes of one's own."""

from __future__ import annotations

from typing import ClassVar

from teamsight import Box, Robot, Target, Torus, World
from teamsight.policies import RandomWalk


class Rival(Robot):
    team: ClassVar[str | None] = "rivals"


class Zoo(World):
    """Three groups on two teams, beacons and arrivals in a torus; its first parameter is not a seed.

    Guards have ranges of their own; two robots arrive at tick 10.
    """

    def __init__(self, scouts: int = 4, side: float = 6.0, rng: int | None = None) -> None:
        super().__init__(Torus(side, side), rng=rng)
        walk = RandomWalk(turn_probability=1.0, random_distance=True)
        self.scouts = self.add(Robot, scouts, policy=walk, awareness="ring", awareness_range=1.5, name="scouts")
        self.guards = self.add(
            Robot, 3, policy="a-cmommt", awareness="pairwise", awareness_range=[0.5, 1, 2], speed=0.2, name="guards"
        )
        self.foes = self.add(Rival, 5, policy="centroid", name="foes")
        self.beacons = self.add(Target, 6, policy="stationary", name="beacons")
        for observers, observed in (
            (self.scouts, self.beacons), (self.guards, self.foes), (self.foes, self.beacons),
        ):  # fmt: skip
            self.senses(observers, observed)
        self.clock.at(10, self.arrive)

    def arrive(self) -> None:
        """Add two robots."""
        self.senses(self.add(Robot, 2, policy=RandomWalk(), name="late"), self.beacons)


class Two(World):
    """Two groups of robots with different awareness, and targets, in a box."""

    def __init__(self, first: int = 5, rng: int | None = None) -> None:
        super().__init__(Box(4, 3), rng=rng)
        walk = RandomWalk(turn_probability=1.0, random_distance=True)
        self.first = self.add(Robot, first, policy=walk, awareness="ring", name="first")
        self.second = self.add(Robot, 2, policy=walk, awareness="pairwise", awareness_range=2.0, name="second")
        self.prey = self.add(Target, 6, policy=RandomWalk(), speed=0.05, name="prey")
        self.senses(self.first, self.prey)
        self.senses(self.second, self.prey)


def only_by_seed(seed: int) -> World:
    """Return a world whose factory has no parameter rng."""
    return Zoo(rng=seed)


def without_a_world(**setting: int) -> None:
    """Return nothing."""
