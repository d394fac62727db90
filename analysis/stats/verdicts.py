"""The verdict on a claim: its source, what was measured, and whether it holds; and intervals as texts."""

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


def no_less(interval: Interval, margin: float) -> str:
    """Return whether a quantity is at least 0, or short of it by the margin at most, by its interval."""
    return HOLDS if interval.low >= -margin else FAILS if interval.high < -margin else UNDECIDED


def within(interval: Interval, margin: float) -> str:
    """Return whether a quantity differs from 0 by the margin at most, by its interval."""
    if interval.low >= -margin and interval.high <= margin:
        return HOLDS
    return FAILS if interval.high < -margin or interval.low > margin else UNDECIDED


def signed_text(value: float, digits: int = 1) -> str:
    """Return a number with its sign; one that rounds to 0 is not negative."""
    return f"{round(value, digits) + 0.0:+.{digits}f}".replace("-", "−")


def interval_text(interval: Interval, unit: str = "", digits: int = 1, scale: float = 1.0) -> str:
    """Return a signed mean, its unit and its interval, such as "+1.0 steps (−0.5 to +2.5)".

    The interval of a single value is left out; without a mean it is "not known".
    """
    if math.isnan(interval.mean):
        return "not known"
    mean, low, high = (signed_text(scale * one, digits) for one in interval)
    return f"{mean} {unit}".rstrip() + (f" ({low} to {high})" if math.isfinite(interval.low) else "")


def plus_minus(mean: float, high: float, how: str = ".1f", wide: str = "") -> str:
    """Return a mean with half its interval, such as "1.0 ± 0.3"; an infinite one is left out."""
    half = high - mean
    return f"{mean:{how}} ± {half:{wide or how}}" if math.isfinite(half) else f"{mean:{how}}"
