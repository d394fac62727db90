"""The claims of Balch and Arkin as signs and order, with intervals, and how sure we are of each.

Notes
-----
Only what was read, or what Touzet (2000) says, can hold or fail. What is recalled, and not verified, agrees or differs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, UNDECIDED, Verdict, percent_text

Floats = npt.NDArray[np.float64]

#: How sure the source of a claim is: read, said by Touzet (2000), recalled.
READ, TOUZET, RECALLED = "abstract", "Touzet (2000)", "recalled, not verified"
#: The difference that counts as none, as a share of the time.
MARGIN = 0.03
#: The share of the gain of goals that states are to give.
SHARE = 0.8


class Improvement(NamedTuple):
    """What one level of communication is said to gain over another, at most [%]; and in which task."""

    task: str
    level: str
    over: str
    percent: float


#: The three percentages that Touzet (2000) quotes.
PERCENTAGES = (
    Improvement("forage", "goal", "none", 19.0),
    Improvement("consume", "state", "none", 10.0),
    Improvement("graze", "goal", "none", 1.0),
)


def times(table: pd.DataFrame, task: str, communication: str) -> Floats:
    """Return the completion times of a task with one level of communication, in the order of cells and replicates."""
    part = table[(table["task"] == task) & (table["communication"] == communication)]
    return np.asarray(part.sort_values(["robots", "attractors", "replicate"])["time"], float)


def gain(table: pd.DataFrame, task: str, level: str, over: str) -> Interval:
    """Return by which share the mean time with one level of communication is shorter than with another.

    The interval is Student's, of the paired differences to first order in the ratio of the means.
    """
    with_, without = times(table, task, level), times(table, task, over)
    ratio = with_.mean() / without.mean()
    return interval_of(1.0 - ratio + (ratio * without - with_) / without.mean())


def largest(table: pd.DataFrame, task: str, level: str, over: str) -> tuple[float, str]:
    """Return the largest gain of a cell, and the cell in words."""
    found = []
    for (robots, attractors), cell in table[table["task"] == task].groupby(["robots", "attractors"]):
        where = f"N = {robots}" + (f", {attractors} attractors" if attractors else "")
        found.append((gain(cell, task, level, over).mean, where))
    return max(found)


def verdicts(table: pd.DataFrame) -> list[Verdict]:
    """Return the verdicts on all claims; `table` is that of the runs of `plan.Plan`."""
    return [
        _more(table, "B1 Forage: goals are better than no communication", TOUZET, "forage", "goal", "none"),
        _more(table, "B1 Forage: states are better than no communication", RECALLED, "forage", "state", "none"),
        _no_less(table, "B1 Forage: goals are at least as good as states", RECALLED, "forage", "goal", "state"),
        _more(table, "B2 Consume: states are better than no communication", TOUZET, "consume", "state", "none"),
        _no_less(table, "B2 Consume: states are at least as good as goals", RECALLED, "consume", "state", "goal"),
        _none(table, "B3 Graze: states make no difference", TOUZET, "graze", "state", "none"),
        _none(table, "B3 Graze: goals make no difference", TOUZET, "graze", "goal", "none"),
        _most_of_it(table),
    ]


def _judged(claim: str, source: str, interval: Interval, holds: bool, fails: bool) -> Verdict:
    verdict = HOLDS if holds else FAILS if fails else UNDECIDED
    if source == RECALLED:
        verdict = {HOLDS: "agrees", FAILS: "differs"}.get(verdict, verdict)
    return Verdict(claim, source, percent_text(interval), verdict)


def _more(table: pd.DataFrame, claim: str, source: str, task: str, level: str, over: str) -> Verdict:
    found = gain(table, task, level, over)
    return _judged(claim, source, found, found.low > 0.0, found.high <= 0.0)


def _no_less(table: pd.DataFrame, claim: str, source: str, task: str, level: str, over: str) -> Verdict:
    found = gain(table, task, level, over)
    return _judged(claim, source, found, found.low >= -MARGIN, found.high < -MARGIN)


def _none(table: pd.DataFrame, claim: str, source: str, task: str, level: str, over: str) -> Verdict:
    found = gain(table, task, level, over)
    inside = found.low >= -MARGIN and found.high <= MARGIN
    return _judged(claim, source, found, inside, found.high < -MARGIN or found.low > MARGIN)


def _most_of_it(table: pd.DataFrame) -> Verdict:
    """States give at least four fifths of what goals give; undecided if goals give nothing."""
    none, state, goal = (times(table, "forage", level) for level in ("none", "state", "goal"))
    found = interval_of(((none - state) - SHARE * (none - goal)) / none.mean())
    has_gain = gain(table, "forage", "goal", "none").low > 0.0
    claim = f"B4 Forage: states give at least {SHARE:g} of the gain of goals"
    made = _judged(claim, READ, found, has_gain and found.low >= 0.0, has_gain and found.high < 0.0)
    note = "" if has_gain else "; goals gain nothing of which this could be a share"
    return made._replace(measured=made.measured + note)
