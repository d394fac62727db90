"""Fig. 11: what awareness adds to learned teams, for two readings of the paper's lazy learning."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from teamsight.analysis.paper.figures.interface import Conditions, Figure, Tables
from teamsight.analysis.paper.figures.surfaces import caption
from teamsight.analysis.paper.lazy_teams import READINGS, Reading
from teamsight.analysis.plot.style import canvas, head, minus, signed
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import CELL, cell_means, grid_of, includes_zero, interval_of, paired

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

_TITLE = "Gain by awareness in lazy learning: 32 inputs − 16 inputs of the same transitions"


def _tabulate(tables: Tables, conditions: Conditions) -> dict[str, pd.DataFrame]:
    runs = pd.concat([_runs(reading, tables) for reading in READINGS], ignore_index=True)
    means = runs.groupby(["variant", "exploration"], sort=False)[["with", "without", "difference"]].mean()
    return {
        "": runs,
        "cells": cell_means(runs, "difference", ("variant", *CELL)),
        "explorations": means.reset_index(),
    }


def _runs(reading: Reading, tables: Tables) -> pd.DataFrame:
    """Return the paired runs of a reading, each with the seed of its exploration."""
    cooperative = tables[reading.cooperative]
    seeds = cooperative.drop_duplicates("replicate").set_index("replicate")["exploration"]
    runs = paired(cooperative, tables[reading.collective])
    return runs.assign(exploration=runs["replicate"].map(seeds), variant=_variant(reading))


def _draw(tables: Tables, conditions: Conditions) -> Canvas:
    figure = canvas(WIDTH, HEIGHT * len(READINGS) + HEAD)
    count = tables["explorations"]["exploration"].nunique()
    head(
        figure,
        f"Fig. 11   {_TITLE}",
        f"mean over {count} unselected explorations of 600 transitions, each with one run of {conditions.steps} steps "
        f"a cell, setting {conditions.name}, seed {conditions.root}; in brackets: the 95 % interval includes 0",
    )
    # One scale for both, in which noise looks as small as it is.
    limit = _limit(100 * tables["cells"]["mean"].to_numpy())
    for row, reading in enumerate(READINGS):
        cells = _of(reading, tables["cells"])
        grid = grid_of(cells) * 100
        # Most gains have one sign: cut the axis where no cell reaches.
        heights = (min(0.0, float(np.floor(grid.to_numpy().min() + 0.05))), limit)
        look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, True, heights)
        draw_row(figure, grid, look, row=row, open_cells=includes_zero(cells))
        text = (
            f"{'ab'[row]}) {reading.title}, reward {reading.reward}: {_spread(reading, tables)}; standard error of a "
            f"cell up to {100 * cells['se'].max():.1f} pp"
        )
        caption(figure, minus(text), row)
    return figure


def _of(reading: Reading, table: pd.DataFrame) -> pd.DataFrame:
    return table[table["variant"] == _variant(reading)]


def _variant(reading: Reading) -> str:
    """Return what tables call a reading: what the names of its experiments begin with."""
    return reading.cooperative.split("-")[0]


def _limit(gains: np.ndarray) -> float:
    """Return the end of the scale: the smallest whole number, or multiple of five from ten on, that no cell exceeds."""
    most = float(np.abs(gains).max())
    step = 1.0 if most < 10 else 5.0
    return max(1.0, step * float(np.ceil(most / step)))


def _spread(reading: Reading, tables: Tables) -> str:
    """Return the mean gain over all cells, its interval, and the range of the explorations, in words."""
    gains = 100.0 * _of(reading, tables["explorations"])["difference"].to_numpy()
    mean = interval_of(gains)
    interval = f" (95 % interval {mean.low:+.1f} to {mean.high:+.1f})" if np.isfinite(mean.low) else ""
    text = (
        f"{mean.mean:+.1f} pp on average over all cells{interval}, single explorations "
        f"{gains.min():+.1f} to {gains.max():+.1f}"
    )
    return text.replace("-", "−")


def _in_words(tables: Tables) -> str:
    """Return the figure in one line."""
    lines = []
    for reading in READINGS:
        most = _of(reading, tables["cells"]).nlargest(1, "mean").iloc[0]
        lines.append(
            f"{reading.title}: {_spread(reading, tables)}; largest {100 * most['mean']:+.1f} pp at "
            f"N = {most['robots']:.0f}, R = {most['radius']:g}"
        )
    count = tables["explorations"]["exploration"].nunique()
    return f"gain from awareness over {count} explorations: " + "; ".join(lines)


FIGURE = Figure(
    "11",
    _TITLE,
    tuple(name for reading in READINGS for name in (reading.cooperative, reading.collective)),
    _tabulate,
    _draw,
    _in_words,
)
