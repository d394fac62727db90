"""Recovery from stagnation: a robot that pushes in vain turns its push, and then goes to another side of the box."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.actions import go, turned_by
from teamsight.policies.braitenberg.readings import nearest

# The counters of a robot: steps of stagnation, steps of recovery that are left, attempts since the box moved.
_STUCK, _LEFT, _ATTEMPTS = range(3)
# A box that moves less than this share of the robot's speed in a step does not move.
_STILL = 0.02
# The largest turn of a push to either side, in turns.
_REALIGNMENT = 0.125


@inlined
def _starts(i: int, state: Any, patience: float, random: float) -> None:
    """Begin a recovery: an odd attempt turns the push by a random angle, an even one goes round to a random side."""
    state.ints[i, 0, _STUCK] = 0
    state.ints[i, 0, _ATTEMPTS] += 1
    state.ints[i, 0, _LEFT] = int(patience)
    if state.ints[i, 0, _ATTEMPTS] % 2 == 1:
        state.floats[i, 0, 0] = _REALIGNMENT * (2.0 * random - 1.0)
    else:
        state.floats[i, 0, 0] = 0.25 if random < 0.5 else -0.25


@inlined
def recovers(i: int, percept: Any, arrays: Any, random: float, action: Any) -> bool:
    """Write the action of robot `i` if it recovers from stagnation, and return whether it does."""
    parameters, state = arrays.parameters, arrays.state
    patience, contact = parameters[5], parameters[6]
    distance, x, y = nearest(i, percept.targets)
    if patience <= 0.0 or distance == math.inf:
        return False
    moved = percept.moved[i, 0] ** 2 + percept.moved[i, 1] ** 2
    still = _STILL * percept.speed[i]
    if state.ints[i, 0, _LEFT] == 0:
        if distance > contact or moved > still * still:
            state.ints[i, 0, _STUCK] = 0
            if distance <= contact:
                state.ints[i, 0, _ATTEMPTS] = 0
            return False
        state.ints[i, 0, _STUCK] += 1
        if state.ints[i, 0, _STUCK] < patience:
            return False
        _starts(i, state, patience, random)
    state.ints[i, 0, _LEFT] -= 1
    x, y = turned_by(x / distance, y / distance, state.floats[i, 0, 0])
    go(action, i, x, y, percept.speed[i])
    return True
