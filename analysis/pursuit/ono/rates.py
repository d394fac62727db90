"""Rates of capture, with intervals: over runs of learners, and by Poisson's law for random hunters."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.special import gammaincinv

from teamsight.analysis.pursuit.ono.measure import LATE, PARTS
from teamsight.analysis.stats.paired import Interval, interval_of

Floats = npt.NDArray[np.float64]


def late_rates(table: pd.DataFrame, condition: str) -> Floats:
    """Return log10 of the captures per step at the end of each run; a run without any counts as half a capture."""
    found = _runs(table, condition)
    return np.asarray(np.log10(np.maximum(found["late"], 0.5) / (found["steps"] * LATE / PARTS)), float)


def early_rates(table: pd.DataFrame, condition: str) -> Floats:
    """Return log10 of the captures per step in the first tenth of each run, without any as half a capture."""
    found = _runs(table, condition)
    parts = np.array(found["parts"].tolist())[:, : PARTS // 10].sum(axis=1)
    return np.asarray(np.log10(np.maximum(parts, 0.5) / (found["steps"] / 10)), float)


def late_steps(table: pd.DataFrame, condition: str, level: float = 0.95) -> Interval:
    """Return the steps to a capture at the end of runs, their geometric mean with its interval.

    If a run has no capture there, the upper end is infinite; if none has any, so is the mean, and the lower end is
    Poisson's bound.
    """
    found = _runs(table, condition)
    if not found["late"].any():
        return Interval(math.inf, float(found["steps"].sum()) * LATE / PARTS / _most(0, level), math.inf)
    mean, low, high = interval_of(-late_rates(table, condition), level)
    return Interval(10**mean, _power(low), math.inf if (found["late"] == 0).any() else _power(high))


def random_steps(table: pd.DataFrame, condition: str, level: float = 0.95) -> Interval:
    """Return the mean steps to a capture of random hunters; captures at random times follow Poisson's law.

    Without a capture the mean is infinite, and the lower end is a bound.
    """
    found = _runs(table, condition)
    captures, steps = int(found["captures"].sum()), float(found["steps"].sum())
    least = float(gammaincinv(captures, (1 - level) / 2)) if captures else 0.0
    mean = steps / captures if captures else math.inf
    return Interval(mean, steps / _most(captures, level), steps / least if least else math.inf)


def expected_steps(side: int, hunters: int = 4) -> float:
    """Return the mean steps to a capture if hunters were anywhere but in the prey's cell: (side² − 1)⁴ / 4!.

    There are 4! ways in which four hunters hold four sides. Random hunters need less, because one that would enter the
    prey's cell stays beside it.
    """
    return float((side**2 - 1) ** hunters / math.factorial(hunters))


def _most(captures: int, level: float) -> float:
    """Return the largest mean number of captures with which so few are not too unlikely, by Poisson's law."""
    return float(gammaincinv(captures + 1, 1 - (1 - level) / 2))


def _runs(table: pd.DataFrame, condition: str) -> pd.DataFrame:
    return table[table["condition"] == condition].sort_values("replicate")


def _power(exponent: float) -> float:
    return 10**exponent if exponent < 300 else math.inf
