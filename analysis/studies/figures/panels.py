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
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure as Canvas

_MOST_COLUMNS = 4
# Ticks with a text along one side.
_MOST_TICKS = 40
# Width of a character of a tick [inches].
_CHARACTER = 0.082


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
    every = math.ceil(len(dimension) / _MOST_TICKS)
    if math.isfinite(width):
        every = max(every, math.ceil(0.16 / width))
    shown = range(0, len(dimension), every)
    texts = [dimension.texts[level] for level in shown]
    longest = max(map(len, texts)) * _CHARACTER
    if longest <= width * every:
        axis.set_ticks(list(shown), texts)
    else:
        steep = longest > 4 * width * every or width * every < 0.3
        turned = {"rotation": 90} if steep else {"rotation": 40, "ha": "right", "rotation_mode": "anchor"}
        axis.set_ticks(list(shown), texts, **turned)


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
