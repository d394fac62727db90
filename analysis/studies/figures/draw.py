"""`draw`: the picture of a study, or of the difference of two; each kind of it, and its file."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from teamsight.analysis.plot.kinds import (
    SHADES,
    colour_bar,
    colour_cells,
    draw_distribution,
    draw_means,
    panels,
    places,
    rows_and_columns,
    write_numbers,
)
from teamsight.analysis.plot.style import (
    COLOURS,
    DIVERGING,
    FAINT,
    FORMATS,
    SEQUENTIAL,
    colours_of,
    to_picture,
)
from teamsight.analysis.runs.files import check_replaceable, write_bytes
from teamsight.analysis.studies.figures.cells import (
    MOST_PANELS,
    Cells,
    Choice,
    Dimension,
    Quantity,
    cells_of,
    choose,
    matching,
    panels_of,
)
from teamsight.analysis.studies.figures.difference import check_comparable, pair

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure as Canvas

    from teamsight.analysis.studies.results import Results

_EMPTY = "#dadada"
# Ticks with a text along one side, and numbers of which some get no text; the width and height of a tick [inches].
_MOST_TICKS, _LEAST_TICKS, _TICK, _TICK_LINE = 32, 8, 0.08, 0.16
# Numbers written at their ticks; more get round ticks.
_MOST_NUMBERS = 12
# Share of the distance of two texts over which the lines' points are spread.
_BESIDE = 0.3
# Sizes of mean, half width and number of runs [points], for few cells and smaller; the width and the height of a
# character in its size.
_SIZES, _SMALLER, _WIDTH, _HEIGHT = (11.0, 8.8, 7.4), (1.0, 0.82, 0.66), 0.62, 1.3
# The largest maps with numbers, and how wide columns may be for their names [inches].
_WIDEST, _HIGHEST, _NAMED = 22.0, 17.0, 7.5
# More numbers, and more points with bars, hide each other.
_MOST_CELLS, _MOST_BARS = 4000, 400


class Picture(NamedTuple):
    """What is drawn, and what is written above it.

    Attributes
    ----------
    cells : Cells
        The settings with their statistics, in the unit of the quantity.
    quantity : Quantity
        The measure.
    source : str
        The study and its conditions.
    warning : str
        What is missing; empty if nothing is.
    panels : list of (str, ndarray of bool)
        Title and settings of each panel.
    """

    cells: Cells
    quantity: Quantity
    source: str
    warning: str
    panels: list[tuple[str, NDArray[np.bool_]]]

    @property
    def colours(self) -> Colormap:
        """The colours of the means."""
        import matplotlib

        name = DIVERGING if self.quantity.is_difference else SEQUENTIAL
        return matplotlib.colormaps[name].with_extremes(bad=_EMPTY)

    @property
    def norm(self) -> Normalize:
        """The range of the colours: that of the means, or symmetric around 0 for a difference."""
        from matplotlib.colors import Normalize

        means = self.cells.statistics["mean"].to_numpy()
        means = means[np.isfinite(means)]
        if not len(means):
            return Normalize(0.0, 1.0)
        if self.quantity.is_difference:
            most = float(np.abs(means).max()) or 1.0
            return Normalize(-most, most)
        low, high = float(means.min()), float(means.max())
        return Normalize(low, high) if low < high else Normalize(low - 0.5, high + 0.5)

    def title(self, *dimensions: Dimension | None) -> str:
        """Return what was found over some dimensions: the range of the means, or how many differences are not 0."""
        found, quantity = self.cells.statistics, self.quantity
        by = " and ".join(one.label for one in dimensions if one is not None)
        text = f"{quantity.title[0].upper()}{quantity.title[1:]}" + f" by {by}" * bool(by)
        known = found[found["n"] > 0]
        if not len(known):
            return text
        if quantity.is_difference:
            above, below = int((known["low"] > 0).sum()), int((known["high"] < 0).sum())
            return f"{text}: above 0 in {above:,} of {len(known):,} settings, below in {below:,}"
        low, high = (quantity.write(float(end)) for end in (known["mean"].min(), known["mean"].max()))
        values = (f"{low} to {high}" if low != high else low) + " %" * quantity.is_percent
        # On one line.
        return f"{text}: {values.replace(' ', chr(160))}"

    def runs(self, what: str) -> str:
        """Return how many runs each cell has, as in "10 runs a cell"."""
        n = self.cells.statistics["n"].to_numpy()
        if not len(n) or not n.max():
            return "no run has a value" if len(self.cells.values) else "no runs yet"
        least, most = int(n.min()), int(n.max())
        number = f"{most:,}" if least == most else f"{least:,} to {most:,}"
        return f"{number} {'run' if least == most == 1 else 'runs'} {what}"


def draw(
    results: Results,
    *,
    kind: str = "auto",
    x: str | None = None,
    y: str | None = None,
    measure: str | None = None,
    minus: Results | None = None,
    across: Collection[str] = (),
    where: Mapping[str, object] | None = None,
) -> Canvas:
    """Return a picture of a measure over the axes of a study.

    Parameters
    ----------
    results : Results
        The study.
    minus : Results, optional
        A study that is subtracted, run by run, where both have the same values of their common axes, the same
        replicate and the same seed; see `check_comparable`.
    kind, x, y, measure, across, where
        As in `StudyResults.plot`.

    Raises
    ------
    ValueError
        If there is nothing to draw, or the axes do not suit the kind of picture.
    """
    from matplotlib.text import Text

    name = results.measured(measure)
    if minus is not None:
        check_comparable(results, minus, across, where or {})
    elif across:
        raise ValueError(f"across={','.join(across)}: has no effect without minus (--minus); give a study to subtract")
    picture = _picture(results, Quantity(name, minus is not None), minus, where or {})
    choice = choose(picture.cells, kind, x, y)
    figure = _KINDS[choice.kind](picture._replace(panels=panels_of(choice, len(picture.cells.statistics))), choice)
    for text in figure.findobj(Text):
        # Names and values are no formulas, even between two $.
        text.set_parse_math(False)
    return figure


def _picture(
    results: Results, quantity: Quantity, minus: Results | None, where: Mapping[str, object]
) -> Picture:
    frame, setting = results.frame, results.setting_numbers
    values = frame[quantity.name].to_numpy(float) * quantity.factor
    source, warning = results.source, results.warning
    # An axis of the study that is subtracted may be chosen, too.
    others = set(minus.axes if minus is not None else ()) - set(results.axes)
    own = {axis: value for axis, value in where.items() if axis not in others}
    chosen = matching(results.settings, own)
    if minus is not None:
        shared = [axis for axis in results.axes if axis in minus.axes]
        mask = matching(minus.settings, {axis: value for axis, value in where.items() if axis in minus.axes})
        kept, rest = chosen[setting], mask[minus.setting_numbers]
        minus.measured(quantity.name)
        pairs = pair(frame[kept], minus.frame[rest], shared, quantity.name)
        values, setting = pairs.values * quantity.factor, setting[kept][pairs.row]
        source = f"{source} minus {minus.source}; {len(values):,} pairs of runs"
        warning = "; ".join(filter(None, (warning, minus.warning and f"{minus.name}: {minus.warning}")))
    # The difference of two flags is a number, and a flag named as a fraction is drawn in percent.
    are_flags = minus is None and not quantity.is_percent and results.is_flag(quantity.name)
    cells = cells_of(results.settings, results.groups, values, setting, are_flags=are_flags)
    if where:
        cells = cells.among(chosen, [f"{axis} = {value}" for axis, value in where.items()])
    found = cells.statistics
    with np.errstate(invalid="ignore"):
        quantity = quantity.fitted(found["mean"].to_numpy(), ((found["high"] - found["low"]) / 2).to_numpy())
    return Picture(cells, quantity, source, warning, [])


def check_picture(path: str | os.PathLike[str], *, force: bool = False) -> str:
    """Return the kind of a picture by its suffix, after a check that the file may be written.

    Raises
    ------
    ValueError
        If the suffix is not one of a picture, or the file must not be replaced.
    """
    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FORMATS:
        names = ", ".join(f".{name}" for name in FORMATS)
        raise ValueError(f"out={os.fspath(path)}: must be a file that ends with one of {names}, such as study.png")
    check_replaceable(path, force=force)
    return kind


def save_picture(figure: Canvas, path: str | os.PathLike[str], description: str, *, force: bool = False) -> None:
    """Write a picture; see `check_picture`."""
    kind = check_picture(path, force=force)
    write_bytes(path, to_picture(figure, description, kind), force=force)


def _panels(picture: Picture, title: str, notes: Sequence[str], **further: Any) -> tuple[Canvas, list[Axes]]:
    """Return a figure with the head of a picture, and its panels; see `kinds.panels`."""
    about = (" · ".join((picture.source, *picture.cells.fixed)), "; ".join(note for note in notes if note))
    names = [name for name, _ in picture.panels]
    return panels(title, about, **{"names": names, "warning": picture.warning} | further)


def _width_of(dimension: Dimension) -> float:
    """Return the width of the longest text of a dimension [inches]."""
    return max(map(len, dimension.texts)) * _TICK + 0.1


def _every(dimension: Dimension, room: float) -> tuple[int, bool]:
    """Return which levels get a text with some room each [inches], so that they stay apart; and whether upright."""
    every = max(math.ceil(len(dimension) / _MOST_TICKS), math.ceil(_TICK_LINE / room))
    level = math.ceil(_width_of(dimension) / room)
    # Of many numbers, some that stand level are read more easily than all.
    if dimension.numbers is not None and len(dimension) >= _LEAST_TICKS * level:
        every = max(every, level)
    return every, _width_of(dimension) > room * every + 0.1


def _room_below(dimension: Dimension, room: float) -> float:
    """Return the height of upright texts below an axis, 0 if they stand level [inches]."""
    return _every(dimension, room)[1] * _width_of(dimension)


def _label_ticks(axis: Axis, dimension: Dimension, room: float = math.inf) -> None:
    """Write the texts of a dimension at 0, 1, 2, …; not all of them if they are many."""
    every, is_upright = _every(dimension, room)
    shown = range(0, len(dimension), every)
    axis.set_ticks(list(shown), [dimension.texts[level] for level in shown], rotation=90 * is_upright)


def _scale(axes: Axes, x: Dimension, width: float) -> None:
    """Scale the horizontal axis of some width [inches], and write its values."""
    from matplotlib.ticker import MaxNLocator, NullLocator

    if x.numbers is None:
        _label_ticks(axes.xaxis, x, width / len(x))
        axes.set_xlim(-0.5, len(x) - 0.5)
        return
    if x.is_logarithmic:
        axes.set_xscale("log")
        _write_plainly(axes.xaxis)
    at = np.log(x.numbers) if x.is_logarithmic else x.numbers
    # Less what the vertical axis takes.
    room = (width - 0.5) * (np.diff(at).min() / np.ptp(at) if len(x) > 1 else 1.0)
    if len(x) <= _MOST_NUMBERS and room > 0.1 + 0.08 * max(map(len, x.texts)):
        axes.set_xticks(x.numbers, x.texts)
        axes.xaxis.set_minor_locator(NullLocator())
    elif not x.is_logarithmic:
        axes.xaxis.set_major_locator(MaxNLocator(8, integer=bool((x.numbers % 1 == 0).all())))


def _write_plainly(axis: Axis) -> None:
    """Write the numbers of a logarithmic axis without formulas."""
    from matplotlib.ticker import FuncFormatter, LogFormatter

    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(LogFormatter(labelOnlyBase=False))


def _view_of(picture: Picture) -> tuple[tuple[float, float] | None, str]:
    """Return the limits of the vertical axis, and how many intervals they cut off; a few wide ones flatten nothing."""
    cells, quantity = picture.cells.statistics, picture.quantity
    cells = cells[cells["n"] > 0]
    if not len(cells):
        return None, ""
    mean, ends = cells["mean"].to_numpy(), cells[["low", "high"]].to_numpy()
    # Below and above the mean: the interval of a rate is not symmetric.
    wide = np.abs(ends - mean[:, None])
    bounded = np.isfinite(wide)
    most = max(float(np.ptp(mean)), 3 * float(np.median(wide[bounded]))) if bounded.any() else 0.0
    shown = np.minimum(np.where(bounded, wide, 0.0), most)
    low, high = float((mean - shown[:, 0]).min()), float((mean + shown[:, 1]).max())
    if quantity.is_difference:
        low, high = min(low, 0.0), max(high, 0.0)
    elif quantity.is_percent:
        low, high = max(low, 0.0), min(high, quantity.factor)
    margin = 0.04 * (high - low) or max(abs(high), 1.0) * 0.05
    low, high = low - margin, high + margin
    known = np.isfinite(ends).all(axis=1)
    cut = int((known & ((ends[:, 0] < low) | (ends[:, 1] > high))).sum())
    return (low, high), f"{cut:,} of {known.sum():,} intervals cut off at the edge" * bool(cut)


def _look_at(axes: Axes, picture: Picture) -> None:
    """Limit the vertical axis, with 0 if the picture is of a difference."""
    if view := _view_of(picture)[0]:
        axes.set_ylim(*view)
    if picture.quantity.is_difference:
        axes.axhline(0.0, color=FAINT, linewidth=1.0)


def _levels(y: Dimension | None, settings: NDArray[np.bool_]) -> list[tuple[str, Any, NDArray[np.bool_]]]:
    """Return the label, the colour and the settings of each level of y, or of all settings.

    Numbers have shades, policies and degrees their own colours.
    """
    import matplotlib

    if y is None:
        return [("", COLOURS[1], settings)]
    shades = matplotlib.colormaps["viridis"](np.linspace(*SHADES, len(y)))
    colours = colours_of(y.texts) if y.numbers is None else shades
    # Matplotlib hides empty labels, and those that begin with _.
    labels = [f" {text}" if text[:1] in ("", "_") else text for text in y.texts]
    return [(label, colours[level], settings & (y.levels == level)) for level, label in enumerate(labels)]


def _legend(figure: Canvas, axes: Axes, y: Dimension | None) -> None:
    if y is not None:
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, title=y.label, loc="outside right center", frameon=False, alignment="left")


def _room_of_legend(y: Dimension | None) -> float:
    return 0.0 if y is None else 0.6 + 0.085 * max(len(y.label), *map(len, y.texts))


def _draw_lines(picture: Picture, choice: Choice) -> Canvas:
    """Return lines along x, one for each value of y, in a panel for each combination of the other axes."""
    x, y = choice.x, choice.y
    assert x is not None
    rows, columns = rows_and_columns(len(picture.panels))
    statistics = picture.cells.statistics
    note = "95 % bands of the mean" if x.numbers is not None else "bars are 95 % intervals of the mean"
    if not np.isfinite(statistics["high"]).any():
        note = "intervals need two runs a point"
    wide = max(5.2 if columns < 3 else 3.9, 0.3 * len(x) * (x.numbers is None) / columns)
    below = 0.0 if x.numbers is not None else _room_below(x, wide / len(x))
    figure, found = _panels(
        picture, picture.title(x, y), [picture.runs("a point"), note, _view_of(picture)[1]], x=x.label,
        y=picture.quantity.label, size=(wide, 3.9 if rows == 1 else 3.1), more=(_room_of_legend(y), below), sharex=True,
        sharey=True,
    )  # fmt: skip
    for axes, (_, settings) in zip(found, picture.panels, strict=True):
        levels = _levels(y, settings)
        for number, (label, colour, own) in enumerate(levels):
            # A row for each level, so that a line has a gap where there are no runs.
            cells = statistics[own].set_index(x.levels[own]).reindex(range(len(x)))
            if x.numbers is None:
                aside = _BESIDE * (number / max(len(levels) - 1, 1) - 0.5) * (len(levels) > 1)
                _draw_points(axes, x.places + aside, cells, colour, label)
                continue
            draw_means(axes, x.numbers, cells, colour, label, marker="o", markersize=4 if len(x) <= 40 else 0)
            # Between gaps there is no band.
            known = np.pad(cells["n"].to_numpy() > 0, 1)
            alone = known[1:-1] & ~known[:-2] & ~known[2:] & np.isfinite(cells["high"].to_numpy())
            if alone.any():
                axes.vlines(x.numbers[alone], cells["low"][alone], cells["high"][alone], color=colour, linewidth=1.3)
        _look_at(axes, picture)
    _scale(found[0], x, wide)
    _legend(figure, found[0], y)
    return figure


def _draw_points(axes: Axes, x: NDArray[np.float64], cells: pd.DataFrame, colour: Any, label: str = "") -> None:
    """Draw means as points with their intervals as bars; a single run of a number has no bar."""
    few = len(cells) <= 40
    draw_means(
        axes, x, cells, colour, label, as_bars=True, linestyle="", markersize=5 if few else 3, capsize=2.5 * few
    )


def _draw_distribution(picture: Picture, choice: Choice) -> Canvas:
    """Return the share of the runs up to each value, a curve for each value of y, in a panel for each combination."""
    rows, columns = rows_and_columns(len(picture.panels))
    found, quantity = picture.cells.statistics, picture.quantity
    notes = [picture.runs("a curve" if len(found) > 1 else "of one setting"), "dashed: the mean"]
    if len(found) == 1 and np.isfinite(found["high"][0]):
        low, high = (quantity.write(found[end][0]) for end in ("low", "high"))
        notes[1] += f", {quantity.write(found['mean'][0])}, 95 % interval {low} to {high}"
    size = (5.2 if columns == 1 else 4.2, 4.2 if rows == 1 else 3.1)
    figure, shown = _panels(
        picture, picture.title(choice.y), notes, x=quantity.label, y="share of the runs", size=size,
        more=(_room_of_legend(choice.y), 0.0), sharex=True, sharey=True,
    )  # fmt: skip
    for axes, (_, settings) in zip(shown, picture.panels, strict=True):
        if quantity.is_difference:
            axes.axvline(0.0, color=FAINT, linewidth=1.0)
        for label, colour, own in _levels(choice.y, settings):
            draw_distribution(axes, picture.cells.values[own[picture.cells.setting]], colour, label)
    _legend(figure, shown[0], choice.y)
    return figure


def _draw_scatter(picture: Picture, choice: Choice) -> Canvas:
    """Return a point for each setting: against x, in the plane of x and y by colour, or against each axis."""
    if choice.x is not None and choice.y is not None:
        return _draw_plane(picture, choice.x, choice.y)
    one = choice.x or choice.y
    dimensions = picture.cells.dimensions if one is None else (one,)
    if not dimensions:
        raise ValueError("kind=scatter: needs an axis, but the study has one setting; give --kind distribution")
    if len(dimensions) > MOST_PANELS:
        raise ValueError(f"kind=scatter: {len(dimensions)} axes, at most {MOST_PANELS} panels; give --x")
    cells, wide = picture.cells.statistics, 4.6 if len(dimensions) > 1 else 6.8
    has_bars = len(cells) <= _MOST_BARS
    notes = [_settings(picture)]
    if has_bars:
        is_known = np.isfinite(cells["high"]).any()
        notes += ["bars are 95 % intervals" if is_known else "intervals need two runs", _view_of(picture)[1]]
    figure, shown = _panels(
        picture, picture.title(*dimensions), notes, names=[""] * len(dimensions), x=[one.label for one in dimensions],
        y=picture.quantity.label, size=(wide, 3.7), sharey=True,
    )  # fmt: skip
    for axes, dimension in zip(shown, dimensions, strict=True):
        at = dimension.places[dimension.levels]
        if has_bars:
            _draw_points(axes, at, cells, COLOURS[1])
        else:
            axes.plot(at, cells["mean"], "o", color=COLOURS[1], markersize=2, alpha=0.5)
        _look_at(axes, picture)
        _scale(axes, dimension, wide)
    return figure


def _draw_plane(picture: Picture, x: Dimension, y: Dimension) -> Canvas:
    figure, (axes,) = _panels(
        picture, picture.title(x, y), [_settings(picture)], names=[""], x=x.label, y=y.label, size=(7.2, 5.4)
    )
    cells = picture.cells.statistics
    known = cells["n"].to_numpy() > 0
    across, up = (one.places[one.levels] for one in (x, y))
    axes.plot(across[~known], up[~known], "x", color=FAINT, markersize=4)
    points = axes.scatter(
        across[known], up[known], c=cells["mean"].to_numpy()[known], cmap=picture.colours, norm=picture.norm,
        s=46 if len(known) <= 300 else 12, edgecolors="white", linewidths=0.5,
    )  # fmt: skip
    _scale(axes, x, 5.5)
    if y.numbers is None:
        _label_ticks(axes.yaxis, y)
    elif y.is_logarithmic:
        axes.set_yscale("log")
        _write_plainly(axes.yaxis)
    colour_bar(figure, points, [axes], picture.quantity.label)
    return figure


def _settings(picture: Picture) -> str:
    cells = picture.cells.statistics
    missing = int((cells["n"] == 0).sum())
    absent = f" ({missing:,} without runs)" if missing else ""
    return f"{len(cells):,} settings{absent}, {picture.runs('each')}"


class _Texts(NamedTuple):
    """What is written into the cells of a map: lines of texts with their sizes, none if they do not fit; cell sizes."""

    lines: list[tuple[float, list[str]]]
    width: float
    height: float


def _draw_heat_map(picture: Picture, choice: Choice) -> Canvas:
    """Return a heat map for each combination of the axes that are not x and y.

    Each cell shows its mean, half the width of its interval and, where they differ, the number of runs. Cells without
    runs are grey. A difference whose interval includes 0 is in brackets. If the numbers do not fit into the cells, a
    second map shows the half widths of the intervals.
    """
    import matplotlib
    from matplotlib.colors import Normalize

    x, y = choice.x, choice.y
    assert x is not None
    assert y is not None
    cells, names = picture.cells.statistics, [name for name, _ in picture.panels]
    # Number of the setting in each cell; the last row, −1, is of none.
    grids = np.full((len(names), len(y), len(x)), -1)
    for grid, (_, settings) in zip(grids, picture.panels, strict=True):
        grid[y.levels[settings], x.levels[settings]] = np.flatnonzero(settings)
    mean, low, high, n = (np.append(cells[name], np.nan) for name in ("mean", "low", "high", "n"))
    half = (high - low) / 2
    texts = _texts_of(picture, x, y, len(names), mean, half, n)
    is_pair = not texts.lines and len(names) == 1
    names = [*names, *[""] * is_pair]
    panel = (texts.width * len(x) + 0.25, texts.height * len(y) + 0.35 + _room_below(x, texts.width))
    figure, shown = _panels(
        picture, picture.title(x, y), _notes(picture, bool(texts.lines)), names=names, x=x.label, y=y.label, size=panel,
        more=(1.6 + min(0.075 * max(map(len, y.texts)), 2.4), 0.9), is_plain=False,
    )  # fmt: skip
    for axes, grid in zip(shown, grids, strict=False):
        inks = np.array(colour_cells(axes, mean[grid], picture.norm, picture.colours))
        column, row = places(grid.shape)
        above = sum(size for size, _ in texts.lines) * _HEIGHT / 2
        for size, line in texts.lines:
            above -= size * _HEIGHT / 2
            known = np.array([bool(line[cell]) for cell in grid.flat])
            own = [line[cell] for cell in grid.flat if line[cell]]
            write_numbers(axes, column[known], row[known], own, inks[known].tolist(), size=size, above=above)
            above -= size * _HEIGHT / 2
    colour_bar(figure, shown[0].images[0], shown[:1] if is_pair else shown, picture.quantity.label)
    if is_pair:
        wide = np.where(np.isfinite(half), half, np.nan)[grids[0]]
        most = float(np.nanmax(wide)) if np.isfinite(wide).any() else 1.0
        colours = matplotlib.colormaps["cividis"].with_extremes(bad=_EMPTY)
        colour_cells(shown[1], wide, Normalize(0.0, most or 1.0), colours)
        colour_bar(figure, shown[1].images[0], shown[1:], "half width of the 95 % interval")
    for axes in shown:
        axes.spines[:].set_visible(False)
        axes.tick_params(length=0, labelsize=9)
        _label_ticks(axes.xaxis, x, texts.width)
        _label_ticks(axes.yaxis, y)
    return figure


def _texts_of(
    picture: Picture, x: Dimension, y: Dimension, panels: int, mean: NDArray[Any], half: NDArray[Any], n: NDArray[Any]
) -> _Texts:
    """Return the texts of each setting, and of none, in the largest sizes with which the picture is not too large."""
    quantity, (rows, columns) = picture.quantity, rows_and_columns(panels)
    means, widths, runs = [], [], []
    for one, wide, count in zip(mean, half, n, strict=True):
        text = "" if np.isnan(one) else quantity.finer(wide, one).write(one)
        is_open = quantity.is_difference and abs(one) <= wide
        means.append(f"({text})" if is_open and text else text)
        widths.append(f"±{quantity.write_width(wide, one)}" if np.isfinite(wide) else "")
        runs.append(f"n {count:.0f}" if count > 0 else "")
    lines = [means, widths, runs] if len(set(n[n > 0])) > 1 else [means, widths]
    is_large = len(x) * len(y) * rows * columns > _MOST_CELLS
    for scale in () if is_large else _SMALLER[max(len(x), len(y)) * columns > 12 :]:
        sizes = [round(size * scale, 1) for size in _SIZES[: len(lines)]]
        longest = max(size * max(map(len, line)) for size, line in zip(sizes, lines, strict=True))
        # Few cells are larger than their numbers.
        width = max(longest * _WIDTH / 72 + 0.12, 0.42, min(0.9, 3.6 / len(x)))
        height = max(sum(sizes) * _HEIGHT / 72 + 0.1, 0.3, min(0.62, 2.6 / len(y)))
        # Names are not rotated where there are few.
        if (named := _width_of(x)) * len(x) * columns <= _NAMED:
            width = max(width, named)
        if columns * len(x) * width <= _WIDEST and rows * len(y) * height <= _HIGHEST:
            return _Texts(list(zip(sizes, lines, strict=True)), width, height)
    panel = 5.2 if columns < 3 else 3.4
    return _Texts([], panel / len(x), panel * 0.85 / len(y))


def _notes(picture: Picture, are_written: bool) -> list[str]:
    cells = picture.cells.statistics
    wide = ((cells["high"] - cells["low"]) / 2).to_numpy()
    wide = wide[np.isfinite(wide)]
    notes = [picture.runs("a cell")]
    if not len(wide):
        notes.append("intervals need two runs a cell")
    elif are_written:
        notes.append("mean ± half width of its 95 % interval")
    else:
        median, largest = (picture.quantity.write_width(float(one), 0.0) for one in (np.median(wide), wide.max()))
        notes.append(f"half widths of the 95 % intervals: median {median}, largest {largest}")
    if picture.quantity.is_difference:
        is_open = (cells["low"] <= 0) & (cells["high"] >= 0)
        brackets = " (in brackets)" if are_written else ""
        notes.append(f"{is_open.sum():,} of {cells['n'].gt(0).sum():,} intervals include 0{brackets}")
    if (cells["n"] == 0).any():
        notes.append("grey: no values" if np.isnan(picture.cells.values).any() else "grey: no runs")
    return notes


_KINDS: Mapping[str, Callable[[Picture, Choice], Canvas]] = {
    "heat-map": _draw_heat_map,
    "lines": _draw_lines,
    "distribution": _draw_distribution,
    "scatter": _draw_scatter,
}
