"""The gain from awareness at each point of learning curves, and the number of transitions from which it pays."""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.analysis.stats.paired import half_width

#: Name under which the best learner with awareness is compared with the best one without.
BEST = "best"
_SCENARIO = ["robots", "radius"]
_POINT = ["learner", "transitions"]


def awareness_gains(table: pd.DataFrame, level: float = 0.95) -> pd.DataFrame:
    """Return what each learner observes without and with awareness, and the gain with its interval over memories.

    Parameters
    ----------
    table : DataFrame
        From `make_curves`.
    level : float
        Confidence of the intervals.

    Returns
    -------
    DataFrame
        learner, transitions, robots, radius, log10_size (with awareness), collective, cooperative, gain, low, high,
        worst (the least that a memory gave with awareness), count (of memories). The mean over all scenarios has NaN as
        robots and radius. The gain is paired on explorations and worlds; all worlds of a memory are one trial. Points
        without an observed fraction are left out; policies that do not learn have no gain.

    Notes
    -----
    The rows of the learner "best" compare, at each point, the learner of the largest mean with awareness and the one of
    the largest mean without: a gain over a learner that is poor without awareness is no evidence for awareness.
    """
    by = [*_POINT, *_SCENARIO, "memory"]
    kept = table.dropna(subset="observed_fraction")
    kept = kept.assign(degree=kept["degree"].where(kept["degree"] == "none", "other"))
    trials = kept.pivot_table("observed_fraction", by, "degree", sort=False).rename_axis(columns=None).reset_index()
    trials = trials.rename(columns={"none": "collective", "other": "cooperative"})
    trials = pd.concat([trials, _best(trials[trials["transitions"] > 0])], ignore_index=True)
    trials["gain"] = trials["cooperative"] - trials["collective"]
    means = trials.groupby([*_POINT, "memory"], sort=False)[["collective", "cooperative", "gain"]].mean().reset_index()
    parts = [_intervals(trials, [*_POINT, *_SCENARIO], level), _intervals(means, _POINT, level)]
    gains = pd.concat(parts, ignore_index=True)
    gains["log10_size"] = gains["learner"].map(kept.groupby("learner")["log10_size"].max())
    values = ["log10_size", "collective", "cooperative", "gain", "low", "high", "worst", "count"]
    return gains[[*_POINT, *_SCENARIO, *values]]


def _best(trials: pd.DataFrame) -> pd.DataFrame:
    """Return the trials of the best learner at each point, chosen separately with and without awareness."""
    point = ["transitions", *_SCENARIO]
    means = trials.groupby(["learner", *point], sort=False)[["cooperative", "collective"]].mean()
    found = trials[[*point, "memory"]].drop_duplicates().assign(learner=BEST)
    for which in ("cooperative", "collective"):
        chosen = means[which].groupby(point, sort=False).idxmax()
        of = trials.set_index(["learner", *point]).loc[list(chosen)].reset_index()
        found = found.merge(of[[*point, "memory", which]], on=[*point, "memory"])
    return found


def _intervals(trials: pd.DataFrame, by: list[str], level: float) -> pd.DataFrame:
    """Return the means over the memories of each point, with the interval of the gain."""
    points = trials.groupby(by, sort=False)
    means = points[["collective", "cooperative", "gain"]].mean()
    spread = points["gain"].agg(se="sem", count="count")
    wide = half_width(spread["se"].to_numpy(), spread["count"].to_numpy(), level)
    means = means.assign(low=means["gain"] - wide, high=means["gain"] + wide, worst=points["cooperative"].min())
    return means.assign(count=points.size()).reset_index()


def crossings(gains: pd.DataFrame) -> pd.DataFrame:
    """Return from how many transitions awareness pays, for each learner and scenario.

    It is the smallest number of transitions from which the lower end of the gain's interval stays above 0, at this and
    at all larger numbers, of which there must be one: the largest number alone is too easily decided by noise, once in
    forty times for intervals of 95 %.

    Parameters
    ----------
    gains : DataFrame
        From `awareness_gains`.

    Returns
    -------
    DataFrame
        learner, log10_size, robots, radius, crossing (transitions; NaN if there is none), largest (number of
        transitions).
    """
    learned = gains[gains["transitions"] > 0].sort_values("transitions", kind="stable")
    rows = []
    for place, points in learned.groupby(["learner", "log10_size", *_SCENARIO], sort=False, dropna=False):
        above = (points["low"] > 0).to_numpy()
        stays = np.logical_and.accumulate(above[::-1])[::-1]
        numbers = points["transitions"].to_numpy()
        crossing = float(numbers[stays].min()) if stays.sum() > 1 else np.nan
        rows.append((*place, crossing, int(numbers.max())))
    return pd.DataFrame(rows, columns=["learner", "log10_size", *_SCENARIO, "crossing", "largest"])


def mean_gains(gains: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of `awareness_gains` or `crossings` that are means over all scenarios."""
    return gains[gains["robots"].isna()]


def pays_from(crossing: float, largest: int) -> str:
    """Return a crossing in words, as in "pays from 600 transitions"."""
    if np.isnan(crossing):
        return f"is not shown to pay within {largest:,} transitions"
    return f"pays from {int(crossing):,} transitions"
