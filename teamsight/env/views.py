"""What `render` of an environment does: return a picture, or show it in a window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TARGETS
from teamsight.agents.group import Group
from teamsight.env.picture import Bodies, Picture

if TYPE_CHECKING:
    from teamsight.env.batch import Batch

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


class Views:
    """Draws the world of an environment.

    Parameters
    ----------
    mode : {"human", "rgb_array"}, optional
        What `draw` does.
    """

    def __init__(self, mode: str | None) -> None:
        self._mode = mode
        self._picture: tuple[Any, Picture] | None = None
        self._shown: Window | None = None

    def begin(self) -> None:
        """Forget the arena: the next world may have another."""
        self._picture = None

    def draw(self, batch: Batch, place: int) -> npt.NDArray[np.uint8] | None:
        """Return a picture of a world, or show it and return None; see `TeamParallelEnv.render`."""
        if self._mode is None:
            raise RuntimeError(NO_MODE)
        if not batch.has_begun(place):
            raise RuntimeError("render(): no episode has begun; call reset() first")
        arena = batch.arena(place)
        if self._picture is None or self._picture[0] is not arena:
            self._picture = arena, Picture(arena)
        groups = list(batch.groups(place))
        pixels = self._picture[1].draw([shown_of(group, groups) for group in reversed(groups)])
        if self._mode == "rgb_array":
            return pixels
        if self._shown is None:
            self._shown = Window(pixels)
        self._shown.show(pixels)
        return None

    def close(self) -> None:
        """Close the window, if there is one. Idempotent."""
        if self._shown is not None:
            self._shown.close()
        self._shown = None


def shown_of(group: Group, groups: list[Group]) -> Bodies:
    """Return what is drawn of one of the groups of a world; robots are those on a team."""
    bodies = group.bodies
    is_observed = np.zeros(len(group), bool)
    for observer in groups:
        relation = observer.relations.get(TARGETS)
        if relation is not None and relation.counts and group in relation.observed:
            start, index = relation.true_lists
            is_observed |= np.isin(bodies.identity, relation.everyone[index[: start[-1]]])
    reach = group.bodies.sensing_range if group.team is not None else np.full(len(group), np.nan)
    return Bodies(bodies.position, bodies.heading, reach, bodies.active, is_observed)


class Window:
    """A window of matplotlib that shows pictures without stopping the program.

    Parameters
    ----------
    pixels : ndarray, shape (height, width, 3), uint8
        The first picture.

    Raises
    ------
    RuntimeError
        If matplotlib cannot open a window here.
    """

    def __init__(self, pixels: npt.NDArray[np.uint8]) -> None:
        from matplotlib import pyplot

        self._pyplot = pyplot
        try:
            self._figure, axes = pyplot.subplots(num="teamsight", figsize=(6.0, 6.0))
        except ImportError as error:
            raise RuntimeError(_NO_WINDOW) from error
        # None of a canvas that only makes files, which matplotlib chooses where there is no display.
        if getattr(self._figure.canvas, "required_interactive_framework", None) is None:
            pyplot.close(self._figure)
            raise RuntimeError(_NO_WINDOW)
        axes.set_axis_off()
        self._image = axes.imshow(pixels)
        self._figure.show()

    def show(self, pixels: npt.NDArray[np.uint8]) -> None:
        """Show another picture; does nothing once the user has closed the window."""
        if self._pyplot.fignum_exists(self._figure.number):
            self._image.set_data(pixels)
            self._figure.canvas.draw_idle()
            self._figure.canvas.start_event_loop(_PAUSE)

    def close(self) -> None:
        """Close the window."""
        self._pyplot.close(self._figure)
