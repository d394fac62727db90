"""Grids of team sizes and arena radii; nothing slow is imported here, so that plans can hold one."""

from __future__ import annotations

from typing import NamedTuple


class Grid(NamedTuple):
    """The team sizes and arena radii over which a surface is drawn."""

    robots: tuple[int, ...]
    radius: tuple[float, ...]

    @property
    def cells(self) -> tuple[tuple[int, float], ...]:
        """All combinations (robots, radius), ordered by radius."""
        return tuple((robots, radius) for radius in self.radius for robots in self.robots)


#: The grid of the paper's Figs. 4 to 10.
FULL = Grid(tuple(range(1, 31)), tuple(float(radius) for radius in range(1, 10)))
#: A coarse grid on which every claim can still be computed.
QUICK = Grid((1, 2, 5, 8, 10, 20, 30), (1.0, 2.0, 3.0, 5.0, 7.0, 8.0, 9.0))
