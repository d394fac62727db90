"""Locally weighted linear regression of a response on one variable: the slope at each of several points."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from teamsight.core.kernel import Entry, Record
from teamsight.policies.interface import Floats

# The largest leverage with which a residual is enlarged; a reading that fits itself would have an infinite error.
_MOST_LEVERAGE = 0.95


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


def _regress(address: int) -> int:
    fit = regression_at(address)
    n = fit.x.shape[0]
    for p in range(fit.point.shape[0]):
        point = fit.point[p]
        fit.slope[p] = 0.0
        fit.error[p] = 0.0
        weights = 0.0
        mean_x = 0.0
        mean_y = 0.0
        for i in range(n):
            u = (fit.x[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            weights += weight
            mean_x += weight * (fit.x[i] - point)
            mean_y += weight * fit.y[i]
        if weights == 0.0:
            continue
        mean_x = point + mean_x / weights
        mean_y /= weights
        square = 0.0
        product = 0.0
        for i in range(n):
            u = (fit.x[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            square += weight * (fit.x[i] - mean_x) ** 2
            product += weight * (fit.x[i] - mean_x) * (fit.y[i] - mean_y)
        if square <= 1e-12 * fit.bandwidth * fit.bandwidth:
            continue
        spread = square + fit.ridge * fit.bandwidth * fit.bandwidth
        fit.slope[p] = product / spread
        variance = 0.0
        for i in range(n):
            u = (fit.x[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            x = fit.x[i] - mean_x
            leverage = min(weight / weights + weight * x * x / square, _MOST_LEVERAGE)
            residual = (fit.y[i] - mean_y - product / square * x) / (1.0 - leverage)
            variance += (weight * x * residual) ** 2
        fit.error[p] = variance**0.5 / spread
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
        Slope 0 and error 0 where fewer than two different x have a weight. Errors allow for residuals of unequal
        variance: each is divided by 1 minus its leverage (HC3).

    Notes
    -----
    *Source:* C. G. Atkeson, A. W. Moore and S. Schaal, "Locally weighted learning" (1997).
    """
    found = Slopes(np.zeros(len(point)), np.zeros(len(point)))
    _REGRESS(REGRESSION.pack(Regression(x, y, point, bandwidth, ridge, *found)))
    return found


def significant(slopes: Slopes, errors: float) -> Floats:
    """Return slopes drawn towards 0: those within `errors` standard errors of 0 become 0, larger ones are kept.

    Each is multiplied by max(0, 1 − (errors · standard error / slope)²).
    """
    slope, error = slopes
    known = slope != 0.0
    ratio = np.divide(errors * error, slope, out=np.zeros(len(slope)), where=known)
    return np.asarray(slope * np.maximum(1.0 - ratio * ratio, 0.0))
