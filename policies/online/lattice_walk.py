"""The lattice, and the lattice walk: random moves from cell to cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.component import Allowed
from teamsight.core.kernel import inlined
from teamsight.policies.channels import column_of
from teamsight.policies.compiled import CompiledPolicy

#: The number of moves without and with staying in place.
MOVES = (4, 5)
#: What it may be.
Moves = Annotated[int, Allowed(least=MOVES[0], most=MOVES[1])]
#: The side of a grid between walls [cells].
Side = Annotated[int, Allowed(least=2, unit="cells")]
#: The moves as bits: 1 north, 2 east, 4 south, 8 west, 16 stays; here all.
EVERY = 31
#: What a policy reads to know where walls are.
PLACE = ("position_x", "position_y")


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


@inlined
def _walk(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    moves = arrays.parameters[0]
    for i in range(percept.heading.shape[0]):
        lattice_move(int(noise[0, i] * moves), i, percept, action)


@dataclass(frozen=True)
class LatticeWalk(CompiledPolicy):
    """Move by the speed to the north, east, south or west, each with the same probability.

    With speed 1 and positions at the centres of unit cells, it is a random walk on a grid: every position stays exact.
    In a `Box` whose sides are whole numbers a move against the wall ends in the cell where it began.

    Parameters
    ----------
    moves : {4, 5}, default 4
        Moves to the north, east, south and west; 5 to stay in place with a probability of 1/5.

    Raises
    ------
    TypeError, ValueError
        If `moves` is neither.
    """

    moves: Moves = 4

    kernel = _walk
    draws = 1

    @property
    def is_sound(self) -> bool:
        return type(self).kernel is _walk

    @property
    def reads_teammates(self) -> bool:
        return False


@inlined
def moves_inside(i: int, percept: Any, side: float) -> int:
    """Return the moves of agent `i` that end in a cell of a square grid around the origin, as bits; see `EVERY`."""
    x = column_of(percept.columns.position_x, percept.identity[i])
    y = column_of(percept.columns.position_y, percept.identity[i])
    # Centres of outer cells are half a cell beyond it, all others half a cell before it or more.
    edge = 0.5 * side - 1.0
    return EVERY - (y > edge) - 2 * (x > edge) - 4 * (y < -edge) - 8 * (x < -edge)


@inlined
def _walk_inside(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    moves = int(arrays.parameters[0])
    for i in range(percept.heading.shape[0]):
        allowed = moves_inside(i, percept, arrays.parameters[1])
        count = 0
        for number in range(moves):
            count += allowed >> number & 1
        # The move of this rank among those that are allowed.
        rank = int(noise[0, i] * count)
        number = 0
        while rank > 0 or not allowed >> number & 1:
            rank -= allowed >> number & 1
            number += 1
        lattice_move(number, i, percept, action)


@dataclass(frozen=True)
class BoundedWalk(LatticeWalk):
    """Move as `LatticeWalk`, but never against a wall: the moves that stay inside have the same probability.

    Parameters
    ----------
    moves : {4, 5}, default 4
        As for `LatticeWalk`.
    side : int, default 10
        The walls are those of a ``Box(side, side)`` [cells].

    Raises
    ------
    TypeError, ValueError
        If a value is outside its limits.
    """

    side: Side = 10

    kernel = _walk_inside
    columns = PLACE

    @property
    def is_sound(self) -> bool:
        return type(self).kernel is _walk_inside
