"""The claims on schemes of reinforcement, and on what the table knows of intruders, with intervals.

Notes
-----
What is recalled of Mataric, and not verified, agrees or differs. What Touzet (2000) says, and what is ours, can hold or
fail.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from teamsight.analysis.collecting.plan import Plan
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.analysis.stats.verdicts import FAILS, HOLDS, Verdict, above, interval_text

#: How sure the source of a claim is.
RECALLED, TOUZET, OURS = "recalled, not verified", "Touzet (2000), §2.3", "ours"
#: The share of rows that a table of random values has right.
CHANCE = 0.25

_RECALLED = {HOLDS: "agrees", FAILS: "differs"}


def values(table: pd.DataFrame, condition: str, column: str, size: int) -> np.ndarray:
    """Return a column of all runs of a condition with a team of some size, in the order of replicates."""
    part = table[(table["condition"] == condition) & (table["robots"] == size)]
    return np.asarray(part.sort_values("replicate")[column], float)


def difference(table: pd.DataFrame, one: str, other: str, column: str, size: int) -> Interval:
    """Return by how much a column of one condition exceeds that of another, paired by run."""
    return interval_of(values(table, one, column, size) - values(table, other, column, size))


def points(interval: Interval) -> str:
    """Return shares with their interval, in percentage points."""
    return interval_text(Interval(*(100.0 * one for one in interval)), "points")


def verdicts(table: pd.DataFrame, plan: Plan) -> list[Verdict]:
    """Return the verdicts on all claims; `table` is that of the runs of `plan`.

    Each names the steps after which it is judged: the sign can change later.
    """
    size = plan.sizes[0]
    found = [
        _order("M1 Events teach more rows than the delivered puck alone", table, "events", "delayed", "correct", size),
        _order("M1 Progress estimators teach more than events alone", table, "progress", "events", "correct", size),
        _order(
            "M2 With the estimator I more rows with an intruder are learned", table, "progress", "events + H",
            "correct_intruder", size,
        ),
    ]  # fmt: skip
    found += [_no_chance(table, condition, size) for condition in ("delayed", "events", "events + H")]
    found.append(_delivers(table, size))
    early = [one._replace(claim=_after(one.claim, plan.judged)) for one in found]
    late = [_pays(table, coding, n) for n in plan.sizes for coding in ("count", "ring")]
    return [*early, *(one._replace(claim=_after(one.claim, plan.times[-1])) for one in late)]


def _after(claim: str, steps: int) -> str:
    return f"{claim}, after {steps:,} steps"


def _order(claim: str, table: pd.DataFrame, one: str, other: str, column: str, size: int) -> Verdict:
    found = difference(table, one, other, column, size)
    verdict = above(found)
    return Verdict(claim, RECALLED, f"{one} − {other}: {points(found)}", _RECALLED.get(verdict, verdict))


def _no_chance(table: pd.DataFrame, condition: str, size: int) -> Verdict:
    """Without the estimator I, rows with an intruder are right no more often than by chance."""
    found = interval_of(values(table, condition, "correct_intruder", size) - CHANCE)
    # The claim is that the share is not above chance.
    verdict = {HOLDS: "differs", FAILS: "agrees"}.get(above(found), above(found))
    claim = f"M2 Without it ({condition}) they are right no more often than by chance"
    return Verdict(claim, RECALLED, f"{condition} − 25 %: {points(found)}", verdict)


def _delivers(table: pd.DataFrame, size: int) -> Verdict:
    found = difference(table, "progress", "delayed", "delivered_early", size)
    claim = "Teams that learn more rows right deliver more"
    return Verdict(claim, OURS, f"progress − delayed: {interval_text(found, 'pucks')}", above(found))


def _pays(table: pd.DataFrame, coding: str, size: int) -> Verdict:
    found = difference(table, coding, "progress", "delivered", size)
    what = {"count": "The number of intruders", "ring": "In which sectors intruders are"}[coding]
    claim = f"{what} pays more than one bit, N = {size}"
    return Verdict(claim, TOUZET, f"{coding} − bit: {interval_text(found, 'pucks')}", above(found))
