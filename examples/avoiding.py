"""Avoiding: 200 robots on a circle exchange places with those opposite, all at once, without a bump."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from teamsight import Disc, Robot, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, Avoiding, CompiledPolicy, Floats, Percept, Policy, PolicyArrays, PolicyState, go

ROBOTS, CIRCLE, RADIUS, SPEED = 200, 15.0, 0.1, 0.05
SWERVE = 0.2


@kernel
def _cross(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    way = arrays.state.floats
    for i in range(len(percept.heading)):
        for axis in range(2):
            if percept.time[0] == 0.0:
                way[i, 0, axis] = arrays.parameters[0] * percept.heading[i, axis]
            way[i, 0, axis] -= percept.moved[i, axis]
        x, y = way[i, 0, 0], way[i, 0, 1]
        # Without a little chance all would meet in the middle, and nobody would have a reason to go left or right.
        swerve = SWERVE * (noise[0, i] - 0.5)
        go(action, i, x - swerve * y, y + swerve * x, min(math.sqrt(x * x + y * y), percept.speed[i]))


@dataclass(frozen=True)
class Cross(CompiledPolicy):
    """Go some way in the direction of the first heading, by odometry, and nearly straight; it knows of nobody."""

    distance: float = 2 * CIRCLE

    kernel, draws = _cross, 1

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 1, 2)), np.zeros((size, 0, 0), np.int64))


def circle(policy: Policy, seed: int = 1) -> World:
    """Return robots on a circle that look to its centre."""
    turn = 2 * math.pi * np.arange(ROBOTS) / ROBOTS
    out = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    world = World(Disc(CIRCLE + 2), contact="stop", rng=seed)
    world.add(
        Robot, ROBOTS, policy=policy, position=CIRCLE * out, heading=-out, radius=RADIUS, speed=SPEED,
        awareness="pairwise", awareness_range=10 * RADIUS,
    )  # fmt: skip
    return world


def arrived(world: World, start: Floats) -> int:
    """Return how many robots are where the opposite one was, to within their radius."""
    return int((np.hypot(*(world.groups[0].position + start).T) < RADIUS).sum())


def main() -> None:
    for name, policy in (("alone", Cross()), ("avoiding", Avoiding(Cross()))):
        world = circle(policy)
        start = world.groups[0].position.copy()
        while arrived(world, start) < ROBOTS and world.tick < 2000:
            world.run(50)
        print(
            f"{name}: {arrived(world, start)} of {ROBOTS} have arrived after {world.tick} steps, with "
            f"{world.groups[0].bumps.sum()} bumps; path: {world.path}"
        )


if __name__ == "__main__":
    main()
