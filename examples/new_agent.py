"""Define a new kind of robot: carriers that run out of charge, in a team with scouts that have longer ranges.

A subclass of Robot may override `decide` and call the group's policy by ``super().decide``. What its ``__init__`` takes
is given to `World.add`: one value for all, or a list with one for each.
"""

from __future__ import annotations

import numpy as np

from teamsight import Disc, Robot, Target, World
from teamsight.policies import ACmommt, RandomWalk
from teamsight.policies.percept_of_one import PerceptOfOne


class Carrier(Robot):
    """A robot that spends charge as it moves, and stops when none is left."""

    def __init__(self, model: World, charge: float = 15.0) -> None:
        super().__init__(model)
        self.charge = charge

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        distance = min(distance, self.charge)
        self.charge -= distance
        return turn, distance


def build(seed: int) -> World:
    """Return a world with two groups of robots, which are teammates, and one of targets."""
    world = World(Disc(5.0), rng=seed)
    charges = [10.0, 10.0, 12.0, 12.0, 14.0, 14.0, 15.0, 15.0]
    carriers = world.add(Carrier, 8, policy=ACmommt(), awareness="pairwise", speed=0.1, charge=charges)
    scouts = world.add(
        Robot, 2, policy=ACmommt(), awareness="shared", name="scouts", speed=0.2, sensing_range=1.5, awareness_range=2.0
    )
    targets = world.add(Target, 15, policy=RandomWalk(turn_probability=0.05), speed=0.075)
    world.senses(carriers, targets)
    world.senses(scouts, targets)
    return world


def main() -> None:
    world = build(seed=1)
    carriers = [agent for agent in world.groups[0] if isinstance(agent, Carrier)]
    for _ in range(200):
        world.step()
    print(f"observed: {world.observed_fraction:.0%} of the targets")
    charge = [robot.charge for robot in carriers]
    print(f"charge left: {min(charge):.1f} to {max(charge):.1f}")
    print(f"the largest number of neighbours: {world.max_neighbours}; the run was {world.path}")


if __name__ == "__main__":
    main()
