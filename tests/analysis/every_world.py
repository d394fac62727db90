"""Worlds that are not the paper's, for tests of analyses: several groups, teams and roles, and classes of one's own."""

from __future__ import annotations

from teamsight import Body, Box, Circle, Disc, Robot, Sensor, Target, Torus, World
from teamsight.policies import RandomWalk


class Zoo(World):
    """Three groups on two teams, prey, beacons and arrivals in a torus; its first parameter is not a seed.

    Guards have ranges of their own, foes a sensor that misses teammates; two scouts arrive at tick 10.
    """

    def __init__(self, scouts: int = 4, side: float = 6.0, rng: int | None = None) -> None:
        super().__init__(Torus(side, side), rng=rng)
        walk = RandomWalk(turn_probability=1.0, random_distance=True)
        self.scouts = self.add(Robot, scouts, policy=walk, awareness="ring", awareness_range=1.5, name="scouts")
        self.guards = self.add(
            Robot, 3, policy="a-cmommt", awareness="pairwise", awareness_range=[0.5, 1, 2], speed=0.2, name="guards"
        )
        self.foes = self.add(Robot, 5, policy="centroid", team="rivals", name="foes")
        self.prey = self.add(Target, 6, policy="stationary", name="prey")
        self.beacons = self.add(Body, 2, policy="stationary", name="beacons")
        self.senses(self.scouts, self.prey, sensor=Sensor(missed=0.1, range_noise=0.05))
        self.senses(self.scouts, self.beacons, as_="beacons")
        self.senses(self.guards, self.foes, as_="rivals")
        self.senses(self.foes, self.prey)
        self.foes.sensors["teammates"] = Sensor(field_of_view=3.0, missed=0.2)
        self.clock.at(10, self.arrive)

    def arrive(self) -> None:
        """Add two scouts."""
        self.scouts.add(2)


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


def obstructed(rng: int) -> World:
    """Return a team in an annulus, whose inner wall blocks sight."""
    world = World(Disc(2.0).with_obstacles(Circle((0.0, 0.0), 0.8)), rng=rng)
    robots = world.add(Robot, 8, policy=RandomWalk(), awareness="ring", awareness_range=2.0)
    world.senses(robots, world.add(Target, 5, policy=RandomWalk()))
    return world


def only_by_seed(seed: int) -> World:
    """Return a world whose factory has no parameter rng."""
    return Zoo(rng=seed)


def without_a_world(**setting: int) -> None:
    """Return nothing."""
