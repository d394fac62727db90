"""An L-shaped arena with obstacles, which block motion and hide targets from robots."""

from __future__ import annotations

from teamsight import Circle, Polygon, Robot, Sensor, Target, World

ELL = Polygon([(0, 0), (8, 0), (8, 4), (4, 4), (4, 8), (0, 8)])
ARENA = ELL.with_obstacles(Circle((2, 2), 0.8), Polygon([(5, 1), (7, 1), (7, 3), (5, 3)]), Circle((2, 6), 0.8))


def observe(sensor: Sensor) -> World:
    """Return a world after a run in which the robots have this sensor; it does not change where they walk."""
    world = World(ARENA, rng=1)
    robots = world.add(Robot, 6, policy="random-walk", sensing_range=3.0)
    targets = world.add(Target, 15, policy="random-walk", speed=0.075)
    world.senses(robots, targets, sensor=sensor)
    world.run(300)
    return world


def main() -> None:
    for name, sensor in (("cameras", Sensor()), ("radio, through walls", Sensor(occluded=False))):
        world = observe(sensor)
        print(f"{name}: {world.observed_fraction:.1%} of the targets observed; path: {world.path}")


if __name__ == "__main__":
    main()
