"""The drawing of learning curves: against the number of samples, and against the size of the search space."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from teamsight.analysis.evaluation import DESIGNED, RANDOM
from teamsight.analysis.figures.style import DEGREE, FAINT, INK, canvas, head, plain, to_png
from teamsight.analysis.learning_curves import Curves
from teamsight.analysis.search_space import GROWTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TITLES = {
    "lazy": "lazy Q-learning",
    "pessimistic": "pessimistic lazy Q-learning",
    "sheppard": "Sheppard's lazy Q-learning",
    "tabular": "a table of states",
    "linear": "a linear approximator",
}
_WIDTH, _HEIGHT = 4.6, 3.4
_LEFT, _BOTTOM, _HEAD = 0.85, 1.0, 1.0


def draw(points: pd.DataFrame, table: pd.DataFrame, curves: Curves) -> bytes:
    """Return the drawing as PNG: one column a learner; above the curves, below the same points against p^d.

    Parameters
    ----------
    points : DataFrame
        From `curve_points`.
    table : DataFrame
        From `make_curves`; tells where there was no table.
    curves : Curves
        The settings.
    """
    columns = len(curves.learners)
    width, height = columns * _WIDTH + _LEFT, 2 * _HEIGHT + _HEAD + _BOTTOM
    figure = canvas(width, height)
    title = "Learning under each degree of awareness, from equal numbers of samples"
    told = (
        f"mean and 95 % interval over {curves.memories} explorations, {curves.worlds} worlds each; "
        f"N = {curves.robots}, R = {curves.radius:g}, {curves.targets} targets, {curves.steps} steps, "
        f"reward {curves.reward}, γ = {curves.gamma:g}, seed {curves.seed}"
    )
    head(figure, title, told)
    low, high = _limits(points)
    for column, learner in enumerate(curves.learners):
        for row, paint in enumerate((_against_samples, _against_size)):
            left = (_LEFT + column * _WIDTH) / width
            bottom = (_BOTTOM + (1 - row) * _HEIGHT) / height
            axes = figure.add_axes((left, bottom, (_WIDTH - 0.55) / width, (_HEIGHT - 0.85) / height))
            plain(axes)
            axes.tick_params(colors=FAINT)
            axes.set_ylim(low, high)
            _references(axes, points)
            paint(axes, points[points["learner"] == learner])
            if column == 0:
                axes.set_ylabel("observed targets  [%]")
            if row == 0:
                axes.set_title(_TITLES.get(learner, learner), loc="left", size=11.5, color=INK)
                _tell_refused(axes, table[table["learner"] == learner])
    handles, labels = figure.axes[0].get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda place: labels[place].endswith(")"), reverse=True)
    figure.legend(
        [handles[k] for k in order], [labels[k] for k in order],
        loc="lower center", ncols=len(labels), frameon=False, bbox_to_anchor=(0.5, 0.01),
    )  # fmt: skip
    return to_png(figure, f"{title}; {told}")


def _limits(points: pd.DataFrame) -> tuple[float, float]:
    means = 100 * points["mean"]
    margin = 0.08 * (means.max() - means.min()) + 1.0
    return float(means.min() - margin), float(means.max() + margin)


def _references(axes: Axes, points: pd.DataFrame) -> None:
    for name, style in ((RANDOM, ":"), (DESIGNED, "--")):
        of = points[points["learner"] == name]
        if len(of):
            axes.axhline(100 * of["mean"].iloc[0], color=INK, linewidth=1.2, linestyle=style, label=name)


def _against_samples(axes: Axes, points: pd.DataFrame) -> None:
    """Draw a line with its band for each degree."""
    for degree, of in points.groupby("degree", sort=False):
        colour, ordered = DEGREE[str(degree)], of.sort_values("pairs")
        label = f"{GROWTH[str(degree)]}  ({ordered['inputs'].iloc[0]} inputs)"
        axes.plot(ordered["pairs"], 100 * ordered["mean"], color=colour, marker="o", markersize=4, label=label)
        axes.fill_between(
            ordered["pairs"], 100 * ordered["low"], 100 * ordered["high"], color=colour, alpha=0.1, linewidth=0
        )
    axes.set_xscale("log")
    marks = sorted(points["pairs"].unique())[::2]
    axes.set_xticks(marks, [f"{mark:,}" for mark in marks])
    axes.minorticks_off()
    axes.set_xlabel("samples  [pairs]")


def _against_size(axes: Axes, points: pd.DataFrame) -> None:
    """Draw the fewest, the middle and the most samples, each as a line through the degrees in the order of p^d."""
    if not len(points):
        return
    numbers = sorted(points["pairs"].unique())
    shown = dict.fromkeys((numbers[0], numbers[len(numbers) // 2], numbers[-1]))
    drawn = []
    for number, mark, shade in zip(shown, "os^", ("#9ecae1", "#4292c6", "#08306b"), strict=False):
        ordered = points[points["pairs"] == number].sort_values("log10_size")
        spread = [100 * (ordered["mean"] - ordered["low"]), 100 * (ordered["high"] - ordered["mean"])]
        line = axes.errorbar(
            ordered["log10_size"], 100 * ordered["mean"], spread, marker=mark, color=shade, markersize=5,
            linewidth=1.4, elinewidth=0.8, label=f"{number:,} pairs",
        )  # fmt: skip
        drawn.append(line)
    axes.set_xlabel("search space p^d for p = 2  [log10]")
    axes.legend(handles=drawn, frameon=False, fontsize=8.5, loc="upper right", bbox_to_anchor=(1.0, 0.93))


def _tell_refused(axes: Axes, table: pd.DataFrame) -> None:
    """Say under which degrees a table would have had too many states."""
    refused = table[table["observed_fraction"].isna()]["degree"].unique()
    if len(refused):
        told = ", ".join(GROWTH[str(degree)] for degree in refused)
        axes.text(0.02, 0.86, f"{told}: too many states for a table", transform=axes.transAxes, va="top", size=9)
