"""Lattice moves: one cell to the north, east, south or west, or none."""

from __future__ import annotations

from typing import Any

from teamsight.core.kernel import inlined

#: The number of moves without and with staying in place.
MOVES = (4, 5)


@inlined
def lattice_move(number: int, i: int, percept: Any, action: Any) -> None:
    """Write the action of agent `i`: 0 north, 1 east, 2 south, 3 west, by its speed; 4 stays."""
    x = 0.0
    y = 0.0
    if number == 0:
        y = 1.0
    elif number == 1:
        x = 1.0
    elif number == 2:
        y = -1.0
    elif number == 3:
        x = -1.0
    action.heading[i, 0] = x
    action.heading[i, 1] = y
    action.distance[i] = percept.speed[i] if number < 4 else 0.0
