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
