"""Panels beside and below each other, and what they share: ticks, titles, colours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from teamsight.analysis.plot.style import INK
from teamsight.analysis.studies.figures.dimension import Dimension
from teamsight.analysis.studies.figures.page import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure as Canvas

_MOST_COLUMNS = 4
# Ticks with a text along one side.
_MOST_TICKS = 32
# Numbers of which some get no text have at least so many ticks.
_LEAST_TICKS = 8
# Width of a character of a tick [inches].
_CHARACTER = 0.08
# Height of a line of ticks [inches].
_LINE = 0.16
# Width that a scale of colours takes at most, without its labels [inches].
_BAR = 0.32


class Layout(NamedTuple):
    """Numbers of panels, and of their rows and columns."""

    panels: int
    rows: int
    columns: int

    def axes_of(self, figure: Canvas, **further: Any) -> Any:
        """Return the axes of the panels, shape (rows, columns); those that are not needed are invisible."""
        axes = figure.subplots(self.rows, self.columns, squeeze=False, **further)
        for place in axes.flat[self.panels :]:
            place.set_axis_off()
        return axes

    def is_lowest(self, panel: int) -> bool:
        """Whether no panel is below this one."""
        return panel + self.columns >= self.panels


def layout_of(panels: int) -> Layout:
    """Return rows and columns of some panels: up to three in one row, otherwise as square as possible."""
    columns = panels if panels <= 3 else min(_MOST_COLUMNS, math.ceil(math.sqrt(panels)))
    return Layout(panels, math.ceil(panels / columns), columns)


def panel_title(axes: Axes, title: str) -> None:
    """Write the title of a panel."""
    if title:
        axes.set_title(title, loc="left", size=9.5, color=INK, wrap=True)


def width_of(dimension: Dimension) -> float:
    """Return the width of the longest text of a dimension [inches]."""
    return max(map(len, dimension.texts)) * _CHARACTER + 0.1


def room_below(dimension: Dimension, width: float) -> float:
    """Return the height of the texts below an axis if each has some room [inches]; 0 if they are not rotated."""
    rotation = _rotation(dimension, width)
    return math.sin(math.radians(rotation)) * width_of(dimension)


def label_ticks(axis: Axis, dimension: Dimension, width: float = math.inf) -> None:
    """Write the texts of a dimension at 0, 1, 2, …; not all of them if they are many.

    Parameters
    ----------
    axis : matplotlib Axis
        Where to write.
    dimension : Dimension
        The levels.
    width : float
        Room for each text [inches]; longer texts are rotated.
    """
    shown = range(0, len(dimension), _every(dimension, width))
    turned: dict[str, Any] = {}
    if rotation := _rotation(dimension, width):
        turned = {"rotation": rotation}
        turned |= {"ha": "right", "rotation_mode": "anchor"} if rotation < 90 else {}
    axis.set_ticks(list(shown), [dimension.texts[level] for level in shown], **turned)


def _every(dimension: Dimension, width: float) -> int:
    """Return which levels get a text, so that even rotated ones stay apart."""
    every = max(math.ceil(len(dimension) / _MOST_TICKS), math.ceil(_LINE / width))
    level = math.ceil(width_of(dimension) / width)
    # Of many numbers, some that stand level are read more easily than all.
    is_ruler = dimension.numbers is not None and len(dimension) >= _LEAST_TICKS * level
    return max(every, level) if is_ruler else every


def _rotation(dimension: Dimension, width: float) -> int:
    """Return by how many degrees the texts must be rotated."""
    room, longest = width * _every(dimension, width), width_of(dimension)
    if longest <= room + 0.1:
        return 0
    return 90 if longest > 4 * room or room < 2 * _LINE else 40


def means_in_view(axes: Axes, picture: Picture) -> None:
    """Limit the vertical axis, so that a few wide intervals do not flatten everything else; see `note_on_view`."""
    if view := _view_of(picture):
        axes.set_ylim(*view)


def note_on_view(picture: Picture) -> str:
    """Return how many intervals end outside the limits of `means_in_view`; empty if none does."""
    view = _view_of(picture)
    if view is None:
        return ""
    cells = picture.cells.statistics
    low, high = cells["low"].to_numpy(), cells["high"].to_numpy()
    bounded = np.isfinite(low) & np.isfinite(high)
    cut = int((bounded & ((low < view[0]) | (high > view[1]))).sum())
    return f"{cut:,} of {bounded.sum():,} intervals cut off at the edge" if cut else ""


def _view_of(picture: Picture) -> tuple[float, float] | None:
    """Return the limits of the vertical axis; None without runs."""
    cells = picture.cells.statistics
    cells = cells[cells["n"] > 0]
    if not len(cells):
        return None
    mean = cells["mean"].to_numpy()
    # Below and above the mean: the interval of a rate is not symmetric.
    wide = np.abs(cells[["low", "high"]].to_numpy() - mean[:, None])
    bounded = wide[np.isfinite(wide)]
    most = max(float(np.ptp(mean)), 3 * float(np.median(bounded))) if len(bounded) else 0.0
    shown = np.minimum(np.where(np.isfinite(wide), wide, 0.0), most)
    low, high = float((mean - shown[:, 0]).min()), float((mean + shown[:, 1]).max())
    quantity = picture.quantity
    if quantity.is_percent and not quantity.is_difference:
        low, high = max(low, 0.0), min(high, quantity.factor)
    if quantity.is_difference:
        low, high = min(low, 0.0), max(high, 0.0)
    margin = 0.04 * (high - low) or max(abs(high), 1.0) * 0.05
    return low - margin, high + margin


def colour_range(picture: Picture) -> Normalize:
    """Return the range of the colours: that of the means, or symmetric around 0 for a difference."""
    from matplotlib.colors import Normalize

    means = picture.cells.statistics["mean"].to_numpy()
    means = means[np.isfinite(means)]
    if not len(means):
        return Normalize(0.0, 1.0)
    if picture.quantity.is_difference:
        most = float(np.abs(means).max()) or 1.0
        return Normalize(-most, most)
    low, high = float(means.min()), float(means.max())
    return Normalize(low, high) if low < high else Normalize(low - 0.5, high + 0.5)


def colour_bar(figure: Canvas, shown: ScalarMappable, axes: Any, label: str, *, pad: float = 0.12) -> None:
    """Draw the scale of colours on the right of one or more panels.

    Parameters
    ----------
    figure : matplotlib Figure
        Where to draw.
    shown : matplotlib ScalarMappable
        What has the colours.
    axes : Axes or ndarray of Axes
        The panels.
    label : str
        Label of the scale.
    pad : float
        Distance from the panels [inches].
    """
    panels = np.atleast_1d(axes).ravel().tolist()
    share = len({panel.get_subplotspec().colspan.start for panel in panels}) / panels[0].get_gridspec().ncols
    # The default is a share of the panels, which is wide beside wide ones.
    width = figure.get_figwidth() * share
    bar = figure.colorbar(shown, ax=panels, fraction=_BAR / width, pad=pad / width, shrink=0.95, aspect=32)
    bar.set_label(label, size=10)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=9)
