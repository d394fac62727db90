"""A quantity over team size and arena radius as a map of coloured cells, each with its number."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.plot.style import INK, RADIUS_LABEL, ROBOTS_LABEL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.path import Path

#: Size of the numbers [points].
SIZE = 8.5


def draw_heat_map(axes: Axes, grid: pd.DataFrame, texts: Sequence[str], norm: Normalize, colours: Colormap) -> None:
    """Draw a map of a grid.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    grid : DataFrame
        One row a team size, one column a radius.
    texts : sequence of str
        What is written into each cell, row by row.
    norm, colours : matplotlib Normalize, Colormap
        The colour of each value.
    """
    values = grid.to_numpy(float)
    inks = colour_cells(axes, values, norm, colours)
    write_numbers(axes, *places(values.shape), texts, inks)
    axes.set_xticks(range(values.shape[1]), [f"{radius:g}" for radius in grid.columns])
    # Ticks of 30 team sizes would take as long as the rest of the map.
    names = [str(robots) for robots in grid.index]
    write_numbers(axes, np.full(len(names), -0.8), np.arange(len(names)), names, [INK] * len(names))
    axes.set_yticks([])
    axes.set_xlabel(RADIUS_LABEL)
    axes.set_ylabel(ROBOTS_LABEL, labelpad=24)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def colour_cells(axes: Axes, values: NDArray[np.float64], norm: Normalize, colours: Colormap) -> list[str]:
    """Draw values of shape (rows, columns) as coloured cells, and return the colour of a readable text in each."""
    axes.imshow(values, cmap=colours, norm=norm, aspect="auto", origin="lower")
    light = _luminance(colours(norm(values))) > 0.45
    return [INK if one else "white" for one in light.flat]


def places(shape: tuple[int, ...]) -> tuple[NDArray[np.generic], NDArray[np.generic]]:
    """Return column and row of each cell, row by row."""
    row, column = np.indices(shape).reshape(2, -1)
    return column, row


def write_numbers(
    axes: Axes,
    x: NDArray[np.generic],
    y: NDArray[np.generic],
    texts: Sequence[str],
    colours: Sequence[str],
    *,
    size: float = SIZE,
    above: float = 0.0,
) -> None:
    """Write many short texts as one artist: a Text for each of 270 cells takes most of the time of a figure.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to write.
    x, y : ndarray, shape (n,)
        Where the middle of each text is.
    texts, colours : sequence of str
        The texts and their colours.
    size, above : float
        Size of the texts, and how far above the place they are written [points].
    """
    from matplotlib.collections import PathCollection
    from matplotlib.transforms import Affine2D

    numbers = PathCollection(
        [outline(text, size) for text in texts],
        facecolors=colours, linewidths=0, offsets=np.column_stack([x, y]), offset_transform=axes.transData,
        clip_on=False,
    )  # fmt: skip
    numbers.set_transform(Affine2D().translate(0.0, above).scale(1 / 72) + axes.figure.dpi_scale_trans)
    axes.add_collection(numbers, autolim=False)


@cache
def outline(text: str, size: float = SIZE) -> Path:
    """Return the outline of a number [points], with its middle at the origin."""
    from matplotlib.path import Path
    from matplotlib.textpath import TextPath

    path = TextPath((0, 0), text, size=size)
    # The middle of a digit's height: brackets, which reach lower, do not move the number that they enclose.
    middle = path.vertices[:, 0].max() / 2, TextPath((0, 0), "0", size=size).vertices[:, 1].max() / 2
    return Path(path.vertices - middle, path.codes)


def _luminance(colour: NDArray[np.float64]) -> NDArray[np.float64]:
    linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    # Perceived lightness: the threshold is a middle grey.
    return np.asarray(np.cbrt(linear[..., :3] @ np.array([0.2126, 0.7152, 0.0722])) - 0.1)
