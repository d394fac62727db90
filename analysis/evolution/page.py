"""The page about the evolved policy: its gain, its training, its ablations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.evolution import cma, compare
from teamsight.analysis.evolution.compare import CONSTANTS, FINALISTS, OPTIONS, RULES, Gain, default_constants
from teamsight.analysis.evolution.generalise import VARIATIONS
from teamsight.analysis.plot import markdown
from teamsight.analysis.plot.style import canvas, head, signed, to_png
from teamsight.analysis.plot.surface import HEAD, HEIGHT, WIDTH, Look, draw_row
from teamsight.analysis.stats.paired import grid_of, includes_zero

# Resolution of the picture, which stands in a page.
_DPI = 90
_CELLS = "; ".join(
    f"{name} = {', '.join(f'{value:g}' for value in values)}"
    for name, values in (("N", VARIATIONS[0].robots), ("R", VARIATIONS[0].radius))
)
_GENERALISATION = (
    f"The policy was evolved for one speed, one number of targets and one range. In other worlds (root seed "
    f"{cma.GENERALISE}; {_CELLS}), without training or screening again, its gain over the same A-CMOMMT is:"
)


def page(table: pd.DataFrame, about: Mapping[str, Any]) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    table : DataFrame
        The content of ``evolved.parquet``; the column `part` says what a row is about.
    about : mapping
        The number of runs, what made the constants, those of an evolution that began with them (None if there is
        none), and the options of A-CMOMMT with which the trainings of both were compared.
    """
    parts = {str(name): rows for name, rows in table.groupby("part")}
    made = about["made"]
    return markdown.page(
        "# The evolved policy",
        'Like A-CMOMMT, `policy="evolved"` adds up forces. How they depend on distance was found by '
        "evolution. Each robot remembers targets that it lost, teammates that it met, its trail, and the area that it "
        "has sensed. It perceives teammates only through a ring of 16 sectors, Θ(1). It reads odometry and a compass: "
        "its memories are moved by its own displacement (`percept.moved`) and have the directions of the world, in "
        "which a robot's heading is given. A-CMOMMT uses both for the targets that it remembers, and for nothing else.",
        f"Made by `teamsight evolve test --training evolution{' --further further' if about['further'] else ''} "
        f"--out docs`: {about['runs']} runs of {cma.STEPS} steps in each cell, paired on common noise. The root seed "
        f"{cma.TEST} was used neither for training nor for choosing the options of A-CMOMMT, nor for an earlier "
        "version of this page.",
        "## Gain",
        _gain(parts, _cells_of(table)),
        _cell_table(_cells_of(table)),
        "![Gain of the evolved policy over the strongest A-CMOMMT](images/evolved.png)",
        "## Training",
        f"`{made['command']}` made {made['trials']:,} trials of {len(cma.cells())} worlds each, "
        f"{made['robot_steps'] / 1e9:.1f} × 10⁹ robot-steps in all. Every generation has new worlds (root seed "
        f"{cma.TRAIN}). Cells with more than 2 R² robots are left out, because there nearly all targets are "
        "observed under any policy.",
        *_training(parts, about["trained"]),
        "Generation 0 was written by hand: the forces of A-CMOMMT, with smooth instead of 0-or-1 weights of targets, a "
        "memory of the area, and straight motion while idle.",
        *_continued(parts, about),
        "## Ablations",
        f"Gain when the output of one part of the policy is set to 0, without training it again (root seed "
        f"{cma.VALIDATE}):",
        _ablation_table(parts["ablation"]),
        "Differences smaller than these intervals are not significant.",
        "## Other worlds",
        _GENERALISATION,
        _variation_table(parts["generalisation"]),
        "## Options of A-CMOMMT",
        *_screening(parts["screen"]),
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
    limit = 5.0 * np.ceil(cells["mean"].abs().max() / 5.0)
    look = Look("gain in observed targets  [percentage points]", signed, -limit, limit, around_zero=True)
    draw_row(figure, grid_of(cells), look, open_cells=includes_zero(cells))
    return to_png(figure, title, _DPI)


def _gain(parts: Mapping[str, pd.DataFrame], cells: pd.DataFrame) -> str:
    best, worst = parts["screen"].iloc[0], cells.sort_values("mean").iloc[0]
    below = int((cells["high"] < compare.WORST).sum())
    return (
        f"Over R = 2..9 and N = 5..30 it observes **{_interval(parts['overall'].iloc[0])} percentage points** more of "
        f"the targets than A-CMOMMT under pairwise awareness with its best options ({_options(best)}; the best "
        f"of {len(parts['screen'])} combinations, screened with root seed {cma.SCREEN}). The smallest gain is "
        f"{_interval(worst)}, at N = {int(worst['robots'])}, R = "
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
    # Rounded first, and 0 added: a number that rounds to 0 is not negative.
    rows = ([str(robots), *(f"{round(value, 1) + 0.0:+.1f}" for value in row)] for robots, row in grid.iterrows())
    return markdown.table(["N", *(f"R = {radius:g}" for radius in grid.columns)], rows)


def _options(options: Mapping[str, Any] | pd.Series) -> str:
    return ", ".join(
        f"`{name}={options[name]:g}`" if name in CONSTANTS else f"`{name}={options[name]!r}`" for name in OPTIONS
    )


def _training(parts: Mapping[str, pd.DataFrame], options: Mapping[str, Any]) -> list[str]:
    """Return the gain after some generations; nothing if the folder of the training was not given."""
    if "training" not in parts:
        return []
    return [
        f"Gain on other worlds (root seed {cma.VALIDATE}), over the whole grid, over A-CMOMMT with "
        f"{_options(options)}:",
        _progress_table(parts["training"]),
    ]


def _continued(parts: Mapping[str, pd.DataFrame], about: Mapping[str, Any]) -> list[str]:
    """Return how far an evolution came that began with these constants; nothing if its folder was not given."""
    if "further" not in parts:
        return []
    made = about["further"]
    return [
        f"`{made['command']}` began with these constants and made {made['trials']:,} trials in new worlds (root seed "
        f"{cma.TRAIN_FURTHER}). Its gain on the worlds of root seed {cma.VALIDATE}, over A-CMOMMT with "
        f"{_options(about['continued'])}:",
        _progress_table(parts["further"]),
        "New constants ship only if, on these worlds, they gain more than the old ones by more than the interval.",
    ]


def _progress_table(points: pd.DataFrame) -> str:
    rows = (
        [f"{int(row['generation'])}", f"{row['robot_steps'] / 1e9:.1f} × 10⁹", str(_interval(row))]
        for _, row in points.sort_values("generation").iterrows()
    )
    return markdown.table(["generation", "robot-steps", "gain, 95 % interval [pp]"], rows)


def _ablation_table(ablations: pd.DataFrame) -> str:
    rows = ([str(row["name"]), str(_interval(row))] for _, row in ablations.iterrows())
    return markdown.table(["removed", "gain, 95 % interval [pp]"], rows)


def _variation_table(variations: pd.DataFrame) -> str:
    rows = ([str(row["name"]), f"{row['observed']:.1f}", str(_interval(row))] for _, row in variations.iterrows())
    return markdown.table(["what is different", "A-CMOMMT observes [%]", "gain, 95 % interval [pp]"], rows)


def _screening(screened: pd.DataFrame) -> list[str]:
    """Return how the options were screened: the rules, then the constants, each with a table."""
    usual = default_constants()
    is_first = (screened[list(CONSTANTS)] == list(usual.values())).all(axis=1)
    first = screened[is_first]
    added = screened["observed"].iloc[0] - first["observed"].iloc[0]
    rules = list(first[list(RULES)].head(FINALISTS).itertuples(index=False, name=None))
    rest = screened[[tuple(row) in rules for row in screened[list(RULES)].to_numpy()]]
    return [
        "Observed targets [%] under A-CMOMMT with pairwise awareness, over the same grid (root seed "
        f"{cma.SCREEN}). First all combinations of its rules, with the default constants, "
        + " and ".join(f"`{name}={value:g}`" for name, value in usual.items())
        + ":",
        _rule_table(first),
        f"Then the constants, under the best {FINALISTS} of these rules: the turn probability of robots that wander, "
        "and the gain of the force (see [what the paper leaves open](model.md#where-this-departs-from-the-paper)). "
        f"The best combination of all is the baseline of this page. It observes {added:.1f} percentage points more "
        "than the best rules with the default constants.",
        _constant_table(rest),
    ]


def _rule_table(screened: pd.DataFrame) -> str:
    rows = ([*(str(row[name]) for name in RULES), f"{row['observed']:.2f}"] for _, row in screened.iterrows())
    return markdown.table([*RULES, "observed [%]"], rows)


def _constant_table(screened: pd.DataFrame) -> str:
    """Return a table with a row for each turn probability and a column for each gain."""
    gains = CONSTANTS["gain"]
    rows = []
    for (*rules, turn), found in screened.groupby([*RULES, "turn_probability"]):
        observed = dict(zip(found["gain"], found["observed"], strict=True))
        rows.append([*map(str, rules), f"{turn:g}", *(f"{observed[gain]:.2f}" for gain in gains)])
    return markdown.table([*RULES, "turn_probability", *(f"gain {gain:g}" for gain in gains)], rows)
