"""Robots arrive at a gate every 10 ticks and leave when their battery is empty."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from teamsight import Disc, Robot, Target, World
from teamsight.agents.group import Group


def arrivals(world: World, robots: Group[Robot], rng: np.random.Generator) -> Generator[Any, Any, None]:
    """Let a robot arrive every 10 ticks, with a battery of its own; it leaves as many ticks later."""
    while True:
        yield world.clock.timeout(10)
        battery = int(rng.integers(50, 150))
        (robot,) = robots.add(position=(0, 4.9), battery=battery)
        world.clock.at(world.clock.now + battery, robot.remove)


def main() -> None:
    world = World(Disc(5.0), rng=1)
    robots = world.add(Robot, 2, policy="a-cmommt", awareness="pairwise")
    robots.add_column("battery", 1000)
    world.senses(robots, world.add(Target, 15, policy="random-walk", speed=0.075))
    world.clock.process(arrivals(world, robots, np.random.default_rng(2)))
    for _ in range(5):
        world.run(100)
        now = f"{len(robots):2d} robots, observed now {world.observed:.0%}"
        print(f"tick {world.tick}: {now}, in all {world.observed_fraction:.0%}")
    print(f"{robots.members_so_far - 2} arrived; the run was {world.path}")


if __name__ == "__main__":
    main()
