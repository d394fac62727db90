"""Observed targets against the number of sectors δ, which the paper discusses but does not draw."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.agents.awareness import AWARENESS
from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.plot.style import DEGREE, FAINT, INK, canvas, head, plain
from teamsight.analysis.stats.paired import CELL, cell_means

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

_EXPERIMENTS = {"none": "delta-none", "ring": "delta-ring", "pairwise": "delta-pairwise"}
_COLUMNS = 3
# A mean over the worlds that is at most this far below that of Θ(N) counts as equal [share of the targets].
_EQUAL = 0.01


def _tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
    parts = [tables[name].assign(awareness=degree) for degree, name in _EXPERIMENTS.items()]
    runs = pd.concat(parts, ignore_index=True)
    # Only the ring has a δ. 0 elsewhere keeps the column integer.
    runs["delta"] = runs["delta"].fillna(0).astype("int64")
    return {"": runs, "cells": cell_means(runs, "observed_fraction", (*CELL, "awareness", "delta"))}


def _draw(tables: Tables, conditions: Conditions) -> Canvas:
    cells = tables["cells"]
    panels = sorted(set(zip(cells["radius"], cells["robots"], strict=True)))
    rows = -(-len(panels) // _COLUMNS)
    height = 3.9 * rows + 1.9
    figure = canvas(14.2, height)
    head(
        figure,
        f"Fig. δ   Observed targets against the sectors δ of the ring: {_finding(cells)}",
        f"A-CMOMMT: mean and 95 % confidence band over {int(cells['count'].iloc[0])} runs of {conditions.steps} steps; "
        f"15 targets, ranges 1; setting {conditions.name}, seed {conditions.root}",
    )
    low, high = _limits(cells)
    for number, (radius, robots) in enumerate(panels):
        row, column = divmod(number, _COLUMNS)
        axes = figure.add_axes((0.055 + 0.32 * column, 1 - (4.35 + 3.9 * row) / height, 0.265, 2.9 / height))
        of = cells[(cells["robots"] == robots) & (cells["radius"] == radius)]
        _panel(axes, of)
        most = _most_neighbours(tables[""], robots, radius)
        axes.set_ylim(low, high)
        title = f"N = {robots}, R = {radius:g}   (at most {most} neighbours)"
        axes.set_title(title, loc="left", size=11, color=INK)
        if row == rows - 1:
            axes.set_xlabel("sectors δ of the ring")
        if column == 0:
            axes.set_ylabel("observed targets  [%]")
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=3, frameon=False, bbox_to_anchor=(0.5, 0.005))
    return figure


def _finding(cells: pd.DataFrame) -> str:
    """Return the smallest δ from which on the ring observes as much as Θ(N), in words."""
    means = cells.groupby(["awareness", "delta"])["mean"].mean()
    short = float(means["pairwise"].iloc[0]) - means["ring"].sort_index()
    enough = short.index[::-1][(short[::-1] <= _EQUAL).cummin()]
    if enough.empty:
        return f"no ring of up to {short.index[-1]} sectors is as good as Θ(N)"
    return f"{enough[-1]} sectors are as good as Θ(N), to 1 point on average"


def _limits(cells: pd.DataFrame) -> tuple[float, float]:
    """Return the range of all panels [%]."""
    shown = 100 * cells[["low", "mean", "high"]].to_numpy()
    shown = shown[np.isfinite(shown)]
    margin = 0.05 * max(float(np.ptp(shown)), 4.0)
    return max(0.0, shown.min() - margin), min(102.0, shown.max() + margin)


def _label(name: str) -> str:
    degree = AWARENESS[name]
    return f"{degree.__name__}, {degree.order}: {degree.shows}"


def _most_neighbours(runs: pd.DataFrame, robots: int, radius: float) -> int:
    of = (runs["awareness"] == "pairwise") & (runs["robots"] == robots) & (runs["radius"] == radius)
    return int(runs.loc[of, "max_neighbours"].max())


def _panel(axes: Axes, cells: pd.DataFrame) -> None:
    plain(axes)
    banded = bool(np.isfinite(cells[["low", "high"]].to_numpy()).all())
    for degree in ("none", "pairwise"):
        cell = cells[cells["awareness"] == degree].iloc[0]
        if banded:
            axes.axhspan(100 * cell["low"], 100 * cell["high"], color=DEGREE[degree], alpha=0.18, linewidth=0)
        axes.axhline(100 * cell["mean"], color=DEGREE[degree], linewidth=1.8, linestyle="--", label=_label(degree))
    ring = cells[cells["awareness"] == "ring"].sort_values("delta")
    if banded:
        low, high = (100 * ring[side].to_numpy() for side in ("low", "high"))
        axes.fill_between(ring["delta"], low, high, color=DEGREE["ring"], alpha=0.2, linewidth=0)
    axes.plot(ring["delta"], 100 * ring["mean"], color=DEGREE["ring"], marker="o", markersize=4.5, label=_label("ring"))
    axes.set_xscale("log", base=2)
    axes.set_xticks(ring["delta"], [str(delta) for delta in ring["delta"]])
    axes.minorticks_off()
    axes.tick_params(colors=FAINT)


FIGURE = Figure("delta", "Observed targets against δ", tuple(_EXPERIMENTS.values()), _tabulate, _draw)
