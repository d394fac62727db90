"""Arenas that repeat: periods, the shortest way, the longest range."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]

#: A period longer than any distance: ``way - ENDLESS * rint(way / ENDLESS)`` is `way`, to the last bit.
ENDLESS = 1e300


def kernel_period(period: tuple[float, float]) -> Points:
    """Return an arena's period for formulas that divide by it: `ENDLESS` along an axis that does not repeat.

    If neither axis repeats, both are 0: nothing needs wrapping.
    """
    sides = np.array(period, float)
    return np.where(sides > 0, sides, ENDLESS) if sides.any() else sides


def shortest(way: Points, period: tuple[float, float]) -> Points:
    """Return the shortest displacements between positions that `way`, shape (..., 2), leads from one to another."""
    if not any(period):
        return way
    sides = kernel_period(period)
    return np.asarray(way - sides * np.rint(way / sides))


def check_reach(reach: float, period: tuple[float, float]) -> None:
    """Refuse a range within which a body could be found twice; see `Arena.check_reach`."""
    if not any(period):
        return
    limit = min((side / 2 for side in period if side > 0), default=math.inf)
    if reach > limit:
        raise ValueError(
            f"range={reach:g}: on a torus a range must be at most half of the shorter side, here {limit:g}; "
            "take a larger torus or a shorter range"
        )
