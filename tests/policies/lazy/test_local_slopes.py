"""Locally weighted regression: against statsmodels, where the slope is known, and where there is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import statsmodels.api as sm
from hypothesis import given
from hypothesis import strategies as st

from teamsight.policies.lazy.lazy_regression import Slopes, local_slopes, significant

pytestmark = pytest.mark.short

POINTS = np.linspace(0, 1, 5)


def numbers(seed: int, n: int) -> tuple[Any, Any, Any]:
    """A second variable, one that depends on it, and a response whose spread differs from place to place."""
    rng = np.random.default_rng(seed)
    given = rng.random(n)
    x = given + 0.2 * rng.standard_normal(n)
    return given, x, np.sin(3 * x) - given + x * rng.standard_normal(n)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(8, 60), bandwidth=st.floats(0.4, 2), control=st.booleans())
def test_as_weighted_least_squares_of_statsmodels(seed: int, n: int, bandwidth: float, control: bool) -> None:
    place, x, y = numbers(seed, n)
    given = place if control else None
    found = local_slopes(x, y, POINTS, bandwidth, 0.0, given=given)
    for point, slope, error in zip(POINTS, *found, strict=True):
        weight = np.maximum(0, 1 - (((place if control else x) - point) / bandwidth) ** 2)
        near = weight > 0
        if near.sum() < 6:
            continue
        columns = [np.ones(n), x, place] if control else [np.ones(n), x]
        design = np.stack(columns, axis=1)[near]
        reference = sm.WLS(y[near], design, weight[near]).fit(cov_type="HC3")
        assert slope == pytest.approx(reference.params[1], rel=1e-6, abs=1e-9)
        assert error == pytest.approx(reference.bse[1], rel=1e-6, abs=1e-9)


def test_a_ridge_shrinks_slope_and_error_alike() -> None:
    _, x, y = numbers(1, 40)
    plain, shrunk = (local_slopes(x, y, POINTS, 0.5, ridge) for ridge in (0.0, 0.7))
    for k, point in enumerate(POINTS):
        weight = np.maximum(0, 1 - ((x - point) / 0.5) ** 2)
        square = np.sum(weight * (x - np.average(x, weights=weight)) ** 2)
        for one, other in zip(plain, shrunk, strict=True):
            assert other[k] == pytest.approx(one[k] * square / (square + 0.7))


def test_a_straight_line_has_one_slope_everywhere_and_no_error() -> None:
    x = np.linspace(0, 1, 30)
    found = local_slopes(x, 5.0 - 3.0 * x, POINTS, 0.3, 0.0)
    assert found.slope == pytest.approx(np.full(5, -3.0))
    assert found.error == pytest.approx(np.zeros(5), abs=1e-9)


def test_a_slope_at_a_given_value_is_not_that_of_what_goes_with_it() -> None:
    # The response falls with x, but rises so steeply with the other variable that it rises where both rise together.
    rng = np.random.default_rng(3)
    other = rng.random(400)
    x = other + 0.1 * rng.standard_normal(400)
    y = 3 * other - x
    assert (local_slopes(x, y, POINTS, 0.8, 0.0).slope > 0.5).all()
    assert local_slopes(x, y, POINTS, 0.8, 0.0, given=other).slope == pytest.approx(np.full(5, -1.0))


@pytest.mark.parametrize(
    ("x", "y"),
    [([], []), ([0.5], [1.0]), ([0.5, 0.5, 0.5], [0.0, 1.0, 2.0]), ([9.0, 9.5], [0.0, 1.0])],
    ids=["nothing", "one", "all at one place", "far from every point"],
)
@pytest.mark.parametrize("control", [False, True])
def test_no_slope_is_zero_and_of_unknown_error(x: list[float], y: list[float], control: bool) -> None:
    x, y = np.array(x), np.array(y)
    found = local_slopes(x, y, POINTS, 0.5, 0.0, given=x.copy() if control else None)
    assert found.slope.tolist() == [0] * 5
    assert np.isinf(found.error).all()


def test_the_error_of_two_observations_is_unknown() -> None:
    found = local_slopes(np.array([0.2, 0.6]), np.array([0.0, 1.0]), POINTS, 2.0, 0.0)
    assert found.slope == pytest.approx(np.full(5, 2.5))
    assert np.isinf(found.error).all()
    assert significant(found, 3.0).tolist() == [0] * 5
    assert significant(found, 0.0) == pytest.approx(np.full(5, 2.5))


@given(value=st.floats(-1e6, 1e6), seed=st.integers(0, 2**32 - 1))
def test_equal_responses_have_the_slope_zero_exactly(value: float, seed: int) -> None:
    place, x, _ = numbers(seed, 30)
    for other in (None, place):
        assert not local_slopes(x, np.full(30, value), POINTS, 0.7, 0.0, given=other).slope.any()


def test_slopes_within_their_error_of_zero_become_zero() -> None:
    slopes = Slopes(np.array([2.0, -2.0, 1.0, 0.0, 5.0]), np.array([0.5, 0.5, 0.5, 0.5, np.inf]))
    assert significant(slopes, 2.0).tolist() == [2 * 0.75, -2 * 0.75, 0.0, 0.0, 0.0]
