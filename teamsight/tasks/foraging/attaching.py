"""How robots are attached to attractors, and released."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined

#: What interactions keep of robots: whether each is attached, the identity of its attractor (0 for none), its own
#: speed, and the speed that it has with its load.
ROBOT_COLUMNS = (
    ("robots", "attached", 0), ("robots", "attractor", 0), ("robots", "free_speed", 0.0), ("robots", "slow_speed", 0.0),
)  # fmt: skip
#: What they keep of attractors: the mass that is left, and the number of robots that are attached.
ATTRACTOR_COLUMNS = (("attractors", "mass", 5.0), ("attractors", "robots_at_it", 0))


@inlined
def release(robots: Any, i: int) -> None:
    """Let robot `i` go."""
    robots.speed[i] = robots.free_speed[i]
    robots.attached[i] = 0
    robots.attractor[i] = 0


@inlined
def slow_down(robots: Any, i: int, speed: float) -> None:
    """Give robot `i` the speed that it has while it is attached."""
    robots.speed[i] = speed
    robots.slow_speed[i] = speed


@inlined
def is_held(robots: Any, i: int, attractors: Any, j: int) -> bool:
    """Whether robot `i` is attached to attractor `j`."""
    return bool(robots.attractor[i] == attractors.identity[j])


@inlined
def _row_of_held(robots: Any, i: int, attractors: Any) -> int:
    """Return the row of the attractor to which robot `i` is attached; −1 if it cannot hold on to it."""
    for j in range(attractors.position.shape[0]):
        if is_held(robots, i, attractors, j):
            return j if attractors.active[j] and attractors.mass[j] > 0.0 and robots.active[i] else -1
    return -1


@inlined
def _attach(robots: Any, attractors: Any, i: int, reach: float) -> int:
    """Attach robot `i` to the nearest attractor within reach that has mass; return its row, −1 for none."""
    nearest = reach
    found = -1
    for j in range(attractors.position.shape[0]):
        x = attractors.position[j, 0] - robots.position[i, 0]
        y = attractors.position[j, 1] - robots.position[i, 1]
        distance = math.sqrt(x * x + y * y)
        if attractors.active[j] and attractors.mass[j] > 0.0 and distance <= nearest:
            if found >= 0 and distance == nearest:
                continue
            nearest = distance
            found = j
    if found >= 0:
        robots.free_speed[i] = robots.speed[i]
        robots.slow_speed[i] = robots.speed[i]
        robots.attached[i] = 1
        robots.attractor[i] = attractors.identity[found]
    return found


@inlined
def attach_all(robots: Any, attractors: Any, reach: float) -> None:
    """Attach free robots, release those that cannot hold on, and count the robots at each attractor."""
    for j in range(attractors.position.shape[0]):
        attractors.robots_at_it[j] = 0
    for i in range(robots.position.shape[0]):
        held = -1
        if robots.attractor[i] != 0:
            if robots.speed[i] != robots.slow_speed[i]:
                # Somebody has set it since; so it is what the robot has without a load.
                robots.free_speed[i] = robots.speed[i]
            held = _row_of_held(robots, i, attractors)
            if held < 0:
                release(robots, i)
        if held < 0 and robots.active[i]:
            held = _attach(robots, attractors, i, reach)
        if held >= 0:
            attractors.robots_at_it[held] += 1
