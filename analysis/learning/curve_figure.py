"""The plot of learning curves: the gain from awareness against the number of transitions, and where it begins."""

from __future__ import annotations

import itertools
import textwrap
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.analysis.learning.curves import BEST, mean_gains
from teamsight.analysis.learning.evaluation import BY_HAND, DESIGNED, RANDOM
from teamsight.analysis.learning.plans import LEAST_FOR_INTERVAL, Curves
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.plot.style import FAINT, INK, canvas, plain, to_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Inches: a panel with its margins, and the margins on the left, below, above and between panels.
_WIDTH, _HEIGHT = 3.7, 2.75
_LEFT, _BENEATH, _ABOVE, _BETWEEN = 0.75, 0.7, 0.35, 0.55
# The last row: its height, the margin above a panel with two lines of title, and the margin for long labels.
_LAST_HEIGHT, _LAST_ABOVE, _LABELS = 4.2, 0.6, 0.45
# The last row has two panels, which need more room than a column of one scenario.
_LEAST_WIDTH = 10.5
_SUBTITLE_LETTER = 0.08
_HEAD, _SUBTITLE_LINE, _LEGEND = 0.6, 0.21, 0.6
# Width of an entry of the legend, which has at most two lines.
_ENTRY = 2.5
_MOST_MARKS = 6
# Fewer than other figures have, since it has many panels.
_DPI = 80
_TITLE = "From how many transitions does awareness pay?"
# After M. Okabe and K. Ito: distinguishable without colour vision.
_COLOURS = ("#D55E00", "#767676", "#CC79A7", "#E69F00", "#0072B2", "#009E73")
_MARKS = "os^DvP*X<>hp"


class _Layout(NamedTuple):
    """Sizes and places of the panels [inches]."""

    width: float
    subtitle: list[str]
    columns: int
    rows: int

    @property
    def height(self) -> float:
        head = _HEAD + _SUBTITLE_LINE * len(self.subtitle) + 0.1
        return head + self.rows * _HEIGHT + _LAST_HEIGHT + _LEGEND

    def box(self, row: int, column: int) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of a panel, as shares of the figure; the last row has two panels."""
        last = row == self.rows
        wide = (self.width - _LEFT) / (2 if last else self.columns)
        tall, above = (_LAST_HEIGHT, _LAST_ABOVE) if last else (_HEIGHT, _ABOVE)
        inset = _LABELS if last and column else 0.0
        bottom = _LEGEND + (0 if last else _LAST_HEIGHT + (self.rows - 1 - row) * _HEIGHT) + _BENEATH
        return (
            (_LEFT + column * wide + inset) / self.width, bottom / self.height,
            (wide - _BETWEEN - inset) / self.width, (tall - _BENEATH - above) / self.height,
        )  # fmt: skip


def colour_of(learner: str) -> str:
    """Return the colour of a learner, which does not depend on the others that are drawn."""
    return dict(zip(LEARNERS, itertools.cycle(_COLOURS)))[learner]


def draw(gains: pd.DataFrame, crossings: pd.DataFrame, curves: Curves) -> bytes:
    """Return the figure as PNG.

    A panel for each scenario has the gain from awareness against the number of transitions. The last row has the
    observed targets, mean of all scenarios, and the crossings against the size of the search space.

    Parameters
    ----------
    gains, crossings : DataFrame
        From `awareness_gains` and `crossings`.
    curves : Curves
        The settings.
    """
    return to_png(draw_on_canvas(gains, crossings, curves), f"{_TITLE} {_conditions(curves)}", _DPI)


def draw_on_canvas(gains: pd.DataFrame, crossings: pd.DataFrame, curves: Curves) -> Canvas:
    """Return the figure; see `draw`."""
    width = max(len(curves.robots) * _WIDTH + _LEFT, _LEAST_WIDTH)
    subtitle = textwrap.wrap(_conditions(curves), int((width - 0.6) / _SUBTITLE_LETTER))
    layout = _Layout(width, subtitle, len(curves.robots), len(curves.radius))
    figure = canvas(width, layout.height)
    left, top = 0.4 / width, layout.height
    figure.text(left, 1 - 0.15 / top, _TITLE, size=15, weight="bold", color=INK, va="top")
    figure.text(
        left, 1 - _HEAD / top + 0.05 / top, "\n".join(subtitle), size=10, color=FAINT, va="top", linespacing=1.2
    )
    limits = _limits(gains)
    for row, radius in enumerate(curves.radius):
        for column, robots in enumerate(curves.robots):
            axes = _panel(figure, layout, row, column, f"N = {robots}, R = {radius:g}")
            _draw_gain(axes, gains[(gains["robots"] == robots) & (gains["radius"] == radius)], curves)
            axes.set_ylim(*limits)
            if column == 0:
                axes.set_ylabel("Θ(1) minus Θ(0)  [pp]")
    title = "Observed targets, mean of the panels above", "solid: with awareness, Θ(1); dotted: without, Θ(0)"
    _draw_observed(_panel(figure, layout, layout.rows, 0, *title), gains, curves)
    title = "Where awareness begins to pay", "fewest transitions from which the interval stays above 0"
    _draw_crossings(_panel(figure, layout, layout.rows, 1, *title), crossings, curves)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        loc="lower center",
        ncols=min(len(labels), int(width // _ENTRY)),
        frameon=False,
        bbox_to_anchor=(0.5, 0.0),
    )
    return figure


def _conditions(curves: Curves) -> str:
    interval = "mean and 95 % interval" if curves.memories >= LEAST_FOR_INTERVAL else "mean (too few for an interval)"
    return (
        f"{interval} over {_count(curves.memories, 'exploration')}, {_count(curves.worlds, 'world')} each; "
        f"{curves.targets} targets, {curves.steps} steps, reward {curves.reward}, γ = {curves.discount:g}, "
        f"seed {curves.seed}; explored by 5 robots among 10 targets at R = 3"
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("s" if number != 1 else "")


def _panel(figure: Canvas, layout: _Layout, row: int, column: int, title: str, further: str = "") -> Axes:
    axes = figure.add_axes(layout.box(row, column))
    plain(axes)
    axes.tick_params(colors=FAINT)
    axes.set_title(title, loc="left", size=11, color=INK, pad=20 if further else 6)
    axes.annotate(
        further, (0.0, 1.0), xycoords="axes fraction", xytext=(0, 6), textcoords="offset points", size=9, color=FAINT
    )
    return axes


def _limits(gains: pd.DataFrame) -> tuple[float, float]:
    """Return the range of all gains [pp]; intervals may exceed it."""
    single = gains[gains["robots"].notna()]
    found = 100 * pd.concat([single["gain"], pd.Series([0.0])])
    margin = 0.12 * (found.max() - found.min()) + 1.0
    return float(found.min() - margin), float(found.max() + margin)


def _samples_axis(axes: Axes, curves: Curves) -> None:
    axes.set_xscale("log")
    marks = sorted(curves.samples)
    if len(marks) > _MOST_MARKS:
        # Every second mark, with the largest.
        marks = marks[::-2][::-1]
    axes.set_xticks(marks, [f"{mark:,}" for mark in marks], size=8.5)
    axes.minorticks_off()
    axes.set_xlabel("transitions")


def _draw_gain(axes: Axes, points: pd.DataFrame, curves: Curves) -> None:
    """Draw a line for each learner, with a band for its interval if it is known."""
    axes.axhline(0.0, color=INK, linewidth=0.9)
    for learner in curves.learners:
        of = points[points["learner"] == learner].sort_values("transitions")
        colour = colour_of(learner)
        label = LEARNERS[learner].title or learner
        axes.plot(of["transitions"], 100 * of["gain"], color=colour, marker="o", markersize=3.5, label=label)
        if curves.memories >= LEAST_FOR_INTERVAL:
            axes.fill_between(
                of["transitions"], 100 * of["low"], 100 * of["high"], color=colour, alpha=0.15, linewidth=0
            )
    best = points[points["learner"] == BEST].sort_values("transitions")
    label = "best with awareness minus best without"
    axes.plot(best["transitions"], 100 * best["gain"], color=INK, linestyle="--", linewidth=1.3, label=label)
    _samples_axis(axes, curves)


def _draw_observed(axes: Axes, gains: pd.DataFrame, curves: Curves) -> None:
    """Draw what each learner observes with and without awareness, and the teams that learn nothing."""
    points = mean_gains(gains)
    for learner in curves.learners:
        of = points[points["learner"] == learner].sort_values("transitions")
        for which, style in (("cooperative", "-"), ("collective", ":")):
            axes.plot(of["transitions"], 100 * of[which], color=colour_of(learner), linestyle=style, linewidth=1.6)
    at_once = points[points["transitions"] == 0].set_index("learner")
    observed: pd.Series[float] = 100 * at_once[["cooperative", "collective"]].max(axis=1)
    for name, text in ((DESIGNED, f"{DESIGNED}, Θ(N)"), (RANDOM, RANDOM)):
        axes.axhline(observed[name], color=INK, linewidth=0.8, linestyle="--")
        _note(axes, text, observed[name], above=False)
    for degree in dict.fromkeys(degree for _, degree in BY_HAND.values()):
        heights = observed[[name for name in BY_HAND if BY_HAND[name][1] == degree]].sort_values(ascending=False)
        for height in heights:
            # The form of these teams is that of the regression.
            axes.axhline(height, color=colour_of("regression"), linewidth=0.8)
        parts = [name.rpartition(", ") for name in heights.index]
        _note(axes, f"{parts[0][0]}: {', '.join(law for _, _, law in parts)}", heights.max(), above=True)
    low, high = axes.get_ylim()
    axes.set_ylim(low - 2, high + 2)  # room for the notes
    axes.set_ylabel("observed targets  [%]")
    _samples_axis(axes, curves)


def _note(axes: Axes, text: str, height: float, *, above: bool) -> None:
    """Write above or below the right end of a horizontal line."""
    axes.annotate(
        text, (1.0, height), xycoords=("axes fraction", "data"), xytext=(0, 2 if above else -2),
        textcoords="offset points", ha="right", va="bottom" if above else "top", size=8, color=FAINT,
    )  # fmt: skip


def _draw_crossings(axes: Axes, crossings: pd.DataFrame, curves: Curves) -> None:
    """Draw a point for each learner and scenario; learners that never cross are above the line at the top."""
    crossings = crossings[crossings["learner"] != BEST]
    most = max(curves.samples)
    never = 3.0 * most
    places = _places(crossings, curves)
    for (robots, radius), mark in zip(curves.scenarios, itertools.cycle(_MARKS)):
        of = crossings[(crossings["robots"] == robots) & (crossings["radius"] == radius)]
        look: dict[str, Any] = {"marker": mark, "s": 30, "zorder": 3}
        where = [places[learner, robots, radius] for learner in of["learner"]]
        axes.scatter(where, of["crossing"].fillna(never), color=[colour_of(one) for one in of["learner"]], **look)
        axes.scatter([], [], color=INK, label=f"N = {robots}, R = {radius:g}", **look)
    axes.axhline(1.7 * most, color=FAINT, linewidth=0.8, linestyle=":")
    axes.set_yscale("log")
    axes.set_ylim(0.5 * min(curves.samples), 2 * never)
    numbers = sorted(curves.samples)[::-2][::-1]
    axes.set_yticks([*numbers, never], [*(f"{number:,}" for number in numbers), f"not within\n{most:,}"])
    axes.minorticks_off()
    sizes = crossings.groupby("log10_size", sort=True)["learner"].unique()
    names = [",\n".join(learners) + f"\n{size:.1f}" for size, learners in sizes.items()]
    axes.set_xticks(list(sizes.index), names, size=8.5)
    axes.set_xlim(min(places.values()) - 0.3, max(places.values()) + 0.3)
    axes.set_xlabel("size of the search space  [log10]")
    axes.legend(frameon=False, fontsize=8.5, loc="center right")


def _places(crossings: pd.DataFrame, curves: Curves) -> dict[tuple[str, int, float], float]:
    """Return where to draw each learner and scenario: side by side around the size of the learner's search space."""
    sizes = crossings.drop_duplicates("learner").set_index("learner")["log10_size"]
    different = sorted(set(sizes))
    gap = min((high - low for low, high in itertools.pairwise(different)), default=1.0)
    found = {}
    for size in different:
        points = list(itertools.product(sizes.index[sizes == size], curves.scenarios))
        apart = min(0.8 * gap / len(points), 0.2)
        for number, (learner, (robots, radius)) in enumerate(points):
            found[learner, robots, radius] = size + (number - (len(points) - 1) / 2) * apart
    return found
