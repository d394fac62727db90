"""The lattice walk: random moves from cell to cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.online.lattice import MOVES, lattice_move


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
        5 to stay in place with a probability of 1/5.

    Raises
    ------
    TypeError, ValueError
        If `moves` is neither.
    """

    moves: int = 4

    kernel = _walk
    draws = 1

    def __post_init__(self) -> None:
        checks.count("moves", self.moves, least=MOVES[0], most=MOVES[1])

    @property
    def is_sound(self) -> bool:
        return type(self).kernel is _walk

    @property
    def reads_teammates(self) -> bool:
        return False
