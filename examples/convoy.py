"""A convoy with failures: each robot follows the next one ahead, so the gap of one that fails closes."""

from __future__ import annotations

import numpy as np

from teamsight import Failures, Robot, Torus, Weibull, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, RandomWalk, go

GAP, LENGTH = 0.5, 60.0


@kernel
def _follow(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    for i in range(len(percept.heading)):
        ahead = percept.awareness_range[i] + GAP
        for k in range(percept.teammates.start[i], percept.teammates.start[i + 1]):
            x = percept.teammates.offset[k, 0]
            if 0.0 < x < ahead:
                ahead = x
        # One that sees nobody ahead drives as fast as it can, to catch up.
        go(action, i, 1.0, 0.0, min(max(ahead - GAP, 0.0), percept.speed[i]))


class Follow(CompiledPolicy):
    kernel, needs = _follow, ("teammates",)


world = World(Torus(LENGTH, 10), rng=2)
place = np.column_stack([-GAP * np.arange(1, 13), np.zeros(12)])
leader = world.add(
    Robot, 1, policy=RandomWalk(turn_probability=0.0), position=(0, 0), heading=(1, 0), speed=0.1, name="leader"
)
trucks = world.add(Robot, 12, policy=Follow(), awareness="pairwise", awareness_range=4, position=place, speed=0.2)
world.attach(Failures(Weibull(1_500, 1.5), 60), trucks)
for _ in range(10):
    world.run(100)
    behind = np.sort((leader.position[0, 0] - trucks.position[trucks.active, 0]) % LENGTH)
    gaps = np.diff([0.0, *behind])
    late = len(behind) - np.count_nonzero(np.cumprod(gaps < 2 * GAP))
    line = gaps[: len(gaps) - late]
    print(
        f"tick {world.tick}: {12 - len(behind)} have failed, {late} are catching up, and {len(line)} follow the leader "
        f"at {line.min():.2f} to {line.max():.2f}"
    )
print(f"{(world.events['what'] == 'failed').sum()} failures; path: {world.path}")
