"""One setting: the value of each run, their mean and its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.analysis.plot.style import COLOURS, FAINT, INK, plain
from teamsight.analysis.studies.figures.page import Picture, page, runs_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas


def draw_runs(picture: Picture) -> Canvas:
    """Return the values of all runs of one setting by replicate, with the mean and its 95 % interval."""
    from matplotlib.ticker import MaxNLocator

    quantity, values = picture.quantity, picture.cells.values
    row = picture.cells.statistics.iloc[0] if len(picture.cells.statistics) else None
    title = quantity.title
    notes = [runs_of(picture.cells, "of one setting")]
    if row is not None and row["n"]:
        ends = quantity.write(row["low"]), quantity.write(row["high"])
        known = f", 95 % interval {ends[0]} to {ends[1]}" if np.isfinite(row["high"]) else ""
        notes.append(f"mean {quantity.write(row['mean'])}{known}")
    figure = page(picture, f"{title[0].upper()}{title[1:]} of each run", notes, 7.2, 4.2)
    axes = figure.subplots()
    plain(axes)
    axes.tick_params(colors=FAINT)
    if quantity.is_difference:
        axes.axhline(0.0, color=FAINT, linewidth=1.0)
    if row is not None and np.isfinite(row["high"]):
        axes.axhspan(row["low"], row["high"], color=COLOURS[1], alpha=0.2, linewidth=0)
    if row is not None and row["n"]:
        axes.axhline(row["mean"], color=COLOURS[1], linewidth=1.8)
    size = 5 if len(values) <= 100 else 2
    axes.plot(np.arange(len(values)), values, "o", color=INK, markersize=size, alpha=0.7, linewidth=0)
    axes.xaxis.set_major_locator(MaxNLocator(10, integer=True, min_n_ticks=1))
    axes.set_xlim(-0.5 - 0.02 * len(values), max(len(values), 1) - 0.5 + 0.02 * len(values))
    axes.set_xlabel("run")
    axes.set_ylabel(quantity.label)
    return figure
