"""Q-learning of hunters: a table over the cell of the prey, and that of the partner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from teamsight.core.component import Allowed
from teamsight.core.kernel import inlined
from teamsight.policies.online.lattice_walk import PLACE, Side, moves_inside
from teamsight.policies.online.online_q import ROW_NOISE, ROW_PARAMETERS, OnlineQ, online_q


@inlined
def is_within(offset: Any, k: int, depth: float) -> bool:
    """Whether neighbour `k` is in the square that reaches `depth` cells to each side."""
    # Half a cell of tolerance, so that rounding decides nothing.
    return bool(abs(offset[k, 0]) < depth + 0.5 and abs(offset[k, 1]) < depth + 0.5)


@inlined
def closest(seen: Any, i: int, depth: float, fraction: float) -> int:
    """Return the nearest neighbour of robot `i` within the depth, a random one of equally near ones; −1 for none.

    Parameters
    ----------
    seen : NeighbourList
        The neighbours.
    i : int
        The robot.
    depth : float
        Cells to each side.
    fraction : float
        A uniform number in (0, 1), which chooses.
    """
    best = -1
    equals = 0
    for k in range(seen.start[i], seen.start[i + 1]):
        if is_within(seen.offset, k, depth):
            if best < 0 or seen.distance[k] < seen.distance[best]:
                best = k
                equals = 1
            elif seen.distance[k] == seen.distance[best]:
                equals += 1
    if equals > 1:
        chosen = int(fraction * equals)
        for k in range(best, seen.start[i + 1]):
            if is_within(seen.offset, k, depth) and seen.distance[k] == seen.distance[best]:
                if chosen == 0:
                    return k
                chosen -= 1
    return best


@inlined
def at_rank(seen: Any, i: int, rank: int, depth: float) -> int:
    """Return the neighbour of robot `i` of this rank, 0 for the nearest, of those within the depth; −1 for none.

    Of equally near ones the first in the list comes first.
    """
    chosen = -1
    for _ in range(rank + 1):
        after = chosen
        chosen = -1
        for k in range(seen.start[i], seen.start[i + 1]):
            if not is_within(seen.offset, k, depth):
                continue
            far = seen.distance[k]
            if after >= 0 and (far < seen.distance[after] or (far == seen.distance[after] and k <= after)):
                continue
            if chosen < 0 or far < seen.distance[chosen]:
                chosen = k
        if chosen < 0:
            return -1
    return chosen


@inlined
def cell(seen: Any, k: int, extent: int) -> int:
    """Return the number of the cell of neighbour `k` in a square that reaches `extent` cells to each side.

    The number after the last cell is for no neighbour, k = −1, and for one beyond the square.
    """
    side = 2 * extent + 1
    if k < 0 or not is_within(seen.offset, k, extent):
        return side * side
    return (_rounded(seen.offset[k, 0]) + extent) * side + _rounded(seen.offset[k, 1]) + extent


@inlined
def _rounded(number: float) -> int:
    return int(number + 0.5) if number >= 0.0 else -int(0.5 - number)


def cells(extent: int) -> int:
    """Return how many numbers `cell` gives."""
    return (2 * extent + 1) ** 2 + 1


_DEPTH, _REACH, _PARTNER, _SIDE = range(ROW_PARAMETERS, ROW_PARAMETERS + 4)
#: The largest depth: a table with a partner has more rows than fit beyond it.
MOST_DEPTH = 15


@inlined
def _row(i: int, percept: Any, parameters: Any, noise: Any) -> int:
    depth, reach, partner = parameters[_DEPTH], parameters[_REACH], parameters[_PARTNER]
    prey = closest(percept.targets, i, depth, noise[ROW_NOISE, i])
    if prey >= 0:
        row = cell(percept.targets, prey, int(reach))
    else:
        # What teammates report; nothing without an awareness that relays targets.
        prey = closest(percept.relayed, i, reach, noise[ROW_NOISE, i])
        row = cell(percept.relayed, prey, int(reach))
    if partner > 0.0:
        teammate = closest(percept.teammates, i, partner, noise[ROW_NOISE + 1, i])
        side = 2 * int(partner) + 1
        row = row * (side * side + 1) + cell(percept.teammates, teammate, int(partner))
    return row


@dataclass(frozen=True, eq=False, repr=False)
class PreyQ(OnlineQ):
    """Q-learning over the cell of the closest prey and, if wished, that of the closest teammate.

    The row of the table is the place of the closest prey, in cells to the east and to the north, or one row for no
    prey. A robot that senses none uses the closest that teammates report, where its degree of awareness relays targets
    (``awareness="shared"``): mutual scouting.

    Parameters
    ----------
    depth : int, default 4
        Prey is sensed in a square of this many cells to each side: the sensing range, with ``range_shape="square"``.
    reach : int, default 0
        Cells to each side for which the table has rows, at least the depth, which 0 stands for. Larger for reported
        prey.
    partner : int, default 0
        Cells to each side in which the closest teammate is perceived; 0 for teammates that are not.
    learning_rate, discount, temperature, moves, values_ends, average_every, one_table, tables
        As for `OnlineQ`.

    Raises
    ------
    TypeError, ValueError
        As for `OnlineQ`.

    Notes
    -----
    *Source:* Tan (1993). *Departs:* of several reported prey the one closest to the robot itself is used.
    """

    depth: Annotated[int, Allowed(least=1, most=MOST_DEPTH)] = 4
    reach: Annotated[int, Allowed(least=0, most=MOST_DEPTH)] = 0
    partner: Annotated[int, Allowed(least=0, most=MOST_DEPTH)] = 0

    kernel = online_q(_row)
    draws = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        if 0 < self.reach < self.depth:
            raise ValueError(f"reach={self.reach}: must be at least depth={self.depth}, or 0 for the depth")

    @property
    def needs(self) -> tuple[str, ...]:  # type: ignore[override]
        """Teammates, if there is a partner."""
        return ("teammates",) if self.partner else ()

    @property
    def rows(self) -> int:
        return cells(self.reach or self.depth) * (cells(self.partner) if self.partner else 1)

    @property
    def row_parameters(self) -> tuple[float, ...]:
        return float(self.depth), float(self.reach or self.depth), float(self.partner)


@inlined
def _moves_inside(i: int, percept: Any, parameters: Any) -> int:
    return moves_inside(i, percept, parameters[_SIDE])  # type: ignore[no-any-return]


@dataclass(frozen=True, eq=False, repr=False)
class BoundedPreyQ(PreyQ):
    """`PreyQ` that never moves against a wall: it chooses among the moves that stay inside.

    What is perceived next counts by its largest value over all moves, as for `PreyQ`.

    Parameters
    ----------
    side : int, default 10
        The walls are those of a ``Box(side, side)`` [cells].
    depth, reach, partner, learning_rate, discount, temperature, moves, values_ends, average_every, one_table, tables
        As for `PreyQ`.

    Raises
    ------
    TypeError, ValueError
        As for `PreyQ`.
    """

    side: Side = 10

    kernel = online_q(_row, _moves_inside)
    columns = PLACE

    @property
    def row_parameters(self) -> tuple[float, ...]:
        return *super().row_parameters, float(self.side)
