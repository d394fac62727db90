"""Exceedance of δ: the curve P(max > δ), its confidence bounds, and the δ for a stated risk."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from teamsight.core import checks

# Rounds until an effective number is consistent with its own correction; ten are usual.
_MOST_ROUNDS = 100
# Autocorrelations below are 0 but for rounding.
_ROUNDING = 1e-12


def bounds(
    exceeding: ArrayLike, trials: float, confidence: float = 0.95
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the Clopper–Pearson lower and upper bound of a probability, each with this confidence.

    Parameters
    ----------
    exceeding : array_like of float
        Number of trials in which it happened; not a whole number if the number of trials is an effective one.
    trials : float
        Number of independent trials, above 0.
    confidence : float
        Confidence of each bound by itself; that of the interval is 2 · confidence − 1.

    Returns
    -------
    low, high : ndarray of float64

    Notes
    -----
    *Source:* C. J. Clopper and E. S. Pearson (1934), the exact interval, which is never too short. With an
    effective number of trials: E. L. Korn and B. I. Graubard (1998).
    """
    checks.number("trials", trials, above=0.0)
    checks.number("confidence", confidence, above=0.0, most=1.0)
    count = np.asarray(exceeding, dtype=np.float64)
    with np.errstate(all="ignore"):
        low = np.where(count <= 0, 0.0, stats.beta.ppf(1.0 - confidence, count, trials - count + 1.0))
        high = np.where(count >= trials, 1.0, stats.beta.ppf(confidence, count + 1.0, trials - count))
    return low, high


def trials_needed(risk: float, confidence: float = 0.95) -> int:
    """Return the smallest number of independent trials that can support a risk, if none exceeds δ.

    Notes
    -----
    After n trials without an event its probability is below 1 − (1 − confidence)^(1/n); this is at most `risk` from
    n = ln(1 − confidence) / ln(1 − risk) on, the "rule of three" 3/risk for 95 %.
    """
    risk = checks.number("risk", risk, above=0.0, most=1.0)
    confidence = checks.number("confidence", confidence, above=0.0, most=1.0)
    if risk == 1.0:
        return 1
    return max(1, math.ceil(math.log1p(-confidence) / math.log1p(-risk) - 1e-9))


def supported_risk(trials: float, confidence: float = 0.95) -> float:
    """Return the smallest risk that this number of independent trials can support, if none exceeds δ.

    Parameters
    ----------
    trials : float
        Number of independent trials, above 0.
    confidence : float
        Confidence of the bound.
    """
    trials = checks.number("trials", trials, above=0.0)
    confidence = checks.number("confidence", confidence, above=0.0, most=1.0)
    return float(-np.expm1(np.log1p(-confidence) / trials)) if confidence < 1.0 else 1.0


def supports(trials: float, risk: float, confidence: float = 0.95) -> bool:
    """Return whether this number of independent trials can support a risk, if none exceeds δ.

    Parameters
    ----------
    trials, confidence
        See `supported_risk`.
    risk : float
        Maximum probability of exceeding δ.
    """
    return supported_risk(trials, confidence) <= risk * (1 + 1e-9)


def curve(
    maxima: ArrayLike, team_size: int, *, independent: float | None = None, confidence: float = 0.95
) -> pd.DataFrame:
    """Return the exceedance curve of the largest degree.

    Parameters
    ----------
    maxima : array_like of int, shape (trials,)
        The largest degree of each trial (a run, or a window of a record).
    team_size : int
        N; no robot can have more than N − 1 neighbours.
    independent : float, optional
        Effective number of independent trials; by default all.
    confidence : float
        Confidence of each bound by itself.

    Returns
    -------
    DataFrame
        One row for each δ from 0 to N − 1: delta, exceeding (int64, trials whose largest degree is above δ);
        probability, low, high (float64). At δ = N − 1 all are 0, which is certain.
    """
    largest = np.asarray(maxima, dtype=np.int64)
    if not largest.size:
        raise ValueError("maxima: empty; the exceedance needs at least one run")
    delta = np.arange(team_size)
    ordered = np.sort(largest)
    exceeding = len(ordered) - np.searchsorted(ordered, delta, side="right")
    independent = float(len(ordered)) if independent is None else independent
    probability = exceeding / len(ordered)
    low, high = bounds(probability * independent, independent, confidence)
    certain = delta == team_size - 1
    columns = {"delta": delta, "exceeding": exceeding, "probability": probability, "low": low}
    return pd.DataFrame(columns | {"high": np.where(certain, 0.0, high)})


def smallest_delta(exceedance: pd.DataFrame, column: str, risk: float) -> int:
    """Return the smallest δ whose `column` (probability, low or high) is at most `risk`.

    Notes
    -----
    With "high" the result has the confidence of a single bound, although many δ are compared: the bounds decrease with
    δ, so the result is too small only if the bound fails at the largest δ whose true probability is above the risk.
    """
    within: Any = exceedance.loc[exceedance[column] <= risk, "delta"]
    return int(within.iloc[0])


def effective_number(
    *series: ArrayLike, run: ArrayLike | None = None, errors: float = 0.0, least: float = 0.0
) -> float:
    """Return the effective number of independent values in successive windows, the smallest over several series.

    Parameters
    ----------
    *series : array_like of float, shape (n,)
        One value for each window.
    run : array_like, shape (n,), optional
        Run of each window, if there are several, one after the other. Values of different runs are independent.
    errors : float
        Number of standard errors, 1/√n each, by which an autocorrelation must exceed 0 to count.
    least : float
        Autocorrelation from which on it counts: of many values some small ones are noise.

    Returns
    -------
    float
        Between 1 and n. If all series are constant, each run counts as one value.

    Notes
    -----
    n' = n / (1 + 2 Σ ρ_t) over the autocorrelations ρ_t before the first that is not positive; the others are noise
    (after C. J. Geyer, 1992, for a positive sequence). Deviations from the mean of the windows themselves, whose
    variance is 1/n' of theirs, lower every autocorrelation by about 1/n', which is added again. Without this, few
    windows of slow robots would count as independent: of 10 with ρ_1 = 0.8, five instead of three.

    The variance of a mean is the sum of the covariances of all pairs of values. So ρ_t sums the products of the pairs
    that are t windows apart *in the same run*, and leaves out pairs of different runs, whose covariance is 0. All
    deviations are from the common mean: what differs from run to run but hardly within one lowers the number to about
    that of the runs. Runs of one window each are as many values as runs, whatever they are.
    """
    label = np.zeros(np.size(series[0]), np.int64) if run is None else pd.factorize(np.asarray(run))[0]
    found = [_effective(np.asarray(values, dtype=np.float64), label, errors, least) for values in series]
    varying = [number for number in found if number is not None]
    size = np.bincount(label)
    return min(varying, default=float(size.sum() ** 2 / np.square(size).sum()))


def _effective(values: NDArray[np.float64], run: NDArray[np.int64], errors: float, least: float) -> float | None:
    size = len(values)
    deviation = values - values.mean()
    variance = float(deviation @ deviation)
    if size < 2 or variance <= 1e-24 * size:
        return None
    products, pairs = _lagged(deviation, np.bincount(run))
    correlation, share = products / variance, pairs / (size - np.arange(1, len(pairs) + 1))
    number = float(size)
    # Each round lowers the number, because a smaller number raises the correction.
    for _ in range(_MOST_ROUNDS):
        corrected = correlation + share / number
        noise = np.flatnonzero(corrected <= max(errors / math.sqrt(size), least, _ROUNDING))
        correlated = corrected[: noise[0] if len(noise) else None].sum()
        before, number = number, float(np.clip(size / (1.0 + 2.0 * correlated), 1.0, size))
        if number >= before * (1 - 1e-6):
            break
    return number


def _lagged(deviation: NDArray[np.float64], lengths: NDArray[np.int64]) -> tuple[NDArray[np.float64], Any]:
    """Return for each lag from 1 on the sum of the products of pairs in the same run, and the number of these pairs."""
    products, pairs = np.zeros((2, max(int(lengths.max()) - 1, 1)))
    first = np.cumsum(lengths) - lengths
    for length in np.unique(lengths[lengths > 1]).tolist():
        # All runs of a length at once. Padded with zeros to twice the length, their ends do not meet.
        runs = deviation[first[lengths == length, np.newaxis] + np.arange(length)]
        spectrum = np.fft.rfft(runs, 2 * length, axis=1)
        power = np.fft.irfft(spectrum.real**2 + spectrum.imag**2, 2 * length, axis=1).sum(axis=0)
        products[: length - 1] += power[1:length]
        pairs[: length - 1] += len(runs) * np.arange(length - 1, 0, -1)
    return products, pairs
