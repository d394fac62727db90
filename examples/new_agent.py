"""Define a new kind of robot: carriers that run out of charge, in a team with scouts that have longer ranges.

A subclass of Robot may override `decide` and call the group's policy by ``super().decide``.
"""

from __future__ import annotations

from typing import Any

from teamsight import Disc, Robot, Target, World
from teamsight.policies import ACmommt, RandomWalk


class Carrier(Robot):
    """A robot that spends charge as it moves, and stops when none is left."""

    charge = 15.0

    def decide(self, percept: Any, rng: Any) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        distance = min(distance, self.charge)
        self.charge -= distance
        return turn, distance


def build(seed: int) -> World:
    """Return a world with two groups of robots, which are teammates, and one of targets."""
    world = World(Disc(5.0), rng=seed)
    carriers = world.add(Carrier, 8, policy=ACmommt(), awareness="pairwise", speed=0.1)
    scouts = world.add(
        Robot, 2, policy=ACmommt(), awareness="shared", name="scouts", speed=0.2, sensing_range=1.5, awareness_range=2.0
    )
    targets = world.add(Target, 15, policy=RandomWalk(turn_probability=0.05), speed=0.075)
    world.senses(carriers, targets)
    world.senses(scouts, targets)
    return world


def main() -> None:
    world = build(seed=1)
    carriers = world.groups[0]
    for _ in range(200):
        world.step()
    print(f"observed: {world.observed_fraction:.0%} of the targets")
    charge = [robot.charge for robot in carriers]
    print(f"charge left: {min(charge):.1f} to {max(charge):.1f}")
    print(f"the largest number of neighbours: {world.max_neighbours}")


if __name__ == "__main__":
    main()
