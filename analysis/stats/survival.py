"""Survival: which share of durations is longer than a time, from durations of which some are censored."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import ndtri

from teamsight.core import checks


def kaplan_meier(duration: ArrayLike, censored: ArrayLike, confidence: float = 0.95) -> pd.DataFrame:
    """Return the Kaplan–Meier estimate of the survival function.

    Parameters
    ----------
    duration : array_like of float, shape (n,)
        Durations, of any unit.
    censored : array_like of bool, shape (n,)
        Whether the true duration is longer than that, by an unknown time.
    confidence : float
        Confidence of the pointwise intervals.

    Returns
    -------
    DataFrame
        One row for each time at which a duration ended: duration, at_risk (durations that had not ended before),
        ended, survival (the share that is longer), low, high.

    Raises
    ------
    ValueError
        If a duration is negative or not finite, or the shapes differ.

    Notes
    -----
    *Source:* E. L. Kaplan and P. Meier (1958); the variance is Greenwood's, the interval that of log(−log S), which
    stays between 0 and 1. Durations that are censored at a time count as at risk at it. The interval assumes that
    durations are independent.
    """
    confidence = checks.number("confidence", confidence, above=0.0, most=0.999999)
    length, open_ended = np.asarray(duration, float), np.asarray(censored, bool)
    if length.shape != open_ended.shape or length.ndim != 1:
        raise ValueError(f"duration, censored: have the shapes {length.shape} and {open_ended.shape}; give one of each")
    if not np.isfinite(length).all() or np.any(length < 0):
        raise ValueError("duration: must be finite and at least 0; leave out others")
    times, ended = np.unique(length[~open_ended], return_counts=True)
    at_risk = len(length) - np.searchsorted(np.sort(length), times)
    survival = np.cumprod(1.0 - ended / at_risk)
    with np.errstate(divide="ignore", invalid="ignore"):
        greenwood = np.cumsum(ended / (at_risk * (at_risk - ended)))
        wide = ndtri(0.5 + confidence / 2) * np.sqrt(greenwood) / np.abs(np.log(survival))
        low, high = survival ** np.exp(wide), survival ** np.exp(-wide)
    gone = survival <= 0
    low, high = np.where(gone, 0.0, low), np.where(gone, 0.0, high)
    columns = {"duration": times, "at_risk": at_risk, "ended": ended, "survival": survival, "low": low, "high": high}
    return pd.DataFrame(columns)


def median(curve: pd.DataFrame) -> float:
    """Return the smallest duration beyond which at most half survive, by `kaplan_meier`; NaN if more always do."""
    short = curve.loc[curve["survival"] <= 0.5, "duration"]
    return float(short.iloc[0]) if len(short) else float("nan")
