"""A quantity over team size and arena radius: the surface as the paper draws it, and a heat map with its numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.plot.style import DIVERGING, INK, RADIUS_LABEL, ROBOTS_LABEL, SEQUENTIAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure as Canvas

#: Size of a row of surface and heat map, and height of the head [inches].
WIDTH, HEIGHT, HEAD = 13.6, 7.6, 1.0


class Look(NamedTuple):
    """Label, format and range of a quantity."""

    label: str
    write: Callable[[float], str]
    low: float
    high: float
    around_zero: bool = False
    #: Range of the surface's axis, if it differs from the range of the colours.
    heights: tuple[float, float] | None = None


def draw_row(
    figure: Canvas,
    grid: pd.DataFrame,
    look: Look,
    *,
    row: int = 0,
    rows: int = 1,
    open_cells: pd.DataFrame | None = None,
) -> None:
    """Draw `grid` twice: as a surface on the left and as a heat map on the right.

    Parameters
    ----------
    figure : matplotlib Figure
        Of `WIDTH` by `rows` × `HEIGHT` + `HEAD` inches.
    grid : DataFrame
        One row a team size, one column a radius.
    look : Look
        Its label, format and range.
    row, rows : int
        Number of this row, from the top, and number of rows.
    open_cells : DataFrame of bool, optional
        Cells whose number is written in brackets.
    """
    import matplotlib
    from matplotlib.colors import Normalize
    from matplotlib.ticker import MaxNLocator

    norm = Normalize(look.low, look.high)
    colours = matplotlib.colormaps[DIVERGING if look.around_zero else SEQUENTIAL]
    total = rows * HEIGHT + HEAD
    bottom = (rows - 1 - row) * HEIGHT / total
    height = HEIGHT / total
    solid: Any = figure.add_axes((-0.01, bottom + 0.02 * height, 0.54, 0.98 * height), projection="3d")
    _surface(solid, grid, look, norm, colours)
    flat = figure.add_axes((0.595, bottom + 0.085 * height, 0.32, 0.88 * height))
    _heat_map(flat, grid, look, norm, colours, open_cells)
    scale = figure.add_axes((0.93, bottom + 0.085 * height, 0.014, 0.88 * height))
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(norm, colours), cax=scale, ticks=MaxNLocator(9, integer=True))
    bar.set_label(look.label, size=10)
    bar.outline.set_visible(False)


def _surface(axes: Any, grid: pd.DataFrame, look: Look, norm: Normalize, colours: Colormap) -> None:
    robots, radius = np.meshgrid(grid.index, grid.columns, indexing="ij")
    height = grid.to_numpy(float)
    look_of_faces = {"cmap": colours, "norm": norm, "linewidth": 0.35, "edgecolor": "#33333388", "shade": False}
    axes.plot_surface(robots, radius, height, rstride=1, cstride=1, **look_of_faces)
    axes.set_zlim(*(look.heights or (look.low, look.high)))
    # The viewpoint is above few robots in a large arena, where every surface of the paper is low and hides nothing.
    axes.view_init(elev=27, azim=128)
    axes.set_box_aspect((1.15, 1.15, 0.92), zoom=0.97)
    axes.set_xticks(_ticks(list(grid.index), 5))
    axes.set_yticks(grid.columns.to_numpy())
    axes.set_xlabel(ROBOTS_LABEL, labelpad=8)
    axes.set_ylabel(RADIUS_LABEL, labelpad=8)
    axes.set_zlabel(look.label, labelpad=8)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
        axis._axinfo["grid"].update(color="#dcdcdc", linewidth=0.6)
    axes.tick_params(labelsize=9)


def _heat_map(
    axes: Axes, grid: pd.DataFrame, look: Look, norm: Normalize, colours: Colormap, open_cells: pd.DataFrame | None
) -> None:
    values = grid.to_numpy(float)
    axes.imshow(values, cmap=colours, norm=norm, aspect="auto", origin="lower")
    light = _luminance(colours(norm(values))) > 0.45
    for (row, column), value in np.ndenumerate(values):
        text = look.write(value)
        if open_cells is not None and open_cells.iloc[row, column]:
            text = f"({text})"
        axes.text(column, row, text, ha="center", va="center", size=8.5, color=INK if light[row, column] else "white")
    axes.set_xticks(range(values.shape[1]), [f"{radius:g}" for radius in grid.columns])
    axes.set_yticks(range(values.shape[0]), [str(robots) for robots in grid.index], size=8.5)
    axes.set_xlabel(RADIUS_LABEL)
    axes.set_ylabel(ROBOTS_LABEL)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def _luminance(colour: NDArray[np.float64]) -> NDArray[np.float64]:
    linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    # Perceived lightness: the threshold is a middle grey.
    return np.asarray(np.cbrt(linear[..., :3] @ np.array([0.2126, 0.7152, 0.0722])) - 0.1)


def _ticks(values: list[int], step: int) -> NDArray[np.int64]:
    """Return round values within the range, and both ends."""
    low, high = min(values), max(values)
    inner = np.arange(step, high, step)
    return np.unique(np.concatenate(([low], inner[inner > low + 1], [high])))
