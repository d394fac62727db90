"""Durations: their distributions, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from teamsight.agents.components import Batteries, Failures
from teamsight.agents.components.durations import Constant, Exponential, Times, Weibull, lasting, time_to

# In (0, 1), from the smallest that the noise has to the largest.
UNIFORMS = np.concatenate([[2.0**-33], np.linspace(0.001, 0.999, 999), [1 - 2.0**-33]])


@pytest.mark.parametrize(
    ("duration", "distribution"),
    [
        (Exponential(500), stats.expon(scale=500)),
        (Weibull(40, 1.5), stats.weibull_min(1.5, scale=40)),
        (Weibull(40, 0.5), stats.weibull_min(0.5, scale=40)),
    ],
    ids=["exponential", "wearing", "early"],
)
def test_durations_are_drawn_by_inversion(duration: Exponential | Weibull, distribution: object) -> None:
    drawn = [duration.draw(u) for u in UNIFORMS]
    # The larger the number, the sooner.
    np.testing.assert_allclose(drawn, distribution.isf(UNIFORMS), rtol=1e-6)  # type: ignore[attr-defined]
    assert duration.mean == pytest.approx(distribution.mean())  # type: ignore[attr-defined]
    assert all(map(math.isfinite, drawn))
    assert min(drawn) > 0


def test_a_weibull_duration_of_shape_1_is_exponential() -> None:
    assert [Weibull(7, 1).draw(u) for u in UNIFORMS] == [Exponential(7).draw(u) for u in UNIFORMS]


def test_constant_durations_are_equal() -> None:
    assert {Constant(3).draw(u) for u in UNIFORMS} == {3.0} == {Constant(3).mean}


def test_listed_times_are_those_of_the_list() -> None:
    times = Times([100, 250])
    assert [times.after(now, 5) for now in (-1, 99.5, 100, 250)] == [100, 100, 250, math.inf]
    assert [times.lasting(index, 5) for index in range(3)] == [100, 250, math.inf]
    some = Times({2: [7.5]})
    assert [some.after(-1, member) for member in (0, 2)] == [math.inf, 7.5]


def test_a_number_is_an_exponential_mean() -> None:
    assert time_to("time_to_failure", np.float32(8)) == lasting("time_to_repair", 8) == Exponential(8)
    assert time_to("time_to_failure", Weibull(8, 2)) == Weibull(8, 2)


def test_values_that_compare_equal_are_equal_durations() -> None:
    assert Exponential(5) == Exponential(5.0)
    assert Times(np.array([1, 2])) == Times((1.0, 2.0))
    assert repr(Weibull(40, 1.5)) == "Weibull(scale=40.0, shape=1.5)"


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: Times([3, -1]), ValueError, ("times[1]=-1.0", "at least 0")),
        (lambda: Times(3), TypeError, ("times=3", "Times([100, 250])")),  # type: ignore[arg-type]
        (lambda: Times({-1: [3]}), ValueError, ("member=-1", "at least 0")),
        (lambda: time_to("time_to_failure", [3, 4]), TypeError, ("time_to_failure=[3, 4]", "Times([100, 250])")),
        (lambda: time_to("time_to_failure", Weibull), TypeError, ("Weibull", "Weibull(500, 1.5)")),
        (lambda: time_to("time_to_failure", -5), ValueError, ("time_to_failure=-5.0", "at least")),
        (lambda: time_to("time_to_failure", Times([4, 4])), ValueError, ("4 and 4 must ascend", "sort")),
        (lambda: lasting("time_to_repair", Times([0])), ValueError, ("time_to_repair=0.0", "at least")),
        (lambda: lasting("time_to_repair", "long"), TypeError, ("time_to_repair='long'", "Constant(50)")),
    ],
)
def test_a_wrong_duration_is_refused(make: object, error: type[Exception], words: tuple[str, ...]) -> None:
    with pytest.raises(error) as caught:
        make()  # type: ignore[operator]
    assert all(word in str(caught.value) for word in words)


@pytest.mark.short
def test_errors_of_times_say_what_to_do_instead() -> None:
    for call in (lambda: Failures(math.inf), lambda: Failures(-1), lambda: Failures(None), lambda: Failures(5, math.inf)):  # type: ignore[arg-type]
        with pytest.raises((TypeError, ValueError), match=r"; .*leave the component.* out for never"):
            call()
    with pytest.raises(ValueError, match=r"times\[0\]=-1\.0: .*; .*leave out what never happens"):
        Times([-1])
    with pytest.raises(ValueError, match=r"capacity=0\.0: .*; leave Batteries out"):
        Batteries(0)
