"""Locally weighted linear regression of a response on one variable: the slope at each of several points."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from teamsight.core.kernel import Entry, Record
from teamsight.policies.interface import Floats

# The largest leverage with which a residual is enlarged; a reading that fits itself would have an infinite error.
_MOST_LEVERAGE = 0.95
# Sums of squares up to this are those of equal numbers.
_NOTHING = 1e-12


class Regression(NamedTuple):
    """The record of a regression.

    Attributes
    ----------
    place, x, y : ndarray, shape (n,), float64
        Where the observations are, the variable and the response.
    control : float
        1 if the part of x that is linear in the place is taken out, so that the slope is that at a given place; else 0.
    point : ndarray, shape (points,), float64
        Places at which the slope is wanted.
    bandwidth : float
        An observation at distance u from a point has the weight max(0, 1 − (u / bandwidth)²).
    ridge : float
        Added to the weighted sum of squares of x; it draws slopes towards 0.
    slope, error : ndarray, shape (points,), float64
        Written: the slopes and their standard errors.
    """

    place: Annotated[Floats, "n"]
    x: Annotated[Floats, "n"]
    y: Annotated[Floats, "n"]
    control: float
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
        mean_u = 0.0
        mean_x = 0.0
        mean_y = 0.0
        for i in range(n):
            u = (fit.place[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            weights += weight
            mean_u += weight * u
            mean_x += weight * fit.x[i]
            mean_y += weight * fit.y[i]
        if weights == 0.0:
            continue
        mean_u /= weights
        mean_x /= weights
        mean_y /= weights
        square_u, product_x, product_y = 0.0, 0.0, 0.0
        for i in range(n):
            u = (fit.place[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            square_u += weight * (u - mean_u) ** 2
            product_x += weight * (u - mean_u) * (fit.x[i] - mean_x)
            product_y += weight * (u - mean_u) * (fit.y[i] - mean_y)
        known = fit.control > 0.0 and square_u > _NOTHING
        along_x = product_x / square_u if known else 0.0
        along_y = product_y / square_u if known else 0.0
        square = 0.0
        product = 0.0
        for i in range(n):
            u = (fit.place[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            x = fit.x[i] - mean_x - along_x * (u - mean_u)
            square += weight * x * x
            product += weight * x * (fit.y[i] - mean_y)
        if square <= _NOTHING:
            continue
        fit.slope[p] = product / (square + fit.ridge)
        variance = 0.0
        for i in range(n):
            u = (fit.place[i] - point) / fit.bandwidth
            weight = max(0.0, 1.0 - u * u)
            x = fit.x[i] - mean_x - along_x * (u - mean_u)
            leverage = weight / weights + weight * x * x / square
            if known:
                leverage += weight * (u - mean_u) ** 2 / square_u
            residual = fit.y[i] - mean_y - along_y * (u - mean_u) - product / square * x
            variance += (weight * x * residual / (1.0 - min(leverage, _MOST_LEVERAGE))) ** 2
        fit.error[p] = variance**0.5 / (square + fit.ridge)
    return 0


_REGRESS = Entry(_regress)


class Slopes(NamedTuple):
    """Slopes and their standard errors at some points, each of shape (points,), float64."""

    slope: Floats
    error: Floats


def local_slopes(
    x: Floats, y: Floats, point: Floats, bandwidth: float, ridge: float, *, given: Floats | None = None
) -> Slopes:
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
        Added to the weighted sum of squares of x; it draws slopes towards 0.
    given : ndarray, shape (n,), float64, optional
        A second variable, in whose place the points and the weights are then, and whose own linear effect is taken out:
        the slope is that of x at a given value of it.

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
    place, control = (x, 0.0) if given is None else (given, 1.0)
    _REGRESS(REGRESSION.pack(Regression(place, x, y, control, point, bandwidth, ridge, *found)))
    return found


def significant(slopes: Slopes, errors: float) -> Floats:
    """Return slopes drawn towards 0: those within `errors` standard errors of 0 become 0, larger ones are kept.

    Each is multiplied by max(0, 1 − (errors · standard error / slope)²).
    """
    slope, error = slopes
    known = slope != 0.0
    ratio = np.divide(errors * error, slope, out=np.zeros(len(slope)), where=known)
    return np.asarray(slope * np.maximum(1.0 - ratio * ratio, 0.0))
