"""The kinds of panels of which all figures are made: means with intervals, maps with their numbers, distributions."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from teamsight.analysis.plot.style import (
    FAINT,
    INK,
    RADIUS_LABEL,
    ROBOTS_LABEL,
    canvas,
    plain,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure as Canvas
    from matplotlib.path import Path

#: Size of the numbers in a map [points].
SIZE = 8.5
#: From dark to light along the colours of numbers; without the lightest shades, which are faint on white.
SHADES = 0.0, 0.86
# More bands hide each other.
_MOST_CURVES = 4
# Inches: the narrowest figure, its margins, and a line of the head for each point of its size.
_NARROWEST, _MARGIN, _LINE = 6.4, 0.3, 0.0212
# Mean width of a character in its size.
_CHARACTER = {"normal": 0.54, "bold": 0.6}
_WARNING = "#b02a30"


def rows_and_columns(panels: int) -> tuple[int, int]:
    """Return rows and columns of some panels: up to three in one row, otherwise as square as possible."""
    columns = panels if panels <= 3 else min(4, math.ceil(math.sqrt(panels)))
    return math.ceil(panels / columns), columns


def panels(
    title: str, about: str | Sequence[str], names: Sequence[str], *, x: str | Sequence[str] = "",
    y: str | Sequence[str] = "", warning: str = "", columns: int | None = None, size: tuple[float, float] = (3.7, 3.3),
    more: tuple[float, float] = (0.0, 0.0), is_plain: bool = True, **further: Any,
) -> tuple[Canvas, list[Axes]]:  # fmt: skip
    """Return a figure with a head, whose lines are wrapped, and one empty panel for each name; its label is the title.

    Parameters
    ----------
    title : str
        What was found.
    about : str or sequence of str
        What was simulated, and how to read the figure; each begins a line.
    names : sequence of str
        The title of each panel.
    x, y : str or sequence of str
        Name and unit of the axes: one for each panel, or one of all, which only those at the edges show.
    warning : str
        What is missing.
    columns : int, optional
        Panels beside each other; see `rows_and_columns`.
    size, more : tuple of float
        Width and height of a panel, and further room in all [inches].
    is_plain : bool
        Whether panels have a grid behind the data.
    **further
        Further arguments of ``figure.subplots``, such as ``sharey``.
    """
    rows, columns = rows_and_columns(len(names)) if columns is None else (-(-len(names) // columns), columns)
    width, room = max(columns * size[0] + more[0], _NARROWEST), rows * size[1] + more[1]
    lines = [
        (line, points, colour, weight)
        for text, points, colour, weight in (
            (title, 14.0, INK, "bold"),
            (warning, 9.5, _WARNING, "bold"),
            *((one, 9.5, FAINT, "normal") for one in ([about] if isinstance(about, str) else about)),
        )
        for line in textwrap.wrap(text, int((width - 2 * _MARGIN) * 72 / (points * _CHARACTER[weight])))
    ]
    head = 1.3 * _MARGIN + sum(_LINE * points for _, points, *_ in lines)
    figure = canvas(width, head + room)
    figure.set_label(title)
    figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, room / (head + room)), w_pad=0.08, h_pad=0.08)
    top = 0.6 * _MARGIN
    for line, points, colour, weight in lines:
        top += _LINE * points
        figure.text(_MARGIN / width, 1 - top / (head + room), line, size=points, color=colour, weight=weight)
    found = figure.subplots(rows, columns, squeeze=False, **further).ravel().tolist()
    for number, axes in enumerate(found):
        if number >= len(names):
            axes.set_axis_off()
            continue
        if is_plain:
            plain(axes)
            axes.tick_params(colors=FAINT)
        if names[number]:
            axes.set_title(names[number], loc="left", size=10, color=INK, wrap=True)
        is_lowest, is_first = number + columns >= len(names), number % columns == 0
        axes.set_xlabel(x * is_lowest if isinstance(x, str) else x[number])
        axes.set_ylabel(y * is_first if isinstance(y, str) else y[number])
        if "sharex" in further:
            axes.tick_params(labelbottom=is_lowest)
    return figure, found[: len(names)]


def mark_values(
    axes: Axes, values: Sequence[float], texts: Sequence[str] | None = None, *, is_log: bool = True
) -> None:
    """Mark values on the horizontal axis, by default a logarithmic one, with their texts and no ticks between them."""
    if is_log:
        axes.set_xscale("log")
    axes.set_xticks(values, texts or [f"{value:,g}" for value in values])
    axes.minorticks_off()


def colour_bar(figure: Canvas, shown: Any, panels: list[Any], label: str) -> None:
    """Draw the scale of colours on the right of some panels, as wide beside wide ones as beside narrow ones."""
    columns = {panel.get_subplotspec().colspan.start for panel in panels}
    width = figure.get_figwidth() * len(columns) / panels[0].get_gridspec().ncols
    bar = figure.colorbar(shown, ax=panels, fraction=0.32 / width, pad=0.12 / width, shrink=0.95, aspect=32)
    bar.set_label(label, size=10)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=9)


def draw_means(
    axes: Axes, x: ArrayLike, found: ArrayLike | pd.DataFrame, colour: Any,
    label: str = "", *, as_bars: bool = False, **line: Any,
) -> None:  # fmt: skip
    """Draw means as a line with a confidence band, or as marks with bars.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    x : array_like, shape (n,)
        Places of the means; of a band, ascending.
    found : sequence of Interval, array_like of shape (n, 3), or DataFrame
        Means and the ends of their intervals, or a table with the columns mean, low and high. An infinite interval is
        not drawn.
    colour : colour of matplotlib
        Colour of line and interval.
    label : str
        What the legend says.
    as_bars : bool
        Whether the intervals are bars, as where bands of several lines would hide each other.
    **line
        Further properties of the line.
    """
    import pandas as pd

    columns = found[["mean", "low", "high"]] if isinstance(found, pd.DataFrame) else found
    mean, low, high = np.asarray(columns, float).reshape(-1, 3).T
    if as_bars:
        wide = np.array([mean - low, high - mean])
        wide = np.where(np.isfinite(wide), np.maximum(wide, 0.0), np.nan)
        look: dict[str, Any] = {"marker": "o", "markersize": 4, "linewidth": 1.4, "elinewidth": 1.3, "capsize": 2}
        look |= line
        axes.errorbar(x, mean, wide, color=colour, label=label, **look)
        return
    axes.plot(x, mean, color=colour, label=label, **{"linewidth": 1.8} | line)
    axes.fill_between(x, low, high, where=np.isfinite(high), color=colour, alpha=0.22, linewidth=0)


def draw_distribution(axes: Axes, values: ArrayLike, colour: Any, label: str = "") -> None:
    """Draw the share of the values that are at most x, as steps; a vertical line is their mean.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    values : array_like, shape (n,)
        The values; NaN are left out.
    colour : colour of matplotlib
        Colour of the lines.
    label : str
        What the legend says.
    """
    known = np.asarray(values, float)
    known = known[np.isfinite(known)]
    if len(known):
        axes.ecdf(known, color=colour, label=label, linewidth=1.8)
        axes.axvline(float(known.mean()), color=colour, linewidth=1.0, linestyle="--")


def draw_curves(axes: Axes, cells: pd.DataFrame, label: str) -> None:
    """Draw mean and confidence band against team size, for the smallest radius, the largest and two between them.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    cells : DataFrame
        Columns robots, radius, mean, low, high; a cell with infinite limits has no band.
    label : str
        Name and unit of the quantity.
    """
    import matplotlib

    plain(axes)
    found = np.unique(cells["radius"])
    # Closer together among the small radii, where the quantities change most: of 1..9 these are 1, 2, 4 and 9.
    shown = found[np.unique(np.geomspace(1, len(found), _MOST_CURVES).round().astype(int)) - 1]
    shades = matplotlib.colormaps["viridis"](np.linspace(*SHADES, len(shown)))
    for radius, colour in zip(shown, shades, strict=True):
        of = cells[cells["radius"] == radius].sort_values("robots")
        draw_means(axes, of["robots"], of, colour, f"R = {radius:g}")
    axes.set_xlabel(ROBOTS_LABEL)
    axes.set_ylabel(label)
    axes.tick_params(colors=FAINT)
    axes.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))


def texts_of(grid: pd.DataFrame, write: Callable[[float], str], open_cells: pd.DataFrame | None = None) -> list[str]:
    """Return what is written into each cell of a map, row by row; the numbers of open cells are in brackets."""
    texts = [write(value) for value in grid.to_numpy(float).flat]
    if open_cells is None:
        return texts
    return [f"({text})" if is_open else text for text, is_open in zip(texts, open_cells.to_numpy().flat, strict=True)]


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
