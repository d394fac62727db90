"""Pictures of worlds: as pixels, which NumPy draws alone and so alike everywhere, or in a window."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS
from teamsight.agents.drawing import obstacles, walls
from teamsight.agents.group import Group
from teamsight.world.arena import Arena

if TYPE_CHECKING:
    from teamsight.env.batch import Place

Floats = npt.NDArray[np.float64]
Colour = tuple[float, float, float]

#: What `render` can do.
RENDER_MODES = ("human", "rgb_array")
#: Steps a second in videos that others make of the pictures.
FPS = 30
# For a moment, so that the window reacts; the simulation does not wait for it.
_PAUSE = 1e-3
NO_MODE = "render(): the environment has no render_mode; make it with render_mode='rgb_array'"
_NO_WINDOW = (
    "render_mode='human': matplotlib can open no window, as there is no display; use "
    "render_mode='rgb_array', or record the world, which is env.world"
)
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
        x, y = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, np.newaxis]
        for line in obstacles(arena):
            # A pixel whose centre is inside.
            inside = np.zeros((height, width), bool)
            for (x0, y0), (x1, y1) in pairwise(self._pixels(line)):
                if y0 != y1:
                    inside ^= ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / (y1 - y0) + x0)
            self._ground[inside] = _OBSTACLE
        for line in [*walls(arena), *obstacles(arena)]:
            for start, end in pairwise(self._pixels(line)):
                _line(self._ground, start, end, _WALL_WIDTH, _WALL)

    def draw(self, groups: list[Group]) -> npt.NDArray[np.uint8]:
        """Return a picture of the groups of a world, shape (height, width, 3); earlier ones are drawn over later ones.

        Robots are those on a team; a line says where they are heading, and a disc what they can sense.
        """
        pixels = self._ground.copy()
        for group in reversed(groups):
            if group.team is not None:
                active, places = group.bodies.active, self._pixels(group.bodies.position)
                reaches = group.bodies.sensing_range * self._scale
                for place, reach in zip(places[active], reaches[active], strict=True):
                    _disc(pixels, place, reach, _ROBOT, _RANGE_OPACITY)
                    _disc(pixels, place, reach, _ROBOT, _RING_OPACITY, ring=1.0)
        for group in reversed(groups):
            bodies, is_robot = group.bodies, group.team is not None
            observed, headings = _is_observed(group, groups), bodies.heading * (1.0, -1.0)
            for row, place in enumerate(self._pixels(bodies.position)):
                colour = _ROBOT if is_robot else _OBSERVED if observed[row] else _UNOBSERVED
                colour = colour if bodies.active[row] else _INACTIVE
                if is_robot:
                    _line(pixels, place, place + _TIP * headings[row], 2.0, colour)
                # Those that nobody observes are hollow, so that it takes no colours to see them.
                is_full = is_robot or observed[row] or not bodies.active[row]
                _disc(pixels, place, _BODY, colour, 1.0, ring=0.0 if is_full else 2.0)
        return np.asarray(np.rint(pixels * 255.0), np.uint8)

    def _pixels(self, points: Floats) -> Floats:
        """Return points in pixels: to the right and down."""
        return np.asarray((points - self._corner) * (self._scale, -self._scale) + MARGIN)


def _is_observed(group: Group, groups: list[Group]) -> npt.NDArray[np.bool_]:
    """Return for each agent whether somebody observes it, so that it counts."""
    is_observed = np.zeros(len(group), bool)
    for observer in groups:
        relation = observer.relations.get(TARGETS)
        if relation is not None and relation.counts and group in relation.observed:
            start, index = relation.true_lists
            is_observed |= np.isin(group.bodies.identity, relation.everyone[index[: start[-1]]])
    return is_observed


def _blend(
    pixels: Floats, low: Floats, high: Floats, colour: Colour, cover: Callable[[Floats, Floats], Floats]
) -> None:
    """Draw in the part of a picture between two corners; ``cover(x, y)`` says how much of a pixel is covered."""
    left, top = np.maximum(np.floor(low).astype(int) - 1, 0)
    right, bottom = np.maximum(np.ceil(high).astype(int) + 1, 0)
    patch = pixels[top:bottom, left:right]
    x, y = left + np.arange(patch.shape[1]) + 0.5, (top + np.arange(patch.shape[0]) + 0.5)[:, np.newaxis]
    patch += cover(x, y)[..., np.newaxis] * (np.array(colour) - patch)


def _disc(pixels: Floats, place: Floats, radius: float, colour: Colour, opacity: float, *, ring: float = 0.0) -> None:
    """Draw a disc, or a ring of this width, with smooth edges."""

    def cover(x: Floats, y: Floats) -> Floats:
        distance = np.sqrt((x - place[0]) ** 2 + (y - place[1]) ** 2)
        beyond = np.abs(distance - radius) - ring / 2 if ring else distance - radius
        return np.asarray(opacity * np.clip(0.5 - beyond, 0.0, 1.0))

    _blend(pixels, place - radius - 1.0, place + radius + 1.0, colour, cover)


def _line(pixels: Floats, start: Floats, end: Floats, width: float, colour: Colour) -> None:
    """Draw a line with round ends."""
    way = end - start
    square = float(way @ way)

    def cover(x: Floats, y: Floats) -> Floats:
        share = np.clip(((x - start[0]) * way[0] + (y - start[1]) * way[1]) / (square or 1.0), 0.0, 1.0)
        distance = np.sqrt((x - start[0] - share * way[0]) ** 2 + (y - start[1] - share * way[1]) ** 2)
        return np.asarray(np.clip(width / 2 + 0.5 - distance, 0.0, 1.0))

    _blend(pixels, np.minimum(start, end) - width, np.maximum(start, end) + width, colour, cover)


class Views:
    """Draws the worlds of an environment.

    Parameters
    ----------
    mode : {"human", "rgb_array"}, optional
        What `draw` does.
    """

    def __init__(self, mode: str | None) -> None:
        self._mode = mode
        self._picture: tuple[Any, Picture] | None = None
        # The picture in a window, if there is one.
        self._shown: Any = None

    def draw(self, place: Place) -> npt.NDArray[np.uint8] | None:
        """Return a picture of a world, or show it in a window, which does not stop the program, and return None.

        Raises
        ------
        RuntimeError
            If matplotlib cannot open a window here.
        """
        if self._picture is None or self._picture[0] is not place.arena:
            self._picture = place.arena, Picture(place.arena)
        pixels = self._picture[1].draw(place.groups)
        if self._mode == "rgb_array":
            return pixels
        from matplotlib import pyplot

        if self._shown is None:
            self._shown = _window(pyplot, pixels)
        figure = self._shown.figure
        # Nothing is shown once the user has closed the window.
        if pyplot.fignum_exists(figure.number):
            self._shown.set_data(pixels)
            figure.canvas.draw_idle()
            figure.canvas.start_event_loop(_PAUSE)
        return None

    def close(self) -> None:
        """Close the window, if there is one. Idempotent."""
        if self._shown is not None:
            from matplotlib import pyplot

            pyplot.close(self._shown.figure)
        self._shown = None


def _window(pyplot: Any, pixels: npt.NDArray[np.uint8]) -> Any:
    """Open a window, and return the picture in it."""
    try:
        figure, axes = pyplot.subplots(num="teamsight", figsize=(6.0, 6.0))
    except ImportError as error:
        raise RuntimeError(_NO_WINDOW) from error
    # None of a canvas that only makes files, which matplotlib chooses where there is no display.
    if getattr(figure.canvas, "required_interactive_framework", None) is None:
        pyplot.close(figure)
        raise RuntimeError(_NO_WINDOW)
    axes.set_axis_off()
    image = axes.imshow(pixels)
    figure.show()
    return image
