"""Robots with a lidar go where it is free: how much less do they bump into each other?"""

from __future__ import annotations

from dataclasses import dataclass

from teamsight import Box, Circle, Lidar, Polygon, Robot, World, check_policy
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, Policy, PolicyArrays, go

ARENA = Box(8, 6).with_obstacles(
    Circle((2.2, 1.2), 0.7), Circle((-1.5, -1.4), 0.5), Polygon([(-0.2, 0.4), (0.1, 0.4), (0.1, 3.1), (-0.2, 3.1)])
)
LIDAR = Lidar(rays=33, range=2.0, field_of_view=4.0, range_noise=0.01)


@kernel
def _go_free(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    rays = percept.lidar.shape[1]
    for i in range(percept.heading.shape[0]):
        right, left, front = 0.0, 0.0, 1e9
        for j in range(rays):
            free = percept.lidar[i, j]
            right += free if 2 * j < rays - 1 else 0.0
            left += free if 2 * j > rays - 1 else 0.0
            front = min(front, free) if 3 * j >= rays and 3 * j < 2 * rays else front
        # To the side where more is free; at once if something is ahead.
        turn = (left - right) / (left + right + 1e-9)
        turn = turn if front > 2.0 * arrays.parameters[0] else 1.0 if turn > 0.0 else -1.0
        x, y = percept.heading[i, 0], percept.heading[i, 1]
        go(action, i, x - turn * y, y + turn * x, min(percept.speed[i], max(front - arrays.parameters[0], 0.0)))


@dataclass(frozen=True)
class GoFree(CompiledPolicy):
    """Turn to the side where more is free, and keep a gap from what is ahead."""

    gap: float = 0.3
    rays = LIDAR.rays
    kernel = _go_free


def explored(policy: Policy | str, steps: int = 1500) -> World:
    """Return a world in which twelve robots have gone between the obstacles."""
    world = World(ARENA, contact="slide", rng=1)
    world.add(Robot, 12, policy=policy, radius=0.15, speed=0.05, turn_limit=0.3, lidar=LIDAR)
    world.run(steps)
    return world


def main() -> None:
    check_policy(GoFree())
    policies: dict[str, Policy | str] = {"random walk": "random-walk", "go where it is free": GoFree()}
    for name, policy in policies.items():
        world = explored(policy)
        robots = world.groups[0]
        print(f"{name}: {robots.bumps.mean():.1f} bumps a robot, path: {world.path}")
        print(f"  the nearest thing in view of each: {robots.percept.lidar.min(axis=1).round(2)}")


if __name__ == "__main__":
    main()
