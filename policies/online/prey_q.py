"""Q-learning of hunters: a table over the cell of the prey, and that of the partner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamsight.core import checks
from teamsight.core.kernel import inlined
from teamsight.policies.online.cells import cell, cells, closest
from teamsight.policies.online.online_q import ROW_NOISE, ROW_PARAMETERS, OnlineQ, online_q

_DEPTH, _REACH, _PARTNER = range(ROW_PARAMETERS, ROW_PARAMETERS + 3)
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

    depth: int = 4
    reach: int = 0
    partner: int = 0

    kernel = online_q(_row)
    draws = 3

    def __post_init__(self) -> None:
        checks.count("depth", self.depth, most=MOST_DEPTH)
        checks.count("reach", self.reach, least=0, most=MOST_DEPTH)
        checks.count("partner", self.partner, least=0, most=MOST_DEPTH)
        if 0 < self.reach < self.depth:
            raise ValueError(f"reach={self.reach}: must be at least depth={self.depth}, or 0 for the depth")
        super().__post_init__()

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
