"""The motor schemas: vectors towards a goal, away from obstacles and teammates, and noise.

Notes
-----
*Source:* Arkin (1989) for the linear repulsion; T. Balch and R. C. Arkin, "Communication in reactive multiagent robotic
systems" (Autonomous Robots 1, 1994).
"""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.angles import direction
from teamsight.core.kernel import inlined


@inlined
def repulsion(distance: float, sphere: float) -> float:
    """Return the length of the vector away from something: 1 at distance 0, 0 from the sphere on, linear in between."""
    return min(max((sphere - distance) / sphere, 0.0), 1.0)


@inlined
def home_offset(i: int, percept: Any) -> tuple[float, float]:
    """Return the offset from robot `i` to its home; (0, 0) if it does not sense it."""
    seen = percept.channels.home
    if seen.start[i] == seen.start[i + 1]:
        return 0.0, 0.0
    return seen.offset[seen.start[i], 0], seen.offset[seen.start[i], 1]


@inlined
def avoid_obstacles(home_x: float, home_y: float, obstacles: Any, sphere: float) -> tuple[float, float]:
    """Return the sum of the vectors away from round obstacles: rows of x and y from home, and radius."""
    sum_x = 0.0
    sum_y = 0.0
    for row in range(obstacles.shape[0]):
        x = -home_x - obstacles[row, 0]
        y = -home_y - obstacles[row, 1]
        reach = obstacles[row, 2] + sphere
        square = x * x + y * y
        if 0.0 < square < reach * reach:
            length = math.sqrt(square)
            share = repulsion(length - obstacles[row, 2], sphere) / length
            sum_x += share * x
            sum_y += share * y
    return sum_x, sum_y


@inlined
def avoid_teammates(i: int, percept: Any, sphere: float) -> tuple[float, float]:
    """Return the sum of the vectors away from teammates; those at the same place do not count."""
    seen = percept.teammates
    sum_x = 0.0
    sum_y = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        distance = seen.distance[k]
        if 1e-9 < distance < sphere:
            share = repulsion(distance, sphere) / distance
            sum_x -= share * seen.offset[k, 0]
            sum_y -= share * seen.offset[k, 1]
    return sum_x, sum_y


@inlined
def persistent_noise(i: int, state: Any, persistence: float, share: float) -> tuple[float, float]:
    """Return a random direction that stays for some steps; `share` of a turn is the next one."""
    if state.ints[i, 0, 0] <= 0:
        x, y = direction(share)
        state.floats[i, 0, 3] = x
        state.floats[i, 0, 4] = y
        state.ints[i, 0, 0] = int(persistence)
    state.ints[i, 0, 0] -= 1
    return state.floats[i, 0, 3], state.floats[i, 0, 4]
