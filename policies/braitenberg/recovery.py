"""Recovery from stagnation: a robot that pushes in vain turns its push, and then goes to another side of the box."""

from __future__ import annotations

import math
from typing import Any

from teamsight.core.kernel import inlined
from teamsight.policies.actions import go, turned_by
from teamsight.policies.braitenberg.cues import CONTACT, PATIENCE
from teamsight.policies.braitenberg.readings import nearest

#: The whole numbers that a robot keeps: steps of stagnation, steps of recovery that are left, recoveries since the box
#: last moved, and the behaviour and the cues of its last decision. While it recovers, the behaviour is −1.
STUCK, LEFT, RECOVERIES, BEHAVIOUR, CUES = range(5)

# The numbers that it keeps: the turn of its recovery [turns], and the offset of the box at its last decision, (0, 0) if
# it did not sense it.
_TURN, _LAST_X, _LAST_Y = range(3)
# A box that moves by less than this share of the robot's speed between two decisions does not move.
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
        state.floats[i, 0, _TURN] = _REALIGN * (2.0 * random - 1.0)
    else:
        state.floats[i, 0, _TURN] = _REPOSITION if random < 0.5 else -_REPOSITION


@inlined
def _shift(i: int, percept: Any, state: Any, x: float, y: float) -> float:
    """Return how far the box has moved since the last decision, by odometry; 0 if it was not sensed then."""
    last_x = state.floats[i, 0, _LAST_X]
    last_y = state.floats[i, 0, _LAST_Y]
    state.floats[i, 0, _LAST_X] = x
    state.floats[i, 0, _LAST_Y] = y
    if last_x == 0.0 and last_y == 0.0:
        return 0.0
    dx = x + percept.moved[i, 0] - last_x
    dy = y + percept.moved[i, 1] - last_y
    return math.sqrt(dx * dx + dy * dy)


@inlined
def _is_due(i: int, state: Any, touches: bool, moves: bool, patience: float) -> bool:
    """Count the steps in which robot `i` pushes in vain, and return whether a recovery is due."""
    if moves:
        state.ints[i, 0, RECOVERIES] = 0
    if moves or not touches:
        state.ints[i, 0, STUCK] = 0
        return False
    state.ints[i, 0, STUCK] += 1
    return state.ints[i, 0, STUCK] >= patience  # type: ignore[no-any-return]


@inlined
def recovers(i: int, percept: Any, arrays: Any, random: float, action: Any) -> bool:
    """Write the action of robot `i` if it recovers from stagnation, and return whether it does."""
    state, patience = arrays.state, arrays.parameters[PATIENCE]
    distance, x, y = nearest(i, percept.targets)
    if patience <= 0.0 or distance == math.inf or distance == 0.0:
        state.floats[i, 0, _LAST_X] = 0.0
        state.floats[i, 0, _LAST_Y] = 0.0
        return False
    moves = _shift(i, percept, state, x, y) > _STILL * percept.speed[i]
    if state.ints[i, 0, LEFT] == 0:
        if not _is_due(i, state, distance <= arrays.parameters[CONTACT], moves, patience):
            return False
        _begin(i, state, patience, random)
    state.ints[i, 0, LEFT] -= 1
    state.ints[i, 0, BEHAVIOUR] = -1
    x, y = turned_by(x / distance, y / distance, state.floats[i, 0, _TURN])
    go(action, i, x, y, percept.speed[i])
    return True
