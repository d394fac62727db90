"""How robots are attached to attractors, and released."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined

#: What interactions keep of robots: whether each is attached, the row of its attractor from 1 on, and its own speed.
ROBOT_COLUMNS = (("robots", "attached", 0), ("robots", "attractor", 0), ("robots", "free_speed", 0.0))
#: What they keep of attractors: the mass that is left, and the number of robots that are attached.
ATTRACTOR_COLUMNS = (("attractors", "mass", 5.0), ("attractors", "robots_at_it", 0))


@inlined
def release(robots: Any, i: int) -> None:
    """Let robot `i` go."""
    robots.speed[i] = robots.free_speed[i]
    robots.attached[i] = 0
    robots.attractor[i] = 0


@inlined
def _attach(robots: Any, attractors: Any, i: int, reach: float) -> None:
    """Attach robot `i` to the nearest attractor within reach that has mass."""
    nearest = reach
    found = 0
    for j in range(attractors.position.shape[0]):
        x = attractors.position[j, 0] - robots.position[i, 0]
        y = attractors.position[j, 1] - robots.position[i, 1]
        distance = math.sqrt(x * x + y * y)
        if attractors.active[j] and attractors.mass[j] > 0.0 and distance <= nearest:
            if found > 0 and distance == nearest:
                continue
            nearest = distance
            found = j + 1
    if found > 0:
        robots.free_speed[i] = robots.speed[i]
        robots.attached[i] = 1
        robots.attractor[i] = found


@inlined
def attach_all(robots: Any, attractors: Any, reach: float) -> None:
    """Attach free robots, release those that cannot hold on, and count the robots at each attractor."""
    for j in range(attractors.position.shape[0]):
        attractors.robots_at_it[j] = 0
    for i in range(robots.position.shape[0]):
        held = robots.attractor[i]
        if held > 0 and (held > attractors.mass.shape[0] or not robots.active[i] or attractors.mass[held - 1] <= 0.0):
            release(robots, i)
        if robots.attractor[i] == 0 and robots.active[i]:
            _attach(robots, attractors, i, reach)
        if robots.attractor[i] > 0:
            attractors.robots_at_it[robots.attractor[i] - 1] += 1
