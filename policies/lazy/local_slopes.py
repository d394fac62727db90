"""Locally weighted linear regression of a response on one variable: the slope at each of several points."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from teamsight.core.kernel import Entry, Record, inlined
from teamsight.policies.interface import Floats

# An observation of a larger leverage determines its own fit, so that its residual says nothing about the error.
_MOST_LEVERAGE = 1.0 - 1e-9
# Sums of squares below this share of the squared bandwidth are rounding: all x are equal.
_LEAST_SPREAD = 1e-12


class Regression(NamedTuple):
    """The record of a regression.

    Attributes
    ----------
    x, y : ndarray, shape (n,), float64
        The variable and the response.
    point : ndarray, shape (points,), float64
        Where the slope is wanted.
    bandwidth : float
        An observation at distance u from a point has the weight max(0, 1 − (u / bandwidth)²).
    ridge : float
        Added to the weighted sum of squares of x, in units of the squared bandwidth; it draws slopes towards 0.
    slope, error : ndarray, shape (points,), float64
        Written: the slopes and their standard errors.
    """

    x: Annotated[Floats, "n"]
    y: Annotated[Floats, "n"]
    point: Annotated[Floats, "points"]
    bandwidth: float
    ridge: float
    slope: Annotated[Floats, "points"]
    error: Annotated[Floats, "points"]


REGRESSION = Record(Regression)
regression_at = REGRESSION.at


@inlined
def _weight(fit: Any, i: int, point: float) -> Any:
    u = (fit.x[i] - point) / fit.bandwidth
    return max(0.0, 1.0 - u * u)


@inlined
def _error(fit: Any, point: float, weights: float, mean_x: float, mean_y: float, square: float, slope: float) -> float:
    """Return the standard error of the slope of a weighted fit with these sums."""
    variance = 0.0
    for i in range(fit.x.shape[0]):
        weight = _weight(fit, i, point)
        x = fit.x[i] - mean_x
        leverage = weight / weights + weight * x * x / square
        if leverage > _MOST_LEVERAGE:
            return math.inf
        residual = (fit.y[i] - mean_y - slope * x) / (1.0 - leverage)
        variance += (weight * x * residual) ** 2
    return math.sqrt(variance) / square


def _regress(address: int) -> int:
    fit = regression_at(address)
    n = fit.x.shape[0]
    for p in range(fit.point.shape[0]):
        point = fit.point[p]
        fit.slope[p] = 0.0
        fit.error[p] = math.inf
        weights = 0.0
        mean_x = 0.0
        mean_y = 0.0
        for i in range(n):
            weight = _weight(fit, i, point)
            weights += weight
            mean_x += weight * (fit.x[i] - point)
            # Relative to the first, so that equal responses have the slope 0 exactly.
            mean_y += weight * (fit.y[i] - fit.y[0])
        if weights == 0.0:
            continue
        mean_x = point + mean_x / weights
        mean_y = fit.y[0] + mean_y / weights
        square = 0.0
        product = 0.0
        for i in range(n):
            weight = _weight(fit, i, point)
            square += weight * (fit.x[i] - mean_x) ** 2
            product += weight * (fit.x[i] - mean_x) * (fit.y[i] - mean_y)
        scale = fit.bandwidth * fit.bandwidth
        if square <= _LEAST_SPREAD * scale:
            continue
        shrinkage = square / (square + fit.ridge * scale)
        fit.slope[p] = product / square * shrinkage
        fit.error[p] = _error(fit, point, weights, mean_x, mean_y, square, product / square) * shrinkage
    return 0


_REGRESS = Entry(_regress)


class Slopes(NamedTuple):
    """Slopes and their standard errors at some points, each of shape (points,), float64."""

    slope: Floats
    error: Floats


def local_slopes(x: Floats, y: Floats, point: Floats, bandwidth: float, ridge: float) -> Slopes:
    """Return the slope of a locally weighted linear regression at each point.

    Parameters
    ----------
    x, y : ndarray, shape (n,), float64
        The variable and the response.
    point : ndarray, shape (points,), float64
        Where the slope is wanted.
    bandwidth : float
        An observation at distance u from a point has the weight max(0, 1 − (u / bandwidth)²).
    ridge : float
        Added to the weighted sum of squares of x, in units of the squared bandwidth; it draws slopes towards 0.

    Returns
    -------
    Slopes
        Slope 0 where fewer than two different x have a weight. Errors allow for residuals of unequal variance: each is
        divided by 1 minus its leverage (HC3). They are infinite where a residual cannot be known, as for two x.

    Notes
    -----
    *Source:* C. G. Atkeson, A. W. Moore and S. Schaal, "Locally weighted learning" (1997); HC3: J. G. MacKinnon and
    H. White (1985).
    """
    found = Slopes(np.zeros(len(point)), np.zeros(len(point)))
    _REGRESS(REGRESSION.pack(Regression(x, y, point, bandwidth, ridge, *found)))
    return found


def significant(slopes: Slopes, threshold: float) -> Floats:
    """Return slopes drawn towards 0: 0 for those within `threshold` standard errors of 0.

    Each is multiplied by max(0, 1 − (threshold · standard error / slope)²). For the threshold 0 nothing changes.

    Notes
    -----
    *Source:* L. Breiman, "Better subset regression using the nonnegative garrote" (1995).
    """
    slope, error = slopes
    if threshold == 0:
        return slope
    kept = np.abs(slope) > threshold * error
    ratio = np.divide(threshold * error, slope, out=np.ones(len(slope)), where=kept)
    return np.asarray(slope * (1.0 - ratio * ratio))
