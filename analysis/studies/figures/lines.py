"""Means against one axis with 95 % bands: a line for each value of another axis."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.plot.kinds import draw_means
from teamsight.analysis.plot.style import COLOURS, DEGREE, FAINT, plain
from teamsight.analysis.studies.figures.choose import Choice, panels_of
from teamsight.analysis.studies.figures.dimension import Dimension
from teamsight.analysis.studies.figures.page import Picture, page, runs_of
from teamsight.analysis.studies.figures.panels import (
    label_ticks,
    layout_of,
    means_in_view,
    note_on_view,
    panel_title,
    room_below,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure as Canvas

# A panel [inches].
_WIDTH, _HEIGHT = 5.2, 3.9
# Numbers written at their ticks; more get round ticks.
_MOST_TICKS = 12
# What a panel's vertical axis takes of its width [inches].
_BESIDE_PANEL = 0.5
# From dark to light; without the lightest shades, which are faint on white.
_SHADES = 0.0, 0.86
# Share of the distance of two texts over which the lines' points are spread.
_BESIDE = 0.3


def draw_lines(picture: Picture, choice: Choice) -> Canvas:
    """Return lines along x, one for each value of y, in a panel for each combination of the other axes."""
    x, y = choice.x, choice.y
    assert x is not None
    panels = panels_of(choice)
    layout = layout_of(len(panels))
    legend = 0.0 if y is None else 0.6 + 0.085 * max(len(y.label), *map(len, y.texts))
    notes = [runs_of(picture.cells, "a point"), _interval_note(picture, x), note_on_view(picture)]
    title = picture.quantity.title
    title = f"{title[0].upper()}{title[1:]} by {x.label}" + (f" and {y.label}" if y else "")
    width = max(_WIDTH * layout.columns * (0.75 if layout.columns > 2 else 1.0), 0.3 * len(x) * (x.numbers is None))
    height = layout.rows * (_HEIGHT if layout.rows == 1 else 3.1)
    if x.numbers is None:
        height += room_below(x, width / layout.columns / len(x))
    figure = page(picture, title, notes, width + legend, height)
    axes = layout.axes_of(figure, sharex=True, sharey=True)
    for number, (place, (name, settings)) in enumerate(zip(axes.flat, panels, strict=False)):
        plain(place)
        place.tick_params(colors=FAINT, labelbottom=layout.is_lowest(number))
        if picture.quantity.is_difference:
            place.axhline(0.0, color=FAINT, linewidth=1.0)
        _draw_panel(place, picture, x, y, settings)
        panel_title(place, name)
        if layout.is_lowest(number):
            place.set_xlabel(x.label)
        if number % layout.columns == 0:
            place.set_ylabel(picture.quantity.label)
    means_in_view(axes[0, 0], picture)
    scale(axes[0, 0], x, width / layout.columns)
    if y is not None:
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, title=y.label, loc="outside right center", frameon=False, alignment="left")
    return figure


def colours_of(dimension: Dimension | None) -> list[Any]:
    """Return a colour for each level: shades for numbers, the fixed colours for degrees of awareness."""
    import matplotlib

    if dimension is None:
        return [COLOURS[1]]
    if dimension.numbers is not None:
        return list(matplotlib.colormaps["viridis"](np.linspace(*_SHADES, len(dimension))))
    if all(text in DEGREE for text in dimension.texts):
        return [DEGREE[text] for text in dimension.texts]  # type: ignore[index]
    return list(itertools.islice(itertools.cycle(COLOURS[1:] + COLOURS[:1]), len(dimension)))


def _draw_panel(
    axes: Axes, picture: Picture, x: Dimension, y: Dimension | None, settings: NDArray[np.bool_] | None
) -> None:
    cells = picture.cells.statistics
    chosen = np.ones(len(cells), bool) if settings is None else settings
    number = 1 if y is None else len(y)
    for level, colour in enumerate(colours_of(y)):
        of = chosen if y is None else chosen & (y.levels == level)
        # A row for each level, so that a line has a gap where there are no runs.
        rows = cells[of].set_index(x.levels[of]).reindex(range(len(x)))
        label = "" if y is None else y.texts[level]
        # Matplotlib hides empty labels, and those that begin with _.
        label = f" {label}" if y is not None and label[:1] in ("", "_") else label
        if x.numbers is not None:
            draw_means(axes, x.numbers, rows, colour, label, marker="o", markersize=4 if len(x) <= 40 else 0)
            # Between gaps there is no band.
            alone = _alone(rows) & np.isfinite(rows["high"].to_numpy())
            if alone.any():
                axes.vlines(x.numbers[alone], rows["low"][alone], rows["high"][alone], color=colour, linewidth=1.3)
        else:
            aside = 0.0 if number == 1 else _BESIDE * (level / (number - 1) - 0.5)
            draw_points(axes, x.places + aside, rows, colour, label)


def _alone(rows: pd.DataFrame) -> NDArray[np.bool_]:
    """Return which cells have runs, while those beside them have none."""
    known = np.concatenate(([False], rows["n"].to_numpy() > 0, [False]))
    return known[1:-1] & ~known[:-2] & ~known[2:]


def draw_points(axes: Axes, x: NDArray[np.float64], cells: pd.DataFrame, colour: Any, label: str = "") -> None:
    """Draw means as points with their intervals as bars; a single run of a number has no bar."""
    wide = np.array([cells["mean"] - cells["low"], cells["high"] - cells["mean"]], float)
    wide = np.where(np.isfinite(wide), wide, np.nan)
    size = 5 if len(cells) <= 40 else 3
    axes.errorbar(
        x, cells["mean"], wide, color=colour, label=label, fmt="o", markersize=size, elinewidth=1.3,
        capsize=2.5 if len(cells) <= 40 else 0,
    )  # fmt: skip


def scale(axes: Axes, x: Dimension, width: float) -> None:
    """Scale the horizontal axis of some width [inches], and write its values."""
    from matplotlib.ticker import MaxNLocator, NullLocator

    if x.numbers is None:
        label_ticks(axes.xaxis, x, width / len(x))
        axes.set_xlim(-0.5, len(x) - 0.5)
        return
    if x.is_logarithmic:
        axes.set_xscale("log")
        write_plainly(axes.xaxis)
    width -= _BESIDE_PANEL
    places = np.log(x.numbers) if x.is_logarithmic else x.numbers
    room = width * np.diff(places).min() / np.ptp(places) if len(x) > 1 else width
    if len(x) <= _MOST_TICKS and room > 0.1 + 0.08 * max(map(len, x.texts)):
        axes.set_xticks(x.numbers, x.texts)
        axes.xaxis.set_minor_locator(NullLocator())
    elif not x.is_logarithmic:
        axes.xaxis.set_major_locator(MaxNLocator(8, integer=bool((x.numbers % 1 == 0).all())))


def write_plainly(axis: Axis) -> None:
    """Write the numbers of a logarithmic axis without formulas."""
    from matplotlib.ticker import FuncFormatter, LogFormatter

    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(LogFormatter(labelOnlyBase=False))


def _interval_note(picture: Picture, x: Dimension) -> str:
    cells = picture.cells.statistics
    if not np.isfinite(cells["high"]).any():
        return "intervals need two runs a point"
    return "95 % bands of the mean" if x.numbers is not None else "bars are 95 % intervals of the mean"
