"""Robots whose sensor of targets covers 120°, errs in distance and bearing, and misses one target in ten."""

from __future__ import annotations

import math

from teamsight import CMOMMT, Sensor

CAMERA = Sensor(field_of_view=math.radians(120), range_noise=0.05, bearing_noise=math.radians(3), missed=0.1)


def main() -> None:
    for name, sensor in (("perfect", Sensor()), ("120° and noisy", CAMERA)):
        model = CMOMMT(sensor=sensor, rng=1)
        model.run(600)
        print(f"{name}: {model.observed_fraction:.1%} of the targets observed; path: {model.path}")
    robot = model.robots[0]
    target, distance = robot.sensed("targets")[0], robot.percept.targets.distance[0]
    print(f"{robot}: {target} at {distance:.3f}, and it is at {math.dist(robot.position, target.position):.3f}")


if __name__ == "__main__":
    main()
