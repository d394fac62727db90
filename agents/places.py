"""Places: the positions and headings that a user gives, checked."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]


def checked_positions(arena: Arena, value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Check positions; return them as an array of this shape. One position of shape (2,) may stand for all.

    Raises
    ------
    TypeError, ValueError
        If the shape is wrong, a number is not finite, or a position lies outside.
    """
    try:
        position = np.array(value, float)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"position={checks.shown(value)}: must be numbers of shape {shape}") from None
    if position.shape not in (shape, (2,)):
        raise ValueError(f"position: has the shape {position.shape}; it must be {shape}")
    inside = arena.contains(position) & np.isfinite(position).all(axis=-1)
    if not inside.all():
        wrong = position[~inside][0] if position.ndim == 2 else position
        raise ValueError(f"position={tuple(wrong.tolist())}: must be two finite numbers inside {arena}")
    return np.array(np.broadcast_to(position, shape))


def checked_headings(value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Check directions; return them as unit vectors of this shape. One direction of shape (2,) may stand for all.

    Raises
    ------
    TypeError, ValueError
        If the shape is wrong, a number is not finite, or both numbers of a direction are 0.
    """
    cure = "must be two finite numbers, not both 0"
    try:
        vectors = np.asarray(value, float)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"heading={checks.shown(value)}: {cure}") from None
    if vectors.shape not in (shape, (2,)):
        each = f"; or {shape[0]} of them, one for each agent" if len(shape) == 2 else ""
        raise ValueError(f"heading={checks.shown(value)}: {cure}{each}")
    lengths = np.hypot(vectors[..., 0], vectors[..., 1])
    wrong = ~(np.isfinite(lengths) & (lengths > 0))
    if wrong.any():
        shown = vectors[wrong][0].tolist() if vectors.ndim == 2 else value
        raise ValueError(f"heading={checks.shown(shown)}: {cure}")
    return np.array(np.broadcast_to(vectors / lengths[..., np.newaxis], shape))
