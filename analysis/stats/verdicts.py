"""The verdict on a claim: its source, what was measured, and whether it holds."""

from __future__ import annotations

import math
from typing import NamedTuple

from teamsight.analysis.stats.paired import Interval

HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "undecided"


class Verdict(NamedTuple):
    """A claim, its source, what was measured, and whether it holds by the 95 % interval."""

    claim: str
    source: str
    measured: str
    verdict: str


def above(interval: Interval, least: float = 0.0) -> str:
    """Return whether a quantity is above a value by its interval: `HOLDS`, `FAILS` or `UNDECIDED`."""
    return HOLDS if interval.low > least else FAILS if interval.high <= least else UNDECIDED


def interval_text(interval: Interval, unit: str) -> str:
    """Return a signed mean, its unit and its interval, such as "+1.0 steps (−0.5 to +2.5)"; "not known" without one."""
    mean, low, high = interval
    if math.isnan(mean):
        return "not known"
    return f"{mean:+.1f} {unit} ({low:+.1f} to {high:+.1f})".replace("-", "−")


def percent_text(interval: Interval) -> str:
    """Return a share with its interval, in percent."""
    return interval_text(Interval(*(100.0 * one for one in interval)), "%")
