"""The points of learning curves: means with intervals over explorations, and what awareness adds to them."""

from __future__ import annotations

import pandas as pd

from teamsight.analysis.stats.paired import half_width


def curve_points(table: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return the mean of every point with its interval over memories: each memory is one trial, whatever its worlds.

    Returns
    -------
    DataFrame
        learner, degree, pairs, inputs, log10_size, mean, low, high, count (of memories); points without a table are
        left out.
    """
    point = ["learner", "degree", "pairs", "inputs", "log10_size"]
    trials = (
        table.dropna(subset="observed_fraction").groupby([*point, "memory"], sort=False)["observed_fraction"].mean()
    )
    cells = trials.groupby(point, sort=False).agg(mean="mean", se="sem", count="count").reset_index()
    wide = half_width(cells["se"].to_numpy(), cells["count"].to_numpy(), level)
    return cells.assign(low=cells["mean"] - wide, high=cells["mean"] + wide).drop(columns="se")


def awareness_gains(table: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return how much more each learner observes with awareness than without, paired on explorations and worlds.

    Returns
    -------
    DataFrame
        learner, degree, pairs, mean, low, high, count (of memories): of the difference to the same learner, from as
        many pairs, under Θ(0).
    """
    point = ["learner", "degree", "pairs"]
    learned = table[table["pairs"] > 0].dropna(subset="observed_fraction")
    trials = learned.groupby([*point, "memory"], sort=False)["observed_fraction"].mean().reset_index()
    without = trials[trials["degree"] == "none"].drop(columns="degree")
    both = trials[trials["degree"] != "none"].merge(
        without, on=["learner", "pairs", "memory"], suffixes=("", "_without")
    )
    both["difference"] = both["observed_fraction"] - both["observed_fraction_without"]
    cells = both.groupby(point, sort=False)["difference"].agg(mean="mean", se="sem", count="count").reset_index()
    wide = half_width(cells["se"].to_numpy(), cells["count"].to_numpy(), level)
    return cells.assign(low=cells["mean"] - wide, high=cells["mean"] + wide).drop(columns="se")
