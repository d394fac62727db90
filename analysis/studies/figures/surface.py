"""A measure over two axes of numbers as a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.plot.style import DIVERGING, SEQUENTIAL
from teamsight.analysis.plot.surface import Look, draw_surface
from teamsight.analysis.studies.figures.choose import Choice, panels_of
from teamsight.analysis.studies.figures.dimension import Dimension
from teamsight.analysis.studies.figures.page import Picture, page, runs_of
from teamsight.analysis.studies.figures.panels import colour_bar, colour_range, layout_of, panel_title

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

# A panel [inches], and the part of it on which the surface itself stands.
_PANEL = 6.4
_MOST_TICKS = 7


def draw_surfaces(picture: Picture, choice: Choice) -> Canvas:
    """Return a surface of the means over x and y for each combination of the other axes."""
    import matplotlib

    x, y = choice.x, choice.y
    assert x is not None
    assert y is not None
    panels = panels_of(choice)
    layout = layout_of(len(panels))
    size = _PANEL if len(panels) == 1 else 4.9
    title = picture.quantity.title
    title = f"{title[0].upper()}{title[1:]} by {x.label} and {y.label}"
    notes = [f"means of {runs_of(picture.cells, 'a vertex')}", "a heat map shows the intervals"]
    grids = [_grid(picture, x, y, settings) for _, settings in panels]
    if not any(_faces(grid).any() for grid in grids):
        raise ValueError(
            "kind=surface: needs runs of four settings that are neighbours along both axes; give --kind "
            f"{'heat-map' if picture.cells.is_grid else 'scatter'}"
        )
    if not all(_faces(grid).all() for grid in grids):
        notes.append("no surface beside settings without runs")
    figure = page(picture, title, notes, layout.columns * size + 0.6, layout.rows * 0.88 * size)
    norm = colour_range(picture)
    colours = matplotlib.colormaps[DIVERGING if picture.quantity.is_difference else SEQUENTIAL]
    low, high = float(norm.vmin or 0.0), float(norm.vmax or 0.0)
    # The colours of a difference are symmetric around 0, its heights need not be.
    means = picture.cells.statistics["mean"].to_numpy()
    heights = (min(0.0, np.nanmin(means)), max(0.0, np.nanmax(means))) if picture.quantity.is_difference else None
    look = Look(picture.quantity.label, picture.quantity.write, low, high, heights=heights)
    axes = layout.axes_of(figure, subplot_kw={"projection": "3d"})
    for place, (name, _), grid in zip(axes.flat, panels, grids, strict=False):
        table = pd.DataFrame(grid, index=_places(y), columns=_places(x))
        draw_surface(place, table, look, norm, colours, (y.label, x.label))
        place.view_init(elev=27, azim=_azimuth(grid))
        _ticks(place.xaxis, y)
        _ticks(place.yaxis, x)
        place.tick_params(labelsize=8)
        panel_title(place, name)
    # The vertical axis has the label.
    colour_bar(figure, matplotlib.cm.ScalarMappable(norm, colours), axes, "", pad=0.5)
    return figure


def _grid(picture: Picture, x: Dimension, y: Dimension, settings: NDArray[np.bool_] | None) -> NDArray[np.float64]:
    """Return the means of a panel, rows along y; NaN without runs."""
    cells = picture.cells.statistics["mean"].to_numpy()
    chosen = np.ones(len(cells), bool) if settings is None else settings
    grid = np.full((len(y), len(x)), np.nan)
    grid[y.levels[chosen], x.levels[chosen]] = cells[chosen]
    return grid


def _faces(grid: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return where all four corners of the surface are known."""
    known = np.isfinite(grid)
    found: NDArray[np.bool_] = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    return found


def _azimuth(grid: NDArray[np.float64]) -> float:
    """Return from where the surface is seen: from above its lowest corner, which hides nothing."""
    rows, columns = (np.arange(length) >= length / 2 for length in grid.shape)
    corners = {(False, True): 128.0, (True, True): 52.0, (False, False): -128.0, (True, False): -52.0}
    quarters = {corner: grid[np.ix_(rows == corner[0], columns == corner[1])] for corner in corners}
    known = {corner: float(np.nanmean(quarter)) for corner, quarter in quarters.items() if np.isfinite(quarter).any()}
    return corners[min(known, key=known.__getitem__)] if known else 128.0


def _places(dimension: Dimension) -> np.ndarray[Any, Any]:
    # Three dimensions have no logarithmic scale.
    return np.log10(dimension.places) if dimension.is_logarithmic else dimension.places


def _ticks(axis: Any, dimension: Dimension) -> None:
    """Write some of the values, far enough apart."""
    places = _places(dimension)
    least = np.ptp(places) / _MOST_TICKS
    shown = [0]
    for level, place in enumerate(places):
        if place - places[shown[-1]] >= least:
            shown.append(level)
    axis.set_ticks(places[shown], [dimension.texts[level] for level in shown])
