"""A heat map: in each cell the mean, half the width of its interval and, where they differ, the number of runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.plot.kinds import colour_cells, places, write_numbers
from teamsight.analysis.plot.style import DIVERGING, SEQUENTIAL
from teamsight.analysis.studies.figures.choose import Choice, panels_of
from teamsight.analysis.studies.figures.dimension import Dimension
from teamsight.analysis.studies.figures.page import Picture, page, runs_of
from teamsight.analysis.studies.figures.panels import (
    Layout,
    colour_bar,
    colour_range,
    label_ticks,
    layout_of,
    panel_title,
    room_below,
    width_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure as Canvas

# Sizes [points] of mean, half width and number of runs: for few cells, for more, for many.
_SIZES = (11.0, 8.8, 7.4), (9.0, 7.2, 6.2), (7.2, 5.8, 5.2)
# Mean width of a character in its size, and height of a line in its size.
_CHARACTER, _LINE = 0.62, 1.3
# The largest pictures with numbers, and panels without [inches].
_WIDEST, _HIGHEST = 22.0, 17.0
_PANEL = 5.2
# Columns are made wider for their names up to this width of all [inches].
_ROOM_FOR_NAMES = 7.5
_EMPTY = "#dadada"


class _Grid(NamedTuple):
    """The statistics of a panel: rows along y, columns along x."""

    mean: NDArray[np.float64]
    wide: NDArray[np.float64]
    n: NDArray[np.float64]


class _Texts(NamedTuple):
    """How the numbers are written: their sizes and the size of a cell [inches]; no sizes if they do not fit."""

    sizes: tuple[float, ...]
    width: float
    height: float
    show_n: bool


def draw_heat_map(picture: Picture, choice: Choice) -> Canvas:
    """Return a heat map for each combination of the axes that are not x and y.

    Cells without runs are grey. A difference whose interval includes 0 is in brackets. If the numbers do not fit into
    the cells, a second map shows the half widths of the intervals.
    """
    x, y = choice.x, choice.y
    assert x is not None
    assert y is not None
    panels = [(title, _grid_of(picture, x, y, settings)) for title, settings in panels_of(choice)]
    layout = layout_of(len(panels))
    texts = _texts_of(picture, x, y, [grid for _, grid in panels], layout)
    is_pair = not texts.sizes and len(panels) == 1
    layout = layout_of(2) if is_pair else layout
    label = max(map(len, y.texts))
    width = layout.columns * (texts.width * len(x) + 0.25) + 1.6 + min(0.075 * label, 2.4)
    height = layout.rows * (texts.height * len(y) + 0.35) + 0.9 + layout.rows * room_below(x, texts.width)
    figure = page(picture, _title(picture, x, y), _notes(picture, texts), width, height)
    axes = layout.axes_of(figure)
    norm = colour_range(picture)
    for place, (title, grid) in zip(axes.flat, panels, strict=False):
        _draw_map(place, grid.mean, norm, picture, texts, grid)
        panel_title(place, title)
    _finish(figure, axes, x, y, layout, texts.width)
    colour_bar(figure, axes[0, 0].images[0], axes[0, 0] if is_pair else axes, picture.quantity.label)
    if is_pair:
        _draw_half_widths(figure, axes[0, 1], panels[0][1])
    return figure


def _grid_of(picture: Picture, x: Dimension, y: Dimension, settings: NDArray[np.bool_] | None) -> _Grid:
    cells = picture.cells.statistics
    chosen = np.ones(len(cells), bool) if settings is None else settings
    grids = [np.full((len(y), len(x)), np.nan) for _ in range(3)]
    columns = (cells["mean"], (cells["high"] - cells["low"]) / 2, cells["n"])
    for grid, values in zip(grids, columns, strict=True):
        grid[y.levels[chosen], x.levels[chosen]] = values.to_numpy()[chosen]
    return _Grid(*grids)


def _draw_map(
    axes: Axes, values: NDArray[np.float64], norm: Normalize, picture: Picture, texts: _Texts, grid: _Grid
) -> None:
    import matplotlib

    colours = matplotlib.colormaps[DIVERGING if picture.quantity.is_difference else SEQUENTIAL]
    inks = np.array(colour_cells(axes, values, norm, colours.with_extremes(bad=_EMPTY)))
    if not texts.sizes:
        return
    column, row = places(values.shape)
    heights = [size * _LINE for size in texts.sizes]
    top = sum(heights) / 2
    for size, height, lines in zip(texts.sizes, heights, _lines(picture, grid, texts), strict=True):
        top -= height / 2
        known = np.array([bool(line) for line in lines])
        written = [line for line in lines if line]
        write_numbers(axes, column[known], row[known], written, inks[known].tolist(), size=size, above=top)
        top -= height / 2


def _lines(picture: Picture, grid: _Grid, texts: _Texts) -> list[list[str]]:
    """Return the texts of all cells: the means, the half widths, and the numbers of runs if they are shown."""
    quantity = picture.quantity
    means, widths, runs = [], [], []
    for mean, wide, n in zip(grid.mean.flat, grid.wide.flat, grid.n.flat, strict=True):
        text = "" if np.isnan(mean) else quantity.finer(wide, mean).write(mean)
        is_open = quantity.is_difference and abs(mean) <= wide
        means.append(f"({text})" if is_open and text else text)
        widths.append(f"±{quantity.write_width(wide, mean)}" if np.isfinite(wide) else "")
        runs.append(f"n {n:.0f}" if n > 0 else "")
    return [means, widths, runs][: len(texts.sizes)]


def _texts_of(picture: Picture, x: Dimension, y: Dimension, grids: list[_Grid], layout: Layout) -> _Texts:
    """Return the largest sizes of the numbers with which the picture is not too large."""
    n = np.concatenate([grid.n[grid.n > 0] for grid in grids])
    show_n = len(n) > 0 and n.min() < n.max()
    count = 3 if show_n else 2
    for sizes in _SIZES[max(len(x), len(y)) * layout.columns > 12 :]:
        trial = _Texts(sizes[:count], 0.0, 0.0, show_n)
        if len(x) * len(y) * layout.rows * layout.columns > 4000:
            break
        widths = [
            max((len(text) for grid in grids for text in _lines(picture, grid, trial)[line]), default=1) * size
            for line, size in enumerate(trial.sizes)
        ]
        width = max(max(widths) * _CHARACTER / 72 + 0.12, 0.42)
        height = max(sum(trial.sizes) * _LINE / 72 + 0.1, 0.3)
        # Few cells are larger than their numbers.
        width, height = max(width, min(0.9, 3.6 / len(x))), max(height, min(0.62, 2.6 / len(y)))
        # Names are not rotated where there are few.
        if (named := width_of(x)) * len(x) * layout.columns <= _ROOM_FOR_NAMES:
            width = max(width, named)
        if layout.columns * len(x) * width <= _WIDEST and layout.rows * len(y) * height <= _HIGHEST:
            return _Texts(trial.sizes, width, height, show_n)
    panel = _PANEL if layout.columns < 3 else 3.4
    return _Texts((), panel / len(x), panel * 0.85 / len(y), show_n)


def _notes(picture: Picture, texts: _Texts) -> list[str]:
    cells = picture.cells.statistics
    wide = ((cells["high"] - cells["low"]) / 2).to_numpy()
    wide = wide[np.isfinite(wide)]
    notes = [runs_of(picture.cells, "a cell")]
    if not len(wide):
        notes.append("intervals need two runs a cell")
    elif texts.sizes:
        notes.append("mean ± half width of its 95 % interval")
    else:
        median, largest = (picture.quantity.write_width(float(one), 0.0) for one in (np.median(wide), wide.max()))
        notes.append(f"half widths of the 95 % intervals: median {median}, largest {largest}")
    if picture.quantity.is_difference:
        is_open = (cells["low"] <= 0) & (cells["high"] >= 0)
        brackets = " (in brackets)" if texts.sizes else ""
        notes.append(f"{is_open.sum():,} of {cells['n'].gt(0).sum():,} intervals include 0{brackets}")
    if (cells["n"] == 0).any():
        notes.append("grey: no values" if np.isnan(picture.cells.values).any() else "grey: no runs")
    return notes


def _title(picture: Picture, x: Dimension, y: Dimension) -> str:
    title = picture.quantity.title
    return f"{title[0].upper()}{title[1:]} by {x.label} and {y.label}"


def _draw_half_widths(figure: Canvas, axes: Axes, grid: _Grid) -> None:
    import matplotlib
    from matplotlib.colors import Normalize

    wide = np.where(np.isfinite(grid.wide), grid.wide, np.nan)
    most = float(np.nanmax(wide)) if np.isfinite(wide).any() else 1.0
    colour_cells(axes, wide, Normalize(0.0, most or 1.0), matplotlib.colormaps["cividis"].with_extremes(bad=_EMPTY))
    colour_bar(figure, axes.images[0], axes, "half width of the 95 % interval")


def _finish(figure: Canvas, axes: Any, x: Dimension, y: Dimension, layout: Layout, width: float) -> None:
    for number, place in enumerate(axes.flat):
        place.spines[:].set_visible(False)
        place.tick_params(length=0, labelsize=9)
        label_ticks(place.xaxis, x, width)
        label_ticks(place.yaxis, y)
        if layout.is_lowest(number):
            place.set_xlabel(x.label)
        if number % layout.columns == 0:
            place.set_ylabel(y.label)
