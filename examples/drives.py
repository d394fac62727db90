"""Drives: the same policy on free robots, on two wheels and on a car; what do wheels cost a robot, and a team?"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from teamsight import CMOMMT, Box, Car, DifferentialDrive, Drive, Robot, World, run_many
from teamsight.policies.percept_of_one import PerceptOfOne, turn_to

DRIVES: dict[str, Drive | Literal["free"]] = {
    "free": "free",
    "two wheels, at once": DifferentialDrive(wheel_base=0.2),
    "two wheels": DifferentialDrive(wheel_base=0.2, acceleration=0.01),
    "car": Car(wheel_base=0.2, largest_steering=0.6, steering_rate=0.15, acceleration=0.01),
}
CORNERS = np.array([(2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0)])


class Patrol(Robot):
    """Goes from corner to corner; the next one counts when it is near."""

    corner = 0

    def decide(self, percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        way = CORNERS[self.corner % 4] - self.position
        if math.hypot(*way) < 0.3:
            self.corner += 1
        return turn_to(percept.heading, way), percept.speed


def patrolled(drive: Drive | Literal["free"], steps: int = 600) -> tuple[NDArray[np.float64], int]:
    """Return the path of one robot, and how many corners it has reached."""
    world = World(Box(8, 8), rng=1)
    robots = world.add(Patrol, 1, speed=0.1, position=(2, -2), heading=(0, 1), drive=drive)
    path = []
    for _ in range(steps):
        world.step()
        path.append(robots[0].position.copy())
    return np.array(path), robots[0].corner


def main() -> None:
    for name, drive in DRIVES.items():
        path, corners = patrolled(drive)
        farthest = np.abs(path).max() - 2.0
        print(f"{name}: {corners} corners in {len(path)} steps, up to {farthest:.2f} outside of the square")
    settings = [{"drive": drive} for drive in DRIVES.values()]
    table = run_many(settings, replicates=50, steps=600, rng=1, model=CMOMMT)
    means = table.groupby("drive", sort=False)["observed_fraction"].agg(["mean", "sem"]).round(3)
    print(means.set_axis([*DRIVES]))


if __name__ == "__main__":
    main()
