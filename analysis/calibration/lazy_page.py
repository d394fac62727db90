"""The page about the search over what the paper leaves open of lazy learning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from teamsight.analysis.calibration import lazy
from teamsight.analysis.calibration.lazy import OPEN_CLAIMS
from teamsight.analysis.calibration.lazy_constants import VALUES, Constants
from teamsight.analysis.paper.lazy_teams import COLLECTIVE, COOPERATIVE
from teamsight.analysis.plot import markdown
from teamsight.analysis.stats.paired import half_width

# Rows of the summary: what is shown, and the column that holds it.
_SUMMARY = {
    "cooperative, 32 inputs [% observed]": COOPERATIVE,
    "collective, 16 inputs [% observed]": COLLECTIVE,
    "random walk [% observed]": "random-walk",
    "A-CMOMMT [% observed]": "a-cmommt",
    "gain: cooperative minus collective [pp]": "gain",
    "largest gain of the 20 cells, one run each [pp]": "largest",
    "gain of N ≤ 8 at R ≥ 7 [pp]": "few",
}


def page(table: pd.DataFrame) -> str:
    """Return the page in Markdown about a table that `lazy.search` returned."""
    phases = _phases(table)
    constants = lazy.chosen_constants(table)
    return markdown.page(
        "# The open constants of lazy learning",
        "The paper gives the size of the exploration (5 robots × 120 steps among 10 targets, 600 transitions), the "
        "reward (+1, −1, 0) and the algorithm. It does not give the radius of the arena and the speed of "
        "the robots during the exploration, k, the discount factor γ, the number of sweeps, which targets count for "
        "the reward, and the random numbers of the exploration. This page shows a search over them. Made by `teamsight "
        "calibrate lazy --out docs`; every trial is a row of [lazy-search.parquet](lazy-search.parquet).",
        "A trial makes an exploration and, from it, the cooperative and the collective learner. It runs each once at "
        f"N = {_listed(lazy.GRID.robots)} and R = {_listed(lazy.GRID.radius)}, on common noise and at the default "
        "speeds unless the text says otherwise. All root seeds are below 0, unlike those of any ledger. The gains "
        "reported for the chosen constants come from other worlds and explorations than those used for the choice. The "
        "largest gain of a trial comes from single runs, whose noise makes it too large; Figure 11 shows means of five "
        "runs.",
        "## In short",
        _short(phases["luck"]),
        "## What was chosen",
        *_choice(phases, constants),
        "## The chosen exploration, on other worlds",
        _summary(phases["chosen"], "root seeds"),
        "## Other explorations",
        f"The same constants with {len(phases['luck'])} other explorations of 600 transitions, each with another seed:",
        _summary(phases["luck"], "explorations"),
        *_spread(phases["luck"]),
        "## Effect of each constant",
        f"Over {len(phases['draw'])} trials with random constants and explorations: mean ± standard error over all "
        "values of the other constants. Distance is the mean distance of the claims from the paper's figures, each "
        "divided by the tolerance of its rule; the choice was made by it. Gain is cooperative minus collective.",
        _effect_table(phases["draw"]),
        "## Single changes",
        "Effect of changing one of the chosen constants, on explorations and worlds that were not used for the choice: "
        "the paired difference with its 95 % confidence interval.",
        *_changes(phases["vary"], constants),
        *(part for setting in lazy.SETTINGS for part in _elsewhere(table, setting)),
    )


def _phases(table: pd.DataFrame, setting: str = lazy.DEFAULTS) -> dict[str, pd.DataFrame]:
    return {str(name): part for name, part in table[table["setting"] == setting].groupby("phase")}


def _elsewhere(table: pd.DataFrame, setting: str) -> list[str]:
    phases = _phases(table, setting)
    gain = phases["luck"]["gain"]
    return [
        f"## The setting `{setting}`",
        "The speeds of this setting give other explorations; the constants are those chosen above. Of the seeds 0 to "
        f"{len(phases['memory']) - 1}, **seed {lazy.chosen_memory(table, setting)}** was chosen in the same way. On "
        "other worlds:",
        _summary(phases["chosen"], "root seeds"),
        f"With {len(gain)} other explorations, each with another seed:",
        _summary(phases["luck"], "explorations"),
        f"The gain is {_with_interval(gain, ' pp')} on average over these explorations, with a standard deviation of "
        f"{gain.std():.1f}. It is positive for {_percent(gain > 0)} of them.",
    ]


def _short(luck: pd.DataFrame) -> str:
    means = {name: luck[name].mean() for name in (COOPERATIVE, COLLECTIVE, "random-walk", "a-cmommt")}
    return (
        f"After 600 transitions cooperative robots observe {means[COOPERATIVE]:.1f} % of the targets and collective "
        f"ones {means[COLLECTIVE]:.1f} %, on average over {len(luck)} explorations. A random walk observes "
        f"{means['random-walk']:.1f} %, A-CMOMMT {means['a-cmommt']:.1f} %. The gain from awareness is "
        f"{_with_interval(luck['gain'], ' pp')}, and depends more on the exploration than on any constant. The paper's "
        f"largest gain, 25 ± 8 pp, is reached by {_percent(luck['learned-gain'])} of the explorations, in single runs."
    )


def _choice(phases: dict[str, pd.DataFrame], constants: Constants) -> list[str]:
    changed = {name: value for name, value in asdict(constants).items() if value != getattr(Constants(), name)}
    return [
        "The search began with the constants "
        + ", ".join(f"`{name}={value!r}`" for name, value in asdict(Constants()).items())
        + f". Another value replaces one of them only if its distance from the paper is smaller by more than "
        f"{lazy.CLEARLY:g} standard errors of the difference. Replaced: "
        + (", ".join(f"`{name}={value!r}`" for name, value in changed.items()) or "none")
        + ". In so many comparisons about one replacement would be expected by chance.",
        f"Then the exploration was chosen. Of the seeds 0 to {len(phases['memory']) - 1}, the "
        f"{phases['again']['memory'].nunique()} under which most claims hold (and among equals, those nearest to the "
        f"paper) were tried again in other worlds. The best there is **seed {lazy.chosen_memory(phases['again'])}**, "
        "which ships as `policies/data/lazy-600.safetensors`. So it is better than a typical exploration, which may be "
        "true of the paper's too; the next two sections show by how much.",
    ]


def _summary(rows: pd.DataFrame, unit: str) -> str:
    lines = []
    for title, column in _SUMMARY.items():
        low, high = _interval(rows[column])
        least, most = rows[column].min(), rows[column].max()
        lines.append([title, f"{rows[column].mean():.1f}", f"{low:.1f} … {high:.1f}", f"{least:.1f} … {most:.1f}"])
    lines += [[f"{name} holds", _percent(rows[name]), "", ""] for name in OPEN_CLAIMS if name in rows]
    return markdown.table(["", "mean", "95 % interval of the mean", f"range over {len(rows)} {unit}"], lines)


def _spread(luck: pd.DataFrame) -> list[str]:
    low, high = np.quantile(luck["gain"], (0.025, 0.975))
    return [
        f"For 95 % of the explorations the mean gain is between {low:+.1f} and {high:+.1f} pp (standard deviation "
        f"{luck['gain'].std():.1f}). It is positive for {_percent(luck['gain'] > 0)} of them, and the largest gain is "
        f"17 pp or more for {_percent(luck['largest'] >= 17)}. The intervals in Figure 11, which is drawn from one "
        "exploration, do not include this spread.",
        "The reason is that robots on a random walk do not get far in 120 steps. Of the 600 transitions of an "
        f"exploration, {luck['gained'].mean():.0f} gain a target ({luck['gained'].min()} to {luck['gained'].max()}), "
        f"and in {100 * luck['met'].mean():.0f} % the robot senses a teammate ({100 * luck['met'].min():.0f} to "
        f"{100 * luck['met'].max():.0f}; in {_percent(luck['met'] == 0)} of the explorations no robot ever does). So "
        "the response to teammates that the cooperative learner acquires is largely accidental: robots gather after "
        "some explorations and disperse after others. The correlation between the gain and the change of the largest "
        f"number of neighbours is {luck['gain'].corr(luck['crowding']):+.2f}.",
    ]


def _effect_table(drawn: pd.DataFrame) -> str:
    columns = {"distance": "distance_from_paper", "gain [pp]": "gain", "cooperative [%]": COOPERATIVE}
    lines = [
        [name, str(value), str(len(rows)), *(_with_error(rows[column]) for column in columns.values())]
        for name in VALUES
        for value, rows in drawn.groupby(name)
    ]
    return markdown.table(["constant", "value", "trials", *columns], lines)


def _changes(varied: pd.DataFrame, constants: Constants) -> list[str]:
    same = {name: varied[name] == getattr(constants, name) for name in VALUES}
    base = varied[np.logical_and.reduce(list(same.values()))].set_index("memory")
    lines = []
    for name in VALUES:
        for value, rows in varied[~same[name]].groupby(name):
            changes = [(rows.set_index("memory")[column] - base[column]).dropna() for column in ("gain", COOPERATIVE)]
            lines.append([name, str(value), *(_with_interval(change) for change in changes)])
    return [
        f"With the chosen constants the gain is {base['gain'].mean():+.1f} pp over {len(base)} explorations.",
        markdown.table(["constant", "value", "change of gain [pp]", "change of cooperative [pp]"], lines),
    ]


def _percent(holds: pd.Series[bool]) -> str:
    return f"{100 * holds.mean():.0f} %"


def _with_error(values: pd.Series[float]) -> str:
    error: Any = values.sem()
    return f"{values.mean():.2f} ± {error:.2f}"


def _with_interval(values: pd.Series[float], unit: str = "") -> str:
    low, high = _interval(values)
    return f"{values.mean():+.1f}{unit} ({low:+.1f} … {high:+.1f})"


def _interval(values: pd.Series[float]) -> tuple[float, float]:
    wide = float(half_width(np.array([values.sem()]), np.array([len(values)]))[0])
    return float(values.mean()) - wide, float(values.mean()) + wide


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
