"""The plot of learning curves: the gain from awareness against the number of transitions, and where it begins."""

from __future__ import annotations

import itertools
import textwrap
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.analysis.learning.curve_points import mean_gains
from teamsight.analysis.learning.curves import Curves
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.plot.style import FAINT, INK, canvas, plain, to_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Inches: a panel with its margins, and the margins on the left, below, above and between panels.
_WIDTH, _HEIGHT = 3.7, 2.75
_LEFT, _BENEATH, _ABOVE, _BETWEEN = 0.75, 0.7, 0.35, 0.55
_LAST_HEIGHT = 4.0
# The last row has two panels, which need more room than a column of one scenario.
_LEAST_WIDTH = 10.5
_SUBTITLE_LETTER = 0.08
_HEAD, _SUBTITLE_LINE, _LEGEND = 0.6, 0.21, 0.4
#: Fewest explorations with an interval: with two its half-width is 13 standard errors.
LEAST_FOR_INTERVAL = 3
_MOST_MARKS = 6
_TITLE = "From how many transitions does awareness pay?"
# After M. Okabe and K. Ito: distinguishable without colour vision.
_COLOURS = ("#767676", "#CC79A7", "#E69F00", "#0072B2", "#009E73", "#D55E00")
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
        tall = _LAST_HEIGHT if last else _HEIGHT
        bottom = _LEGEND + (0 if last else _LAST_HEIGHT + (self.rows - 1 - row) * _HEIGHT) + _BENEATH
        return (
            (_LEFT + column * wide) / self.width, bottom / self.height,
            (wide - _BETWEEN) / self.width, (tall - _BENEATH - _ABOVE) / self.height,
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
    return to_png(draw_on_canvas(gains, crossings, curves), f"{_TITLE} {_conditions(curves)}")


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
    _draw_observed(_panel(figure, layout, layout.rows, 0, "Observed targets, mean of all panels above"), gains, curves)
    _draw_crossings(_panel(figure, layout, layout.rows, 1, "Where awareness begins to pay"), crossings, curves)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=len(labels), frameon=False, bbox_to_anchor=(0.5, 0.0))
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


def _panel(figure: Canvas, layout: _Layout, row: int, column: int, title: str) -> Axes:
    axes = figure.add_axes(layout.box(row, column))
    plain(axes)
    axes.tick_params(colors=FAINT)
    axes.set_title(title, loc="left", size=11, color=INK)
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
    designed = points[points["learner"] == DESIGNED]
    axes.axhline(100 * designed["gain"].iloc[0], color=INK, linewidth=1.1, linestyle="--", label=f"{DESIGNED}, Θ(N)")
    _samples_axis(axes, curves)


def _draw_observed(axes: Axes, gains: pd.DataFrame, curves: Curves) -> None:
    """Draw what each learner observes with and without awareness, and the policies that do not learn."""
    points = mean_gains(gains)
    for learner in curves.learners:
        of = points[points["learner"] == learner].sort_values("transitions")
        for which, style in (("cooperative", "-"), ("collective", ":")):
            axes.plot(of["transitions"], 100 * of[which], color=colour_of(learner), linestyle=style, linewidth=1.6)
    for name, which, text in (
        (DESIGNED, "cooperative", f"{DESIGNED}, Θ(N)"), (DESIGNED, "collective", f"{DESIGNED}, Θ(0)"),
        (RANDOM, "collective", RANDOM),
    ):  # fmt: skip
        height = 100 * points.loc[points["learner"] == name, which].iloc[0]
        axes.axhline(height, color=INK, linewidth=0.8, linestyle="--")
        axes.annotate(
            text, (1.0, height), xycoords=("axes fraction", "data"), xytext=(0, 2), textcoords="offset points",
            ha="right", va="bottom", size=8, color=FAINT,
        )  # fmt: skip
    for style, label in (("-", "with awareness, Θ(1)"), (":", "without, Θ(0)")):
        axes.plot([], [], color=INK, linestyle=style, label=label)
    axes.legend(frameon=False, fontsize=8.5, loc="lower right", bbox_to_anchor=(1.02, 0.98), ncols=2)
    axes.set_ylabel("observed targets  [%]")
    _samples_axis(axes, curves)


def _draw_crossings(axes: Axes, crossings: pd.DataFrame, curves: Curves) -> None:
    """Draw a point for each learner and scenario; learners that never cross are above the line at the top."""
    never = 3.0 * max(curves.samples)
    marks = dict(zip(curves.scenarios, itertools.cycle(_MARKS)))
    sizes = crossings.drop_duplicates("learner").set_index("learner")["log10_size"]
    apart = 0.014 * max(sizes.max() - sizes.min(), 4.0)
    for (robots, radius), mark in marks.items():
        of = crossings[(crossings["robots"] == robots) & (crossings["radius"] == radius)]
        place = (list(marks).index((robots, radius)) - (len(marks) - 1) / 2) * apart
        look: dict[str, Any] = {"marker": mark, "s": 34, "zorder": 3}
        axes.scatter(
            of["log10_size"] + place,
            of["crossing"].fillna(never),
            color=[colour_of(one) for one in of["learner"]],
            **look,
        )
        axes.scatter([], [], color=INK, label=f"N = {robots}, R = {radius:g}", **look)
    for learner, size in sizes.items():
        axes.annotate(
            LEARNERS[str(learner)].title or str(learner), (size, 0.0), xycoords=("data", "axes fraction"),
            xytext=(0, 5), textcoords="offset points", rotation=90, ha="center", va="bottom", size=8, color=FAINT,
        )  # fmt: skip
    axes.axhline(1.7 * max(curves.samples), color=FAINT, linewidth=0.8, linestyle=":")
    axes.set_yscale("log")
    axes.set_ylim(0.3 * min(curves.samples), 2 * never)
    numbers = sorted(curves.samples)[::-2][::-1]
    axes.set_yticks([*numbers, never], [*(f"{number:,}" for number in numbers), "not within\n" + f"{max(numbers):,}"])
    axes.minorticks_off()
    axes.set_xlim(sizes.min() - 8 * apart, sizes.max() + 8 * apart)
    axes.set_xlabel("values to be learned; whole situations: p^d for p = 2  [log10]")
    axes.legend(frameon=False, fontsize=8.5, loc="center right")
