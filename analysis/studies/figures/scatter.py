"""Settings that fill no grid, such as a sample: each a point with its interval, against each axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.analysis.plot.style import COLOURS, DIVERGING, FAINT, SEQUENTIAL, plain
from teamsight.analysis.studies.figures.choose import MOST_PANELS, Choice
from teamsight.analysis.studies.figures.dimension import Dimension
from teamsight.analysis.studies.figures.lines import draw_points, scale, write_plainly
from teamsight.analysis.studies.figures.page import Picture, page, runs_of
from teamsight.analysis.studies.figures.panels import (
    colour_bar,
    colour_range,
    label_ticks,
    layout_of,
    means_in_view,
    note_on_view,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# More points with bars hide each other.
_MOST_BARS = 400


def draw_scatter(picture: Picture, choice: Choice) -> Canvas:
    """Return a point for each setting: against x, in the plane of x and y by colour, or against each axis."""
    if choice.x is not None and choice.y is not None:
        return _draw_plane(picture, choice.x, choice.y)
    shown = [choice.x or choice.y] if choice.x or choice.y else list(picture.cells.dimensions)
    dimensions = [one for one in shown if one is not None]
    if not dimensions:
        raise ValueError("kind=scatter: needs an axis, but the study has one setting; give --kind runs")
    if len(dimensions) > MOST_PANELS:
        raise ValueError(f"kind=scatter: {len(dimensions)} axes, at most {MOST_PANELS} panels; give --x")
    layout = layout_of(len(dimensions))
    title = picture.quantity.title
    title = f"{title[0].upper()}{title[1:]} by " + ", ".join(one.label for one in dimensions)
    wide = (4.6 if len(dimensions) > 1 else 6.8) * layout.columns
    notes = [_settings(picture)]
    if len(picture.cells.statistics) <= _MOST_BARS:
        has_bars = np.isfinite(picture.cells.statistics["high"]).any()
        notes += ["bars are 95 % intervals" if has_bars else "intervals need two runs", note_on_view(picture)]
    figure = page(picture, title, notes, wide, 3.7 * layout.rows)
    axes = layout.axes_of(figure, sharey=True)
    for number, (place, dimension) in enumerate(zip(axes.flat, dimensions, strict=False)):
        plain(place)
        place.tick_params(colors=FAINT)
        _draw_against(place, picture, dimension, wide / layout.columns)
        if number % layout.columns == 0:
            place.set_ylabel(picture.quantity.label)
    return figure


def _draw_against(axes: Axes, picture: Picture, dimension: Dimension, width: float) -> None:
    cells = picture.cells.statistics
    places = dimension.places[dimension.levels]
    if picture.quantity.is_difference:
        axes.axhline(0.0, color=FAINT, linewidth=1.0)
    if len(cells) <= _MOST_BARS:
        draw_points(axes, places, cells, COLOURS[1])
    else:
        axes.plot(places, cells["mean"], "o", color=COLOURS[1], markersize=2, alpha=0.5)
    axes.set_xlabel(dimension.label)
    means_in_view(axes, picture)
    scale(axes, dimension, width)


def _draw_plane(picture: Picture, x: Dimension, y: Dimension) -> Canvas:
    import matplotlib

    title = picture.quantity.title
    title = f"{title[0].upper()}{title[1:]} by {x.label} and {y.label}"
    figure = page(picture, title, [_settings(picture)], 7.2, 5.4)
    axes = figure.subplots()
    plain(axes)
    axes.tick_params(colors=FAINT)
    norm = colour_range(picture)
    colours = matplotlib.colormaps[DIVERGING if picture.quantity.is_difference else SEQUENTIAL]
    known = picture.cells.statistics["n"].to_numpy() > 0
    horizontal, vertical = (one.places[one.levels] for one in (x, y))
    axes.plot(horizontal[~known], vertical[~known], "x", color=FAINT, markersize=4)
    points = axes.scatter(
        horizontal[known], vertical[known], c=picture.cells.statistics["mean"].to_numpy()[known], cmap=colours,
        norm=norm, s=46 if len(known) <= 300 else 12, edgecolors="white", linewidths=0.5,
    )  # fmt: skip
    axes.set_xlabel(x.label)
    axes.set_ylabel(y.label)
    scale(axes, x, 5.5)
    if y.numbers is None:
        label_ticks(axes.yaxis, y)
    elif y.is_logarithmic:
        axes.set_yscale("log")
        write_plainly(axes.yaxis)
    colour_bar(figure, points, axes, picture.quantity.label)
    return figure


def _settings(picture: Picture) -> str:
    cells = picture.cells.statistics
    missing = int((cells["n"] == 0).sum())
    absent = f" ({missing:,} without runs)" if missing else ""
    return f"{len(cells):,} settings{absent}, {runs_of(picture.cells, 'each')}"
