"""The points of learning curves: means with intervals over explorations, and the gain from awareness."""

from __future__ import annotations

import pandas as pd

from teamsight.analysis.stats.paired import half_width


def curve_points(table: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return the mean of each point with its interval over memories. All worlds of a memory are one trial.

    Parameters
    ----------
    table : DataFrame
        From `make_curves`.
    level : float
        Confidence of the intervals.

    Returns
    -------
    DataFrame
        learner, degree, transitions, inputs, log10_size, mean, low, high, count (of memories); points without an
        observed fraction are left out.
    """
    return _intervals(_trials(table, "inputs", "log10_size"), "observed_fraction", level)


def awareness_gains(table: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return the gain in observed targets from awareness, for each learner, paired on explorations and worlds.

    Parameters
    ----------
    table : DataFrame
        From `make_curves`.
    level : float
        Confidence of the intervals.

    Returns
    -------
    DataFrame
        learner, degree, transitions, mean, low, high, count (of memories): the difference from the same learner under
        Θ(0), with the same number of transitions.
    """
    trials = _trials(table[table["transitions"] > 0])
    without = trials[trials["degree"] == "none"].drop(columns="degree")
    both = trials[trials["degree"] != "none"].merge(
        without, on=["learner", "transitions", "memory"], suffixes=("", "_without")
    )
    both["difference"] = both["observed_fraction"] - both.pop("observed_fraction_without")
    return _intervals(both.drop(columns="observed_fraction"), "difference", level)


def _trials(table: pd.DataFrame, *columns: str) -> pd.DataFrame:
    """Return the mean over the worlds of each memory at each point."""
    by = ["learner", "degree", "transitions", *columns, "memory"]
    return table.dropna(subset="observed_fraction").groupby(by, sort=False)["observed_fraction"].mean().reset_index()


def _intervals(trials: pd.DataFrame, value: str, level: float) -> pd.DataFrame:
    """Return the mean over the memories of each point, with its interval."""
    point = [name for name in trials.columns if name not in ("memory", value)]
    cells = trials.groupby(point, sort=False)[value].agg(mean="mean", se="sem", count="count").reset_index()
    wide = half_width(cells["se"].to_numpy(), cells["count"].to_numpy(), level)
    return cells.assign(low=cells["mean"] - wide, high=cells["mean"] + wide).drop(columns="se")
