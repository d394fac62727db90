"""The plot of learning curves, against the number of samples and against the size of the search space."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.agents.awareness import AWARENESS
from teamsight.analysis.learning.curves import Curves
from teamsight.analysis.learning.evaluation import DESIGNED, RANDOM
from teamsight.analysis.learning.registry import LEARNERS
from teamsight.analysis.plot.style import DEGREE, FAINT, INK, canvas, plain, to_png

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

# Inches: a panel with its margins, and the margins on the left, below, above and between panels.
_WIDTH, _HEIGHT = 4.6, 3.5
_LEFT, _BENEATH, _ABOVE, _BETWEEN = 0.85, 0.75, 0.45, 0.55
# A single panel is too narrow for title and legend.
_LEAST_WIDTH = 8.0
# Widths of a letter of the title, of a letter of the subtitle and of an entry of the legend.
_TITLE_LETTER, _SUBTITLE_LETTER, _ENTRY = 0.13, 0.08, 2.3
_TITLE_LINE, _SUBTITLE_LINE, _LEGEND_LINE = 0.3, 0.21, 0.27
#: Fewest explorations with an interval: with two its half-width is 13 standard errors.
LEAST_FOR_INTERVAL = 3
_MOST_MARKS = 5
_TITLE = "Learning under each degree of awareness, from equal numbers of samples"


class _Layout(NamedTuple):
    """Sizes and places of the parts [inches]."""

    width: float
    title: list[str]
    subtitle: list[str]
    columns: int
    entries: int

    @property
    def per_line(self) -> int:
        """Number of entries in a line of the legend."""
        return max(1, min(self.entries, int(self.width // _ENTRY)))

    @property
    def foot(self) -> float:
        """Height of the legend and of the margin below the lower panels."""
        return 0.1 + _LEGEND_LINE * math.ceil(self.entries / self.per_line) + _BENEATH

    @property
    def height(self) -> float:
        head = 0.2 + _TITLE_LINE * len(self.title) + _SUBTITLE_LINE * len(self.subtitle)
        return self.foot + 2 * _HEIGHT - _BENEATH + head

    def box(self, row: int, column: int) -> tuple[float, float, float, float]:
        """Return left, bottom, width and height of a panel, as shares of the figure."""
        wide = (self.width - _LEFT) / self.columns
        bottom = self.foot + (1 - row) * _HEIGHT
        inner = (wide - _BETWEEN, _HEIGHT - _BENEATH - _ABOVE)
        return (
            (_LEFT + column * wide) / self.width, bottom / self.height, inner[0] / self.width, inner[1] / self.height
        )  # fmt: skip


def draw(points: pd.DataFrame, table: pd.DataFrame, curves: Curves) -> bytes:
    """Return the figure as PNG: a column for each learner, with the curves above and the points against p^d below.

    Parameters
    ----------
    points : DataFrame
        From `curve_points`.
    table : DataFrame
        From `make_curves`; its rows without an observed fraction had too many states for a table.
    curves : Curves
        The settings.
    """
    return to_png(draw_on_canvas(points, table, curves), f"{_TITLE}; {_conditions(curves)}")


def draw_on_canvas(points: pd.DataFrame, table: pd.DataFrame, curves: Curves) -> Canvas:
    """Return the figure; see `draw`."""
    width = max(len(curves.learners) * _WIDTH + _LEFT, _LEAST_WIDTH)
    subtitle = textwrap.wrap(_conditions(curves), int((width - 0.6) / _SUBTITLE_LETTER))
    title = textwrap.wrap(_TITLE, int((width - 0.6) / _TITLE_LETTER))
    entries = points.loc[points["transitions"] > 0, "degree"].nunique() + (points["transitions"] == 0).sum()
    layout = _Layout(width, title, subtitle, len(curves.learners), int(entries))
    figure = canvas(width, layout.height)
    _write_head(figure, layout)
    low, high = _limits(points)
    known = curves.memories >= LEAST_FOR_INTERVAL
    for column, learner in enumerate(curves.learners):
        for row, paint in enumerate((_against_samples, _against_size)):
            axes = figure.add_axes(layout.box(row, column))
            plain(axes)
            axes.tick_params(colors=FAINT)
            axes.set_ylim(low, high)
            _references(axes, points)
            paint(axes, points[points["learner"] == learner], known)
            if column == 0:
                axes.set_ylabel("observed targets  [%]")
            if row == 0:
                axes.set_title(LEARNERS[learner].title or learner, loc="left", size=11.5, color=INK)
                _write_refused(axes, table[table["learner"] == learner])
    _write_legend(figure, layout)
    return figure


def _conditions(curves: Curves) -> str:
    interval = "mean and 95 % interval" if curves.memories >= LEAST_FOR_INTERVAL else "mean (too few for an interval)"
    return (
        f"{interval} over {_count(curves.memories, 'exploration')}, {_count(curves.worlds, 'world')} each; "
        f"N = {curves.robots}, R = {curves.radius:g}, {curves.targets} targets, {curves.steps} steps, "
        f"reward {curves.reward}, γ = {curves.discount:g}, seed {curves.seed}"
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("s" if number != 1 else "")


def _write_head(figure: Canvas, layout: _Layout) -> None:
    left, top = 0.4 / layout.width, layout.height - 0.15
    look: dict[str, Any] = {"va": "top", "linespacing": 1.2}
    figure.text(left, top / layout.height, "\n".join(layout.title), size=15, weight="bold", color=INK, **look)
    top -= _TITLE_LINE * len(layout.title)
    figure.text(left, top / layout.height, "\n".join(layout.subtitle), size=10, color=FAINT, **look)


def _write_legend(figure: Canvas, layout: _Layout) -> None:
    """Write the legend of the upper panels; degrees come before the policies that do not learn."""
    found: dict[str, Any] = {}
    for axes in figure.axes[::2]:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    order = sorted(found, key=lambda label: label.endswith(")"), reverse=True)
    figure.legend(
        [found[label] for label in order], order,
        loc="lower center", ncols=layout.per_line, frameon=False, bbox_to_anchor=(0.5, 0.0),
    )  # fmt: skip


def _limits(points: pd.DataFrame) -> tuple[float, float]:
    means = 100 * points["mean"]
    margin = 0.08 * (means.max() - means.min()) + 1.0
    return float(means.min() - margin), float(means.max() + margin)


def _references(axes: Axes, points: pd.DataFrame) -> None:
    for name, style in ((RANDOM, ":"), (DESIGNED, "--")):
        of = points[points["learner"] == name]
        if len(of):
            axes.axhline(100 * of["mean"].iloc[0], color=INK, linewidth=1.2, linestyle=style, label=name)


def _against_samples(axes: Axes, points: pd.DataFrame, known: bool) -> None:
    """Draw a line for each degree, with a band for its interval if it is known."""
    for degree, of in points.groupby("degree", sort=False):
        colour, ordered = DEGREE[str(degree)], of.sort_values("transitions")
        label = f"{AWARENESS[str(degree)].order}  ({ordered['inputs'].iloc[0]} inputs)"
        axes.plot(ordered["transitions"], 100 * ordered["mean"], color=colour, marker="o", markersize=4, label=label)
        if known:
            axes.fill_between(
                ordered["transitions"], 100 * ordered["low"], 100 * ordered["high"],
                color=colour, alpha=0.1, linewidth=0,
            )  # fmt: skip
    axes.set_xscale("log")
    marks = sorted(points["transitions"].unique())
    if len(marks) > _MOST_MARKS:
        # Every second mark, with the largest.
        marks = marks[::-2][::-1]
    axes.set_xticks(marks, [f"{mark:,}" for mark in marks])
    axes.minorticks_off()
    axes.set_xlabel("samples  [transitions]")


def _against_size(axes: Axes, points: pd.DataFrame, known: bool) -> None:
    """Draw the points of the fewest, the middle and the most samples under each degree against p^d.

    No line joins the points, because there are no degrees between them.
    """
    axes.set_xlabel("search space p^d for p = 2  [log10]")
    if not len(points):
        axes.set_xticks([])
        return
    numbers = sorted(points["transitions"].unique())
    shown = dict.fromkeys((numbers[0], numbers[len(numbers) // 2], numbers[-1]))
    sizes = points.groupby("log10_size")["degree"].unique()
    apart = 0.012 * max(sizes.index.max() - sizes.index.min(), 1.0)
    for place, (number, mark, shade) in enumerate(zip(shown, "os^", ("#9ecae1", "#4292c6", "#08306b"), strict=False)):
        of = points[points["transitions"] == number]
        spread = [100 * (of["mean"] - of["low"]), 100 * (of["high"] - of["mean"])]
        axes.errorbar(
            of["log10_size"] + (place - (len(shown) - 1) / 2) * apart, 100 * of["mean"], spread if known else None,
            marker=mark, linestyle="none", color=shade, markersize=6, elinewidth=1.0, label=f"{number:,} transitions",
        )  # fmt: skip
    orders = [", ".join(AWARENESS[str(degree)].order for degree in degrees) for degrees in sizes]
    names = [f"{order}\n{size:.1f}" for order, size in zip(orders, sizes.index, strict=True)]
    axes.set_xticks(sizes.index, names)
    axes.set_xlim(sizes.index.min() - 5 * apart, sizes.index.max() + 5 * apart)
    labelled = zip(*axes.get_legend_handles_labels(), strict=True)
    marks = {text: handle for handle, text in labelled if "transitions" in text}
    axes.legend(
        list(marks.values()), list(marks), frameon=False, fontsize=8.5, ncols=3,
        loc="lower left", bbox_to_anchor=(-0.03, 0.97), handletextpad=0.2, columnspacing=1.0,
    )  # fmt: skip


def _write_refused(axes: Axes, table: pd.DataFrame) -> None:
    """Write beside the title under which degrees a table would have too many states."""
    refused = table[table["observed_fraction"].isna()]["degree"].unique()
    if len(refused):
        names = ", ".join(AWARENESS[str(degree)].order for degree in refused)
        axes.set_title(f"{names}: too many states", loc="right", size=9, color=FAINT)
