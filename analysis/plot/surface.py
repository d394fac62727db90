"""A quantity over team size and arena radius: the surface as the paper draws it, and a heat map with its numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.plot.kinds import draw_heat_map, texts_of
from teamsight.analysis.plot.style import DIVERGING, RADIUS_LABEL, ROBOTS_LABEL, SEQUENTIAL

if TYPE_CHECKING:
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure as Canvas

__all__ = ["HEAD", "HEIGHT", "WIDTH", "Look", "draw_row", "draw_surface", "facets_of"]

#: Size of a row of surface and heat map, and height of the head [inches].
WIDTH, HEIGHT, HEAD = 13.6, 7.6, 1.0
# Edges of the facets against the facets: darker, and opaque.
_EDGES = 0.82, 0.82, 0.82, 1.0


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
    open_cells: pd.DataFrame | None = None,
) -> None:
    """Draw `grid` twice: as a surface on the left and as a heat map on the right.

    Parameters
    ----------
    figure : matplotlib Figure
        `WIDTH` inches wide and at least `HEAD` + (`row` + 1) × `HEIGHT` high; what is below the row stays free.
    grid : DataFrame
        One row a team size, one column a radius.
    look : Look
        Its label, format and range.
    row : int
        Number of this row, from the top.
    open_cells : DataFrame of bool, optional
        Cells whose number is written in brackets.
    """
    import matplotlib
    from matplotlib.colors import Normalize
    from matplotlib.ticker import MaxNLocator

    norm = Normalize(look.low, look.high)
    colours = matplotlib.colormaps[DIVERGING if look.around_zero else SEQUENTIAL]
    total = figure.get_figheight()
    bottom = 1 - (HEAD + (row + 1) * HEIGHT) / total
    height = HEIGHT / total
    solid: Any = figure.add_axes((-0.01, bottom + 0.02 * height, 0.54, 0.98 * height), projection="3d")
    draw_surface(solid, grid, look, norm, colours)
    solid.set_xticks(_ticks(list(grid.index), 5))
    solid.set_yticks(grid.columns.to_numpy())
    flat = figure.add_axes((0.595, bottom + 0.085 * height, 0.32, 0.88 * height))
    draw_heat_map(flat, grid, texts_of(grid, look.write, open_cells), norm, colours)
    scale = figure.add_axes((0.93, bottom + 0.085 * height, 0.014, 0.88 * height))
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(norm, colours), cax=scale, ticks=MaxNLocator(9, integer=True))
    if look.around_zero:
        # Colours that no cell has would fill most of the scale.
        values = grid.to_numpy(float)
        low, high = min(0.0, np.nanmin(values)), max(0.0, np.nanmax(values))
        bar.ax.set_ylim(low, high if high > low else look.high)
    bar.set_label(look.label, size=10)
    bar.outline.set_visible(False)


def draw_surface(
    axes: Any,
    grid: pd.DataFrame,
    look: Look,
    norm: Normalize,
    colours: Colormap,
) -> None:
    """Draw a grid as a surface.

    Parameters
    ----------
    axes : matplotlib Axes3D
        Where to draw.
    grid : DataFrame
        The values; index and columns are the places of its rows and columns. The surface has holes around NaN.
    look : Look
        Label and range of the values.
    norm, colours : matplotlib Normalize, Colormap
        The colour of each value.
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    facets, colour = facets_of(grid, norm, colours)
    known = np.isfinite(facets).all(axis=(1, 2))
    facets, colour = facets[known], colour[known]
    axes.add_collection3d(Poly3DCollection(facets, facecolors=colour, edgecolors=colour * _EDGES, linewidths=0.4))
    axes.set_xlim(*_padded(grid.index.to_numpy(float)))
    axes.set_ylim(*_padded(grid.columns.to_numpy(float)))
    axes.set_zlim(*(look.heights or (look.low, look.high)))
    # The viewpoint is above few robots in a large arena, where every surface of the paper is low and hides nothing.
    axes.view_init(elev=27, azim=128)
    axes.set_box_aspect((1.15, 1.15, 0.92), zoom=0.97)
    axes.set_xlabel(ROBOTS_LABEL, labelpad=8)
    axes.set_ylabel(RADIUS_LABEL, labelpad=8)
    axes.set_zlabel(look.label, labelpad=8)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.97, 1.0))
        axis._axinfo["grid"].update(color="#dcdcdc", linewidth=0.6)
    axes.tick_params(labelsize=9)


def facets_of(
    grid: pd.DataFrame, norm: Normalize, colours: Colormap
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the facets of a surface whose vertices are the cells of a grid, and the colour of each facet.

    Each vertex has the quarters of the facets around it in the colour of its cell. A facet of one colour would have to
    average its corners, and would show values that no cell has.

    Returns
    -------
    facets : ndarray of float64, shape (4 (n − 1)(m − 1), 4, 3)
        Corners (team size, radius, value) of each facet of a grid of n team sizes and m radii.
    colour : ndarray of float64, shape (4 (n − 1)(m − 1), 4)
        Red, green, blue and opacity of each facet, in [0, 1].
    """
    values = grid.to_numpy(float)
    fine = _halved(_halved(values).T).T
    robots = _halved(grid.index.to_numpy(float))
    radius = _halved(grid.columns.to_numpy(float))
    points = np.stack(np.broadcast_arrays(robots[:, np.newaxis], radius, fine), axis=-1)
    corners = (points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:])
    facets = np.stack(corners, axis=2).reshape(-1, 4, 3)
    row, column = ((np.arange(2 * length - 2) + 1) // 2 for length in values.shape)
    return facets, colours(norm(values[np.ix_(row, column)])).reshape(-1, 4)


def _halved(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values along the first axis with the mean of each two neighbours between them."""
    fine = np.empty((2 * len(values) - 1, *values.shape[1:]))
    fine[::2] = values
    fine[1::2] = (values[1:] + values[:-1]) / 2
    return fine


def _padded(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the range of values with a small margin, so that the labels at both ends of an edge stay apart."""
    low, high = float(values.min()), float(values.max())
    margin = 0.02 * (high - low) or 0.5
    return low - margin, high + margin


def _ticks(values: list[int], step: int) -> NDArray[np.int64]:
    """Return round values within the range, and both ends."""
    low, high = min(values), max(values)
    inner = np.arange(step, high, step)
    return np.unique(np.concatenate(([low], inner[inner > low + 1], [high])))
