"""What bodies and drives cost: teams of 30 robots beside 30 points that move freely; and crowds of 5,000.

``python benchmarks/bodies.py`` prints a line for each kind of contact, of sight and of drive.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from typing import Any

from measure import cpu_seconds, interleave

from teamsight import CMOMMT, Box, Car, DifferentialDrive, Lidar, Robot, Sensor, World

ROUNDS, STEPS = 11, 1500
CROWD, SIDE = 5000, 100.0


def team(**bodies: Any) -> CMOMMT:
    """Return a team of 30 robots."""
    return CMOMMT(30, 15, policy="a-cmommt", rng=1, **bodies)


def crowd(contact: Any, share: float, sensor: Sensor | None = None) -> World:
    """Return robots that wander, whose bodies cover this share of a box, with this sensor of teammates."""
    world = World(Box(SIDE, SIDE), contact=contact, rng=1)
    radius = math.sqrt(share * SIDE**2 / CROWD / math.pi)
    robots = world.add(Robot, CROWD, policy="random-walk", radius=radius, speed=0.1)
    if sensor is not None:
        robots.sensors["teammates"] = sensor
    return world


def compare(worlds: dict[str, World], steps: int, rounds: int) -> None:
    """Print the time of a step of each, and its ratio to the first."""

    def action(world: World) -> Callable[[], float]:
        return lambda: cpu_seconds(lambda: world.run(steps)) / steps

    for world in worlds.values():
        world.run(20)
    taken = interleave({name: action(world) for name, world in worlds.items()}, rounds)
    least = {name: statistics.median(times) for name, times in taken.items()}
    first = next(iter(least.values()))
    for name, time in least.items():
        print(f"{name}: {time * 1e6:.2f} µs a step, {time / first:.2f} times the first")


def main() -> None:
    """Compare all."""
    compare({
        "30 robots, points": team(),
        "radius 0.1, pass": team(robot_radius=0.1),
        "radius 0.1, stop": team(robot_radius=0.1, contact="stop"),
        "radius 0.1, slide": team(robot_radius=0.1, contact="slide"),
        "radius 0.2, slide": team(robot_radius=0.2, contact="slide"),
        "robots and targets, radius 0.1, slide": team(robot_radius=0.1, target_radius=0.1, contact="slide"),
    }, STEPS, ROUNDS)  # fmt: skip
    compare({
        "30 robots that move freely": team(),
        "differential drive": team(drive=DifferentialDrive(0.1, 0.02)),
        "car": team(drive=Car(0.1, 0.6, 0.2, 0.02)),
    }, STEPS, ROUNDS)  # fmt: skip
    bodies = {"robot_radius": 0.1, "target_radius": 0.1}
    compare({
        "sight past bodies": team(**bodies),
        "sight blocked by bodies": team(**bodies, sensor=Sensor(occluded="bodies")),
    }, STEPS, ROUNDS)  # fmt: skip
    lidar = Lidar(32, 2.0)
    for name, given in {
        "points": {}, "radius 0.1, pass": bodies, "radius 0.1, slide": {**bodies, "contact": "slide"}
    }.items():  # fmt: skip
        compare({
            f"30 robots, {name}": team(**given), "with a lidar of 32 rays": team(**given, lidar=lidar),
            "of a range of 5": team(**given, lidar=Lidar(32, 5.0)),
        }, STEPS, ROUNDS)  # fmt: skip
    compare({
        "5,000 robots, points": crowd("pass", 0.4),
        "40 % of the area, stop": crowd("stop", 0.4),
        "40 % of the area, slide": crowd("slide", 0.4),
        "5 % of the area, slide": crowd("slide", 0.05),
    }, 20, 5)  # fmt: skip
    compare({
        "5,000 robots, sight past bodies": crowd("pass", 0.4, Sensor(missed=0.0001)),
        "sight blocked by bodies": crowd("pass", 0.4, Sensor(missed=0.0001, occluded="bodies")),
    }, 20, 5)  # fmt: skip


if __name__ == "__main__":
    main()
