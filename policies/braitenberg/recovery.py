"""Recovery from stagnation: a robot that pushes in vain turns its push, and then goes to another side of the box."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.actions import go, turned_by
from teamsight.policies.braitenberg.cues import CONTACT, PATIENCE
from teamsight.policies.braitenberg.readings import nearest

#: The whole numbers that a robot keeps: steps of stagnation, steps of recovery that are left, recoveries since it last
#: moved at the box, and the behaviour and the cues of its last decision. While it recovers, the behaviour is −1.
STUCK, LEFT, RECOVERIES, BEHAVIOUR, CUES = range(5)

# A robot at the box that moves by less than this share of its speed pushes in vain.
_STILL = 0.02
# The largest turn of a push to either side, and the turn of a robot that goes round the box [turns].
_REALIGN = 0.125
_REPOSITION = 0.25


@inlined
def _begin(i: int, state: Any, patience: float, random: float) -> None:
    """Begin a recovery: the first turns the push by a random angle, the next goes round to a random side, and so on."""
    state.ints[i, 0, STUCK] = 0
    state.ints[i, 0, RECOVERIES] += 1
    state.ints[i, 0, LEFT] = int(patience)
    if state.ints[i, 0, RECOVERIES] % 2 == 1:
        state.floats[i, 0, 0] = _REALIGN * (2.0 * random - 1.0)
    else:
        state.floats[i, 0, 0] = _REPOSITION if random < 0.5 else -_REPOSITION


@inlined
def _is_due(i: int, percept: Any, arrays: Any, distance: float, random: float) -> bool:
    """Count the steps in which robot `i` pushes in vain, and return whether a recovery begins."""
    state, patience = arrays.state, arrays.parameters[PATIENCE]
    touches = distance <= arrays.parameters[CONTACT]
    moved = percept.moved[i, 0] ** 2 + percept.moved[i, 1] ** 2
    if not touches or moved > (_STILL * percept.speed[i]) ** 2:
        state.ints[i, 0, STUCK] = 0
        if touches:
            state.ints[i, 0, RECOVERIES] = 0
        return False
    state.ints[i, 0, STUCK] += 1
    if state.ints[i, 0, STUCK] < patience:
        return False
    _begin(i, state, patience, random)
    return True


@inlined
def recovers(i: int, percept: Any, arrays: Any, random: float, action: Any) -> bool:
    """Write the action of robot `i` if it recovers from stagnation, and return whether it does."""
    state = arrays.state
    distance, x, y = nearest(i, percept.targets)
    if arrays.parameters[PATIENCE] <= 0.0 or distance == math.inf or distance == 0.0:
        return False
    if state.ints[i, 0, LEFT] == 0 and not _is_due(i, percept, arrays, distance, random):
        return False
    state.ints[i, 0, LEFT] -= 1
    state.ints[i, 0, BEHAVIOUR] = -1
    x, y = turned_by(x / distance, y / distance, state.floats[i, 0, 0])
    go(action, i, x, y, percept.speed[i])
    return True
