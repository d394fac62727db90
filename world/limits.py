"""Limits of lengths and speeds: beyond them squares, quotients and sums of lengths lose their meaning as floats."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight import checks

if TYPE_CHECKING:
    from teamsight.world.arena import Arena

SHORTEST, LONGEST = 1e-9, 1e9
"""Between these all lengths lie [length]; take another unit for shorter or longer ones."""

FINEST = 1e-9
"""The shortest range, as a share of the arena's extent: shorter ones drown in the rounding of positions."""

FARTHEST = 1e3
"""The longest step, in extents of the arena."""


def length(name: str, value: float) -> float:
    """Return a length within the limits.

    Parameters
    ----------
    name : str
        What errors call it.
    value : float
        The length.

    Raises
    ------
    TypeError, ValueError
        If it is no number, or outside `SHORTEST` and `LONGEST`.
    """
    result = checks.number(name, value, above=0)
    if not SHORTEST <= result <= LONGEST:
        raise ValueError(
            f"{name}={result:g}: lengths are {SHORTEST:g} to {LONGEST:g}; take another unit of length for all of them"
        )
    return result


def extent(arena: Arena) -> float:
    """Return the longer side of the box around an arena [length]."""
    low, high = arena.bounds
    return float(np.max(np.asarray(high, float) - np.asarray(low, float)))


def check_range(name: str, value: float, arena: Arena) -> float:
    """Return a range that is a length and can be told from the rounding of positions in the arena.

    Parameters
    ----------
    name : str
        What errors call it.
    value : float
        The range [length].
    arena : Arena
        Where it is used.

    Raises
    ------
    TypeError, ValueError
        If it is no length, too short for the arena, or too long for a torus.
    """
    result = length(name, value)
    limit = FINEST * extent(arena)
    if result < limit:
        raise ValueError(f"{name}={result:g}: must be at least {limit:g} in {arena}; take a longer range")
    arena.check_reach(result)
    return result


def check_speed(name: str, value: float, arena: Arena) -> float:
    """Return a speed that does not lead around the arena more than `FARTHEST` times in a step.

    Parameters
    ----------
    name : str
        What errors call it.
    value : float
        The farthest that a body can go a step [length].
    arena : Arena
        Where it moves.

    Raises
    ------
    TypeError, ValueError
        If it is no finite number of at least 0, or too high for the arena.
    """
    result = checks.number(name, value, least=0)
    limit = FARTHEST * extent(arena)
    if result > limit:
        raise ValueError(f"{name}={result:g}: must be at most {limit:g} a step in {arena}; take a lower speed")
    return result
