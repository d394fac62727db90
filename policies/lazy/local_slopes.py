"""Locally weighted linear regression of a response on one variable: the slope at each of several points."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np

from teamsight.core.kernel import Entry, Record, inlined
from teamsight.policies.interface import Floats

# An observation of a larger leverage determines its own fit, so that its residual says nothing about the error.
_MOST_LEVERAGE = 1.0 - 1e-9
# Smaller sums of squares are rounding: all numbers are equal.
_LEAST_SPREAD = 1e-12


class Regression(NamedTuple):
    """The record of a regression.

    Attributes
    ----------
    place, x, y : ndarray, shape (n,), float64
        Where the observations are, the variable and the response.
    control : int
        1 if the slope is that of x at a given place, so that the effect of the place itself is taken out; else 0.
    point : ndarray, shape (points,), float64
        Places at which the slope is wanted.
    bandwidth, ridge : float
        See `local_slopes`.
    slope, error : ndarray, shape (points,), float64
        Written: the slopes and their standard errors.
    """

    place: Annotated[Floats, "n"]
    x: Annotated[Floats, "n"]
    y: Annotated[Floats, "n"]
    control: int
    point: Annotated[Floats, "points"]
    bandwidth: float
    ridge: float
    slope: Annotated[Floats, "points"]
    error: Annotated[Floats, "points"]


REGRESSION = Record(Regression)
regression_at = REGRESSION.at


class _Fit(NamedTuple):
    """What centres the observations around a point: means, and the slopes of x and y along the place."""

    weights: float
    place: float
    x: float
    y: float
    square: float  # the weighted sum of squares of the place, 0 without control
    along_x: float
    along_y: float


@inlined
def _centred(record: Any, i: int, point: float, fit: Any) -> tuple[Any, Any, Any, Any]:
    """Return weight, place, x and y of an observation, centred, and x without what follows from its place."""
    apart = record.place[i] - point
    u = apart / record.bandwidth
    place = apart - fit.place
    return max(0.0, 1.0 - u * u), place, record.x[i] - fit.x - fit.along_x * place, record.y[i] - record.y[0] - fit.y


@inlined
def _fit_at(record: Any, point: float) -> Any:
    """Return the `_Fit` at a point, with 0 weights if no observation is near."""
    fit = _Fit(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    weights, mean_place, mean_x, mean_y = 0.0, 0.0, 0.0, 0.0
    for i in range(record.x.shape[0]):
        # The response is relative to the first, so that equal responses have the slope 0 exactly.
        weight, place, x, y = _centred(record, i, point, fit)
        weights += weight
        mean_place += weight * place
        mean_x += weight * x
        mean_y += weight * y
    if weights == 0.0:
        return fit
    fit = _Fit(weights, mean_place / weights, mean_x / weights, mean_y / weights, 0.0, 0.0, 0.0)
    if record.control == 0:
        return fit
    square, product_x, product_y = 0.0, 0.0, 0.0
    for i in range(record.x.shape[0]):
        weight, place, x, y = _centred(record, i, point, fit)
        square += weight * place * place
        product_x += weight * place * x
        product_y += weight * place * y
    if square <= _LEAST_SPREAD:
        return fit
    return _Fit(weights, fit.place, fit.x, fit.y, square, product_x / square, product_y / square)


@inlined
def _error(record: Any, point: float, fit: Any, square: float, slope: float) -> float:
    """Return the standard error of a slope whose variable has this weighted sum of squares."""
    variance = 0.0
    for i in range(record.x.shape[0]):
        weight, place, x, y = _centred(record, i, point, fit)
        leverage = weight / fit.weights + weight * x * x / square
        if fit.square > 0.0:
            leverage += weight * place * place / fit.square
        if leverage > _MOST_LEVERAGE:
            return math.inf
        residual = (y - fit.along_y * place - slope * x) / (1.0 - leverage)
        variance += (weight * x * residual) ** 2
    return math.sqrt(variance) / square


def _regress(address: int) -> int:
    record = regression_at(address)
    for p in range(record.point.shape[0]):
        point = record.point[p]
        record.slope[p] = 0.0
        record.error[p] = math.inf
        fit = _fit_at(record, point)
        square = 0.0
        product = 0.0
        for i in range(record.x.shape[0]):
            weight, _, x, y = _centred(record, i, point, fit)
            square += weight * x * x
            product += weight * x * y
        if fit.weights > 0.0 and square > _LEAST_SPREAD:
            shrinkage = square / (square + record.ridge)
            record.slope[p] = product / square * shrinkage
            record.error[p] = _error(record, point, fit, square, product / square) * shrinkage
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
        Slope 0 where fewer than two different x have a weight. Errors allow for residuals of unequal variance: each is
        divided by 1 minus its leverage (HC3). They are infinite where a residual cannot be known, as for two x.

    Notes
    -----
    *Source:* C. G. Atkeson, A. W. Moore and S. Schaal, "Locally weighted learning" (1997); HC3: J. G. MacKinnon and
    H. White, "Some heteroskedasticity-consistent covariance matrix estimators" (1985).
    """
    found = Slopes(np.zeros(len(point)), np.zeros(len(point)))
    place, control = (x, 0) if given is None else (given, 1)
    _REGRESS(REGRESSION.pack(Regression(place, x, y, control, point, bandwidth, ridge, *found)))
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
