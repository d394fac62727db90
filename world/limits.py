"""Limits of lengths and speeds, within which squares, quotients and sums of lengths are accurate; shapes of ranges."""

from __future__ import annotations

import math
from typing import Annotated, Any, Protocol

from teamsight.core import checks
from teamsight.core.component import Allowed

SHORTEST, LONGEST = 1e-9, 1e9
"""The limits of all lengths [length]; for others choose another unit."""

FINEST = 1e-9
"""The shortest range, as a share of the arena's extent; positions are rounded to about 1e-16 of it."""

FARTHEST = 1e3
"""The longest step, in extents of the arena."""


def length(name: str, value: float) -> float:
    """Return a length within the limits.

    Parameters
    ----------
    name : str
        The name used in errors.
    value : float
        The length.

    Raises
    ------
    TypeError, ValueError
        If it is not a number from `SHORTEST` to `LONGEST`.
    """
    result = checks.number(name, value, above=0)
    if not SHORTEST <= result <= LONGEST:
        raise ValueError(
            f"{name}={result:g}: must be from {SHORTEST:g} to {LONGEST:g}; choose another unit for all lengths"
        )
    return result


#: A length, as a field of a component declares it.
Length = Annotated[float, Allowed(least=SHORTEST, most=LONGEST, check=length, unit="length")]


class Bounded(Protocol):
    """The part of `Arena` on which limits depend; arenas import this file."""

    @property
    def bounds(self) -> Any: ...
    def check_reach(self, reach: float) -> None: ...


class Limits:
    """The limits of ranges and speeds in an arena. Its methods have the parameters and errors of `length`."""

    def __init__(self, arena: Bounded) -> None:
        (left, bottom), (right, top) = arena.bounds
        self._arena = arena
        self._extent = float(max(right - left, top - bottom))

    def range(self, name: str, value: float) -> float:
        """Return a range that is a length, exceeds the rounding of positions and is not too long for the arena."""
        result = length(name, value)
        limit = FINEST * self._extent
        if result < limit:
            raise ValueError(f"{name}={result:g}: must be at least {limit:g} in {self._arena}; take a longer range")
        self._arena.check_reach(result)
        return result

    def radius(self, name: str, value: float) -> float:
        """Return the radius of a body: 0, or a length that fits into the arena."""
        result = checks.number(name, value, least=0)
        if result and 2.0 * length(name, result) > self._extent:
            raise ValueError(
                f"{name}={result:g}: must be at most {0.5 * self._extent:g} in {self._arena}; take a smaller radius"
            )
        return result

    def speed(self, name: str, value: float) -> float:
        """Return a speed, at least 0, of at most `FARTHEST` extents of the arena a step."""
        result = checks.number(name, value, least=0)
        limit = FARTHEST * self._extent
        if result > limit:
            raise ValueError(f"{name}={result:g}: must be at most {limit:g} in {self._arena}; take a lower speed")
        return result


#: The shapes of ranges; kernels read their indices. In a square range of r is whatever is at most r away along either
#: axis: the Chebyshev distance counts. Offsets and distances are Euclidean for both.
SHAPES = ("disc", "square")
DISC, SQUARE = range(2)

_FARTHEST = {"disc": 1.0, "square": math.sqrt(2.0)}


def shape_given(name: str) -> str:
    """Return the shape that a user names.

    Raises
    ------
    ValueError
        If the name is unknown.
    """
    return checks.choice("range_shape", name, SHAPES)


def shape_number(name: str) -> int:
    """Return the index of a shape; raise the error of `shape_given` if it is unknown."""
    return SHAPES.index(name if name in SHAPES else shape_given(name))


def farthest_of(shape: str) -> float:
    """Return the largest distance within a range of 1: 1, or √2 in a square."""
    return _FARTHEST[shape]
