"""A leader walks at random, and followers keep near it and apart from each other; they sense it farther than others."""

from __future__ import annotations

import math

from teamsight import Disc, Robot, Sensor, World, check_policy
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, RandomWalk, go


@kernel
def _follow(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    leaders, teammates = percept.channels.leader, percept.teammates
    for i in range(len(percept.heading)):
        x, y = 0.0, 0.0
        for k in range(leaders.start[i], leaders.start[i + 1]):
            x, y = x + leaders.offset[k, 0], y + leaders.offset[k, 1]
        for k in range(teammates.start[i], teammates.start[i + 1]):
            square = teammates.distance[k] ** 2 + 1e-9
            x, y = x - 0.1 * teammates.offset[k, 0] / square, y - 0.1 * teammates.offset[k, 1] / square
        go(action, i, x, y, math.sqrt(x * x + y * y))


class Follow(CompiledPolicy):
    kernel, channels, needs = _follow, ("leader",), ("teammates",)


check_policy(Follow())
world = World(Disc(10), rng=1)
leader = world.add(Robot, 1, policy=RandomWalk(turn_probability=0.05), speed=0.05, team=None, name="leader")
followers = world.add(Robot, 8, policy=Follow(), awareness="pairwise", name="followers")
world.senses(followers, leader, as_="leader", sensor=Sensor(range=20.0))
for _ in range(3):
    world.run(100)
    distance = [math.dist(robot.position, leader[0].position) for robot in followers]
    print(f"tick {world.tick}: followers are {min(distance):.1f} to {max(distance):.1f} from the leader")
print(f"path: {world.path}")
