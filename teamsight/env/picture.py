"""Pictures of a world as pixels, drawn with NumPy alone: the same world gives the same pixels everywhere."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.drawing import obstacles, walls
from teamsight.world.arena import Arena

Floats = npt.NDArray[np.float64]
Colour = tuple[float, float, float]

#: The longer side of a picture, and the space around the arena [pixels].
SIDE, MARGIN = 600, 12
_PAPER: Colour = (1.0, 1.0, 1.0)
_WALL: Colour = (0.35, 0.35, 0.35)
_OBSTACLE: Colour = (0.72, 0.72, 0.72)
_ROBOT: Colour = (0.12, 0.47, 0.71)
_INACTIVE: Colour = (0.62, 0.62, 0.62)
_OBSERVED: Colour = (0.17, 0.63, 0.17)
_UNOBSERVED: Colour = (0.84, 0.15, 0.16)
_RANGE_OPACITY, _RING_OPACITY = 0.07, 0.35
_BODY, _WALL_WIDTH, _TIP = 5.0, 2.0, 13.0


class Bodies(NamedTuple):
    """What is drawn of bodies.

    Attributes
    ----------
    position, heading : ndarray, shape (n, 2), float64
        [length], and unit vectors.
    reach : ndarray, shape (n,), float64
        The sensing range of robots [length]; NaN for bodies without one.
    active, observed : ndarray, shape (n,), bool
        Whether each is active, and whether it is observed.
    """

    position: Floats
    heading: Floats
    reach: Floats
    active: npt.NDArray[np.bool_]
    observed: npt.NDArray[np.bool_]


class Picture:
    """Draws worlds in one arena.

    Parameters
    ----------
    arena : Arena
        The arena.
    """

    def __init__(self, arena: Arena) -> None:
        low, high = np.asarray(arena.bounds, float)
        self._scale = (SIDE - 2 * MARGIN) / float((high - low).max())
        self._corner = np.array([low[0], high[1]])
        width, height = (math.ceil(side) + 2 * MARGIN for side in ((high - low) * self._scale).tolist())
        self._ground = np.empty((height, width, 3))
        self._ground[:] = _PAPER
        for line in obstacles(arena):
            self._fill(self._ground, self._pixels(line), _OBSTACLE)
        for line in [*walls(arena), *obstacles(arena)]:
            points = self._pixels(line)
            for start, end in pairwise(points):
                _line(self._ground, start, end, _WALL_WIDTH, _WALL)

    def draw(self, groups: Iterable[Bodies]) -> npt.NDArray[np.uint8]:
        """Return a picture of bodies, shape (height, width, 3); later ones are drawn over earlier ones."""
        pixels, groups = self._ground.copy(), list(groups)
        for bodies in groups:
            for place, reach, is_active in zip(self._pixels(bodies.position), bodies.reach, bodies.active, strict=True):
                if is_active and not math.isnan(reach):
                    _disc(pixels, place, reach * self._scale, _ROBOT, _RANGE_OPACITY)
                    _disc(pixels, place, reach * self._scale, _ROBOT, _RING_OPACITY, ring=1.0)
        for bodies in groups:
            self._draw_bodies(pixels, bodies)
        return np.asarray(np.rint(pixels * 255.0), np.uint8)

    def _draw_bodies(self, pixels: Floats, bodies: Bodies) -> None:
        for row, place in enumerate(self._pixels(bodies.position)):
            is_robot, is_active = not math.isnan(bodies.reach[row]), bodies.active[row]
            colour = _ROBOT if is_robot else _OBSERVED if bodies.observed[row] else _UNOBSERVED
            colour = colour if is_active else _INACTIVE
            if is_robot:
                _line(pixels, place, place + _TIP * bodies.heading[row] * (1.0, -1.0), 2.0, colour)
            # Those that nobody observes are hollow, so that it takes no colours to see them.
            is_full = is_robot or bodies.observed[row] or not is_active
            _disc(pixels, place, _BODY, colour, 1.0, ring=0.0 if is_full else 2.0)

    def _pixels(self, points: Floats) -> Floats:
        """Return points in pixels: to the right and down."""
        return np.asarray((points - self._corner) * (self._scale, -self._scale) + MARGIN)

    def _fill(self, pixels: Floats, corners: Floats, colour: Colour) -> None:
        """Fill a polygon: a pixel whose centre is inside."""
        x, y = np.arange(pixels.shape[1]) + 0.5, (np.arange(pixels.shape[0]) + 0.5)[:, np.newaxis]
        inside = np.zeros(pixels.shape[:2], bool)
        for (x0, y0), (x1, y1) in pairwise(corners):
            if y0 != y1:
                inside ^= ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
        pixels[inside] = colour


def _blend(patch: Floats, cover: Floats, colour: Colour) -> None:
    patch += cover[..., np.newaxis] * (np.array(colour) - patch)


def _window(pixels: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the part of a picture between two corners, and the x and y of its pixels."""
    left, top = np.maximum(np.floor(low).astype(int) - 1, 0)
    right, bottom = np.maximum(np.ceil(high).astype(int) + 1, 0)
    patch = pixels[top:bottom, left:right]
    return patch, left + np.arange(patch.shape[1]) + 0.5, (top + np.arange(patch.shape[0]) + 0.5)[:, np.newaxis]


def _disc(pixels: Floats, place: Floats, radius: float, colour: Colour, opacity: float, *, ring: float = 0.0) -> None:
    """Draw a disc, or a ring of this width, with smooth edges."""
    patch, x, y = _window(pixels, place - radius - 1.0, place + radius + 1.0)
    distance = np.sqrt((x - place[0]) ** 2 + (y - place[1]) ** 2)
    beyond = np.abs(distance - radius) - ring / 2 if ring else distance - radius
    _blend(patch, opacity * np.clip(0.5 - beyond, 0.0, 1.0), colour)


def _line(pixels: Floats, start: Floats, end: Floats, width: float, colour: Colour) -> None:
    """Draw a line with round ends."""
    patch, x, y = _window(pixels, np.minimum(start, end) - width, np.maximum(start, end) + width)
    way = end - start
    square = float(way @ way)
    share = np.clip(((x - start[0]) * way[0] + (y - start[1]) * way[1]) / (square or 1.0), 0.0, 1.0)
    distance = np.sqrt((x - start[0] - share * way[0]) ** 2 + (y - start[1] - share * way[1]) ** 2)
    _blend(patch, np.clip(width / 2 + 0.5 - distance, 0.0, 1.0), colour)
