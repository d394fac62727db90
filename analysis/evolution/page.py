"""The page about the evolved policy: its gain, its training, its ablations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.evolution import cma, compare
from teamsight.analysis.evolution.compare import OPTIONS, Gain
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import canvas, head, signed, to_png
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import grid_of, includes_zero

# Resolution of the picture, which stands in a page.
_DPI = 90


def page(table: pd.DataFrame, about: Mapping[str, Any]) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    table : DataFrame
        The content of ``evolved.parquet``; the column `part` says what a row is about.
    about : mapping
        The number of runs, and what made the constants.
    """
    parts = {str(name): rows for name, rows in table.groupby("part")}
    made = about["made"]
    return markdown.page(
        "# The evolved policy",
        'Like A-CMOMMT, `policy="evolved"` adds up forces. How they depend on distance was found by '
        "evolution. Each robot remembers targets that it lost, teammates that it met, its trail, and the area that it "
        "has sensed. It perceives teammates only through a ring of 16 sectors, Θ(1); otherwise it perceives the same "
        "as A-CMOMMT.",
        f"Made by `teamsight evolve test --training evolution --out docs`: {about['runs']} runs of {cma.STEPS} steps "
        f"in each cell, paired on common noise. The root seed {cma.TEST} was used neither for training nor for "
        "choosing the options of A-CMOMMT.",
        "## Gain",
        _gain(parts, _cells_of(table)),
        _cell_table(_cells_of(table)),
        "![Gain of the evolved policy over the strongest A-CMOMMT](images/evolved.png)",
        "## Training",
        f"`{made['command']}` made {made['trials']:,} trials of {len(cma.cells())} worlds each, "
        f"{made['robot_steps'] / 1e9:.1f} × 10⁹ robot-steps in all. Every generation has new worlds (root seed "
        f"{cma.TRAIN}). Cells with more than 2 R² robots are left out, because there nearly all targets are "
        "observed under any policy.",
        *_training(parts),
        "Generation 0 was written by hand: the forces of A-CMOMMT, with smooth instead of 0-or-1 weights of targets, a "
        "memory of the area, and straight motion while idle.",
        "## Ablations",
        f"Gain when the output of one part of the policy is set to 0, without training it again (root seed "
        f"{cma.VALIDATE}):",
        _ablation_table(parts["ablation"]),
        "Differences smaller than these intervals are not significant.",
        "## Options of A-CMOMMT",
        f"Observed targets under A-CMOMMT with pairwise awareness, over the same grid (root seed {cma.SCREEN}):",
        _option_table(parts["screen"]),
    )


def picture(table: pd.DataFrame, about: Mapping[str, Any]) -> bytes:
    """Return the gain over team size and radius as PNG; for the parameters see `page`."""
    cells = _cells_of(table)
    figure = canvas(WIDTH, HEIGHT + HEAD)
    title = "Gain by evolution: the evolved policy (Θ(1), ring of 16) − the strongest A-CMOMMT (Θ(N))"
    head(
        figure,
        title,
        f"paired on common noise, mean over {about['runs']} runs of {cma.STEPS} steps, seed {cma.TEST}; "
        "in brackets: the 95 % confidence interval includes 0",
    )
    limit = 10.0 * np.ceil(cells["mean"].abs().max() / 10.0)
    look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, around_zero=True)
    draw_row(figure, grid_of(cells), look, open_cells=includes_zero(cells))
    return to_png(figure, title, _DPI)


def _gain(parts: Mapping[str, pd.DataFrame], cells: pd.DataFrame) -> str:
    best, worst = parts["screen"].iloc[0], cells.sort_values("mean").iloc[0]
    options = ", ".join(f"`{name}={best[name]!r}`" for name in OPTIONS)
    below = int((cells["high"] < compare.WORST).sum())
    return (
        f"Over R = 2..9 and N = 5..30 it observes **{_interval(parts['overall'].iloc[0])} percentage points** more of "
        f"the targets than A-CMOMMT under pairwise awareness with its best options ({options}; the best of "
        f"{len(parts['screen'])} combinations, screened with root seed {cma.SCREEN}). The smallest gain is "
        f"{worst['mean']:+.1f} ({worst['low']:+.1f} to {worst['high']:+.1f}), at N = {int(worst['robots'])}, R = "
        f"{worst['radius']:g}. Cells whose whole interval is below {compare.WORST:g}: {below or 'none'}."
    )


def _cells_of(table: pd.DataFrame) -> pd.DataFrame:
    cells = table[table["part"] == "cell"]
    # The column has no value in other rows, which makes it one of floats.
    return cells.assign(robots=cells["robots"].astype(int))


def _interval(row: Any) -> Gain:
    return Gain(row["mean"], row["low"], row["high"])


def _cell_table(cells: pd.DataFrame) -> str:
    grid = grid_of(cells)
    rows = ([str(robots), *(f"{value:+.1f}" for value in row)] for robots, row in grid.iterrows())
    return markdown.table(["N", *(f"R = {radius:g}" for radius in grid.columns)], rows)


def _training(parts: Mapping[str, pd.DataFrame]) -> list[str]:
    """Return the gain after some generations; nothing if the folder of the training was not given."""
    if "training" not in parts:
        return []
    rows = (
        [f"{int(row['generation'])}", f"{row['robot_steps'] / 1e9:.1f} × 10⁹", str(_interval(row))]
        for _, row in parts["training"].sort_values("generation").iterrows()
    )
    return [
        f"Gain on other worlds (root seed {cma.VALIDATE}), over the whole grid:",
        markdown.table(["generation", "robot-steps", "gain, 95 % interval [pp]"], rows),
    ]


def _ablation_table(ablations: pd.DataFrame) -> str:
    rows = ([str(row["name"]), str(_interval(row))] for _, row in ablations.iterrows())
    return markdown.table(["removed", "gain, 95 % interval [pp]"], rows)


def _option_table(screened: pd.DataFrame) -> str:
    rows = ([*(str(row[name]) for name in OPTIONS), f"{row['observed']:.2f}"] for _, row in screened.iterrows())
    return markdown.table([*OPTIONS, "observed [%]"], rows)
