"""The page on the learned rule: what it gains, where, how it came about, and what its parts are worth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.evolution import cma, compare
from teamsight.analysis.evolution.compare import Gain
from teamsight.analysis.paper.figures.differences import signed
from teamsight.analysis.plot.style import canvas, head, to_png
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import grid_of

# A page's picture is small.
_DPI = 90


def page(table: pd.DataFrame, about: Mapping[str, Any]) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    table : DataFrame
        As ``learned.parquet`` holds it: the column `part` tells what a row is about.
    about : mapping
        Number of runs, and what made the constants.
    """
    parts = {str(name): rows for name, rows in table.groupby("part")}
    strongest = parts["screen"].iloc[0]
    gain, cells = _gain(parts["overall"].iloc[0]), _cells_of(table)
    worst = cells.sort_values("mean").iloc[0]
    below = int((cells["high"] < compare.WORST).sum())
    made = about["made"]
    found = [
        "# The learned rule",
        '`policy="evolved"` observes targets by forces, as A-CMOMMT does, but evolution set their laws, and each '
        "robot remembers targets that it lost, teammates that it met, its trail, and the ground it has seen. It "
        "perceives teammates through a ring of 16 sectors, Θ(1), and nothing else that A-CMOMMT does not.",
        f"Made by `python -m teamsight.analysis.evolution.evolve test`; {about['runs']} runs of {cma.STEPS} steps in "
        f"each cell, paired on common noise (root seed {cma.TEST}, which neither shaped the rule nor chose its "
        "rival).",
        "## What it gains",
        f"Over R = 2..9 and N = 5..30 it observes **{gain} percentage points** more of the targets than A-CMOMMT under "
        "pairwise awareness in its strongest setting ("
        + ", ".join(f"`{name}={strongest[name]!r}`" for name in compare.RULES_OF_A_CMOMMT)
        + f"; the best of {len(parts['screen'])}, screened with root seed {cma.SCREEN}). "
        f"The smallest gain is {worst['mean']:+.1f} ({worst['low']:+.1f} to {worst['high']:+.1f}) at N = "
        f"{int(worst['robots'])}, R = {worst['radius']:g}; cells whose interval lies wholly below "
        f"{compare.WORST:g}: {below or 'none'}.",
        _cells(cells),
        "![The gain of the learned rule over the strongest A-CMOMMT](images/learned.png)",
        "## The road there",
        f"`{made['command']}`: {made['trials']:,} trials of {len(cma.cells())} worlds each, "
        f"{made['robot_steps'] / 1e9:.1f} × 10⁹ robot-steps in all. Every generation meets new worlds "
        f"(root seed {cma.TRAIN}). Cells with more than 2 R² robots are left out: there nearly everything is "
        f"observed whatever the robots do. Measured on other noise (root seed {cma.VALIDATE}), over the whole "
        "grid:",
        _road(parts["road"]),
        "Generation 0 is a rule written down by hand: A-CMOMMT's forces with soft ownership, a remembered ground, and "
        "straight search instead of wandering.",
        "## What its parts are worth",
        "The gain when a part of the rule is silenced, without any further evolution (root seed "
        f"{cma.VALIDATE}):",
        _silenced(parts["silenced"]),
        "A part whose silence changes less than these intervals carries nothing that the runs can tell.",
        "## The settings of A-CMOMMT",
        _screen(parts["screen"]),
    ]
    return "\n\n".join(found) + "\n"


def picture(table: pd.DataFrame, about: Mapping[str, Any]) -> bytes:
    """Return the gain over team size and radius as PNG."""
    cells = _cells_of(table)
    figure = canvas(WIDTH, HEIGHT + HEAD)
    title = "Gain by learning: the learned rule (Θ(1), ring of 16) less the strongest A-CMOMMT (Θ(N))"
    head(
        figure,
        title,
        f"paired on common noise, mean over {about['runs']} runs of {cma.STEPS} steps, seed {cma.TEST}; "
        "in brackets: the 95 % confidence interval includes 0",
    )
    limit = 10.0 * np.ceil(cells["mean"].abs().max() / 10.0)
    look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, around_zero=True)
    unsure = grid_of(cells.assign(open=(cells["low"] <= 0) & (cells["high"] >= 0)), "open")
    draw_row(figure, grid_of(cells), look, open_cells=unsure)
    return to_png(figure, title, _DPI)


def _cells_of(table: pd.DataFrame) -> pd.DataFrame:
    cells = table[table["part"] == "cell"]
    # Beside rows of other kinds, which have none, team sizes became real numbers.
    return cells.assign(robots=cells["robots"].astype(int))


def _gain(row: Any) -> Gain:
    return Gain(row["mean"], row["low"], row["high"])


def _cells(cells: pd.DataFrame) -> str:
    grid = grid_of(cells)
    lines = [["N", *(f"R = {radius:g}" for radius in grid.columns)], ["---"] * (1 + len(grid.columns))]
    for robots, row in grid.iterrows():
        lines.append([str(robots), *(f"{value:+.1f}" for value in row)])
    return _table(lines)


def _road(road: pd.DataFrame) -> str:
    lines = [["generation", "robot-steps", "gain, 95 % interval [pp]"], ["---"] * 3]
    for _, row in road.sort_values("generation").iterrows():
        lines.append([f"{int(row['generation'])}", f"{row['robot_steps'] / 1e9:.1f} × 10⁹", str(_gain(row))])
    return _table(lines)


def _silenced(silent: pd.DataFrame) -> str:
    lines = [["silenced", "gain, 95 % interval [pp]"], ["---"] * 2]
    for _, row in silent.iterrows():
        lines.append(["nothing" if row["name"] == "all" else str(row["name"]), str(_gain(row))])
    return _table(lines)


def _screen(screened: pd.DataFrame) -> str:
    names = list(compare.RULES_OF_A_CMOMMT)
    lines = [[*names, "observed [%]"], ["---"] * (len(names) + 1)]
    for _, row in screened.iterrows():
        lines.append([*(str(row[name]) for name in names), f"{row['observed']:.2f}"])
    return _table(lines)


def _table(lines: list[list[str]]) -> str:
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
