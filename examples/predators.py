"""Predators hunt robots, and robots flee: roles are groups, and channels say who senses whom."""

from __future__ import annotations

import math

from teamsight import Body, Box, Robot, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, go


@kernel
def _flee(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    seen = percept.channels.predators
    for i in range(len(percept.heading)):
        x, y = 0.0, 0.0
        for k in range(seen.start[i], seen.start[i + 1]):
            x, y = x - seen.offset[k, 0], y - seen.offset[k, 1]
        go(action, i, x, y, percept.speed[i] if x or y else 0.0)


class Flee(CompiledPolicy):
    kernel, channels = _flee, ("predators",)


for policy in ("stationary", Flee()):
    world = World(Box(12, 12), rng=1)
    robots = world.add(Robot, 30, policy=policy)
    predators = world.add(Body, 3, policy="centroid", policy_options={"idle": "wander"}, name="predators")
    world.senses(predators, robots)
    world.senses(robots, predators, as_="predators")
    for _ in range(100):
        world.run(5)
        for predator in predators:
            for robot in predator.sensed("targets"):
                if math.dist(predator.position, robot.position) < 0.2:
                    robot.remove()
    print(f"{type(robots.policy).__name__}: {30 - len(robots)} of 30 robots caught; path: {world.path}")
