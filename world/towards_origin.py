"""The search for places inside of arenas that are star-shaped around the origin."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]

_HALVINGS = 50
_DIRECTIONS = 64


class Star(Protocol):
    """The part of `Arena` that is read here; arenas import this file."""

    @property
    def period(self) -> tuple[float, float]: ...
    def contains(self, position: npt.ArrayLike) -> npt.NDArray[np.bool_]: ...
    def displacement(self, start: npt.ArrayLike, end: npt.ArrayLike) -> Points: ...


def towards_origin(arena: Star, points: Points, margin: float) -> Points:
    """Move points that are outside, or nearer to the wall than `margin`, towards the origin; see `Arena.inside`."""
    points = np.array(arena.displacement(np.zeros(2), points))
    is_open = np.asarray(arena.period) > 0
    angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    around = np.concatenate([np.zeros((1, 2)), margin * np.stack([np.cos(angle), np.sin(angle)], axis=-1)])
    # Each look costs time: only points that have to move are moved.
    stuck = np.flatnonzero(~_is_free(arena, points, around))
    moving = points[stuck]
    near, far = np.zeros(len(stuck)), np.ones(len(stuck))
    for _ in range(_HALVINGS if len(stuck) else 0):
        middle = 0.5 * (near + far)
        is_free = _is_free(arena, np.where(is_open, moving, moving * middle[:, None]), around)
        near, far = np.where(is_free, middle, near), np.where(is_free, far, middle)
    points[stuck] = np.where(is_open, moving, moving * near[:, None])
    return points


def _is_free(arena: Star, points: Points, around: Points) -> npt.NDArray[np.bool_]:
    """Return for each point whether all points around it are inside."""
    # The arena continues across the seam of an axis that repeats.
    places = arena.displacement(np.zeros(2), points[:, None] + around)
    return np.asarray(np.all(arena.contains(places), axis=1))
