"""Surround prey: hunters on a grid share the four sides of the prey among those that they perceive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.online.lattice_walk import lattice_move
from teamsight.policies.online.prey_q import closest

# A distance [cells] counts more than any place. Places relative to the prey are within this many cells, more than
# twice the largest side of a grid.
_PER_DISTANCE, _REACH = 1e8, 4000.0
# Who claims a side: the robot itself, where others have the number of a neighbour; and nobody.
_SELF, _NOBODY = -1, -2
_SIDES, _STAY = 4, 4


@inlined
def _side(number: int) -> tuple[float, float]:
    """Return a side of the prey, relative to it, numbered like the moves: 0 north, 1 east, 2 south, 3 west."""
    if number == 0:
        return 0.0, 1.0
    if number == 1:
        return 1.0, 0.0
    return (0.0, -1.0) if number == 2 else (-1.0, 0.0)


@inlined
def _claim(x: float, y: float, free: int) -> tuple[float, int]:
    """Return the claim of a hunter at (x, y) from the prey to its nearest free side, the least first, and the side."""
    least = np.inf
    nearest = 0
    for number in range(_SIDES):
        side_x, side_y = _side(number)
        distance = abs(x - side_x) + abs(y - side_y)
        if (free >> number) & 1 and distance < least:
            least = distance
            nearest = number
    # Equal distances are ordered by place, which is the same for all who look.
    return least * _PER_DISTANCE + (x + _REACH) * 2.0 * _REACH + y + _REACH, nearest


@inlined
def _own_side(i: int, x: float, y: float, teammates: Any, is_first: bool) -> int:
    """Return the side that robot `i` takes, −1 for none: the least claim takes its side, then the least of the rest.

    The prey is at (x, y) from the robot, which goes before teammates in its own cell if `is_first`.
    """
    free = (1 << _SIDES) - 1
    first, second, third = _NOBODY, _NOBODY, _NOBODY
    for _ in range(_SIDES):
        least, number = _claim(-x, -y, free)
        who = _SELF
        for k in range(teammates.start[i], teammates.start[i + 1]):
            claim, wanted = _claim(np.rint(teammates.offset[k, 0]) - x, np.rint(teammates.offset[k, 1]) - y, free)
            is_less = claim < least or (claim == least and who == _SELF and not is_first)
            if is_less and k != first and k != second and k != third:
                least, number, who = claim, wanted, k
        if who == _SELF:
            return number
        free ^= 1 << number
        first, second, third = second, third, who
    return -1


@inlined
def _cost(x: float, y: float, goal_x: float, goal_y: float, prey_x: float, prey_y: float) -> float:
    """Return the moves from (x, y) to a side of the prey, around it; infinite from its own cell."""
    if x == prey_x and y == prey_y:
        return np.inf
    moves = abs(goal_x - x) + abs(goal_y - y)
    # A straight way through the prey needs two moves more.
    is_upright = x == prey_x and goal_x == prey_x and (y - prey_y) * (goal_y - prey_y) < 0.0
    is_level = y == prey_y and goal_y == prey_y and (x - prey_x) * (goal_x - prey_x) < 0.0
    return moves + 2.0 if is_upright or is_level else moves


@inlined
def _best_move(x: float, y: float, number: int, fraction: float) -> int:
    """Return a move towards a side of the prey at (x, y), a random one of equally good ones."""
    side_x, side_y = _side(number)
    if x + side_x == 0.0 and y + side_y == 0.0:
        return _STAY
    least = np.inf
    equals = 0
    for move in range(_SIDES):
        move_x, move_y = _side(move)
        cost = _cost(move_x, move_y, x + side_x, y + side_y, x, y)
        equals = equals + 1 if cost == least else (1 if cost < least else equals)
        least = min(least, cost)
    left = int(fraction * equals)
    for move in range(_SIDES):
        move_x, move_y = _side(move)
        if _cost(move_x, move_y, x + side_x, y + side_y, x, y) == least:
            if left == 0:
                return move
            left -= 1
    return _STAY


@inlined
def _surround(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    targets = percept.targets
    for i in range(percept.heading.shape[0]):
        move = int(noise[1, i] * _SIDES)
        prey = closest(targets, i, percept.sensing_range[i], noise[0, i])
        if prey >= 0:
            x, y = np.rint(targets.offset[prey, 0]), np.rint(targets.offset[prey, 1])
            number = _own_side(i, x, y, percept.teammates, noise[2, i] < 0.5)
            if number >= 0:
                move = _best_move(x, y, number, noise[1, i])
        lattice_move(move, i, percept, action)


@dataclass(frozen=True)
class SurroundPrey(CompiledPolicy):
    """Take one of the four sides of the nearest prey; walk at random without prey, or if all sides are taken.

    The robot shares the sides among itself and the teammates that it perceives: whoever is nearest to a side takes it,
    then whoever is nearest to another, until it has one itself. Four hunters that perceive each other agree. One that
    does not perceive a teammate may go to the same side. Hunters in one cell each draw who goes first.

    It makes lattice moves, one cell to the north, east, south or west, or stays on its side of the prey.

    Notes
    -----
    *Source:* none. The hunters of Ono and Fukumoto (1996) learn; these show what a team does that can surround.
    """

    kernel = _surround
    draws = 3

    @property
    def is_sound(self) -> bool:
        return type(self).kernel is _surround  # It makes lattice moves only.
