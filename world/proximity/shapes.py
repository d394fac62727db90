"""The shape of ranges: discs, or squares whose sides are parallel to the axes of the arena.

In a square range of r is whatever is at most r away along either axis: the Chebyshev distance counts. Offsets and
distances are Euclidean for both.
"""

from __future__ import annotations

import math

from teamsight.core import checks

#: The names of the shapes; kernels read their indices.
SHAPES = ("disc", "square")
DISC, SQUARE = range(2)

_FARTHEST = (1.0, math.sqrt(2.0))


def shape_number(name: str) -> int:
    """Return the index of a shape.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown.
    """
    return SHAPES.index(checks.choice("range_shape", name, SHAPES))


def shape_given(value: str) -> str:
    """Return the shape that a user names; see `shape_number`."""
    return SHAPES[shape_number(value)]


def farthest_of(name: str) -> float:
    """Return the largest distance within a range of 1: 1, or √2 in a square."""
    return _FARTHEST[shape_number(name)]
