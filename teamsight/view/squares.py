"""The outline of a square range, or of the part of it in a field of view."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]

_RIGHT = 0.5 * math.pi


def square_outline(reach: float, angle: float, field_of_view: float) -> Floats:
    """Return the corners of a square range around the origin, or of the part in view, shape (corners, 2) [length].

    Parameters
    ----------
    reach : float
        Half the side, which is along the axes [length].
    angle, field_of_view : float
        The heading and the angle around it that is in view [rad].
    """
    if field_of_view >= 2 * math.pi - 1e-9:
        return reach * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    first, last = angle - 0.5 * field_of_view, angle + 0.5 * field_of_view
    # Corners are at odd eighths of a turn.
    number = np.arange(math.floor(first / _RIGHT - 0.5) + 1, math.ceil(last / _RIGHT - 0.5))
    turns = np.array([first, *(number + 0.5) * _RIGHT, last])
    ways = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    return np.concatenate([np.zeros((1, 2)), reach * ways / np.abs(ways).max(axis=1, keepdims=True)])
