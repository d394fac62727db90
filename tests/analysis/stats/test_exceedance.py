"""The statistics of δ, against scipy's own exact test and against simulation of what they promise."""

from __future__ import annotations

import math

import numpy as np
import pytest
from chance import generator
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from teamsight.analysis.stats import exceedance


@given(trials=st.integers(1, 2000), share=st.floats(0, 1), confidence=st.floats(0.6, 0.999))
def test_bounds_are_scipys_exact_interval(trials: int, share: float, confidence: float) -> None:
    count = round(share * trials)
    interval = stats.binomtest(count, trials).proportion_ci(2 * confidence - 1, method="exact")
    low, high = exceedance.bounds(count, trials, confidence)
    assert (float(low), float(high)) == pytest.approx((interval.low, interval.high), abs=1e-9)


@given(risk=st.floats(1e-5, 0.9), confidence=st.floats(0.5, 0.999))
def test_trials_needed_is_the_first_number_that_supports_the_risk(risk: float, confidence: float) -> None:
    needed = exceedance.trials_needed(risk, confidence)
    assert exceedance.bounds(0, needed, confidence)[1] <= risk * (1 + 1e-6)
    assert needed == 1 or exceedance.bounds(0, needed - 1, confidence)[1] > risk * (1 - 1e-6)


def test_trials_needed_for_one_percent() -> None:
    assert exceedance.trials_needed(0.01) == math.ceil(math.log(0.05) / math.log(0.99))


@given(maxima=st.lists(st.integers(0, 9), min_size=1, max_size=50), risk=st.floats(0.001, 0.5))
def test_curve_counts_and_delta_is_the_smallest_within_risk(maxima: list[int], risk: float) -> None:
    found = exceedance.curve(maxima, 10)
    assert found["exceeding"].tolist() == [sum(one > delta for one in maxima) for delta in range(10)]
    assert (found["low"] <= found["probability"]).all()
    assert (found["probability"] <= found["high"]).all()
    for column in ("probability", "low", "high"):
        assert (found[column].diff().dropna() <= 1e-12).all()
        delta = exceedance.smallest_delta(found, column, risk)
        assert found[column][delta] <= risk
        assert delta == 0 or found[column][delta - 1] > risk
    assert found["high"].iloc[-1] == 0.0


def test_the_confident_delta_is_too_small_no_more_often_than_it_says() -> None:
    rng = generator()
    risk, trials, truth = 0.05, 1000, stats.poisson(4.0)
    answers = np.array(
        [
            exceedance.smallest_delta(exceedance.curve(truth.rvs(200, random_state=rng), 60), "high", risk)
            for _ in range(trials)
        ]
    )
    failures = (truth.sf(answers) > risk).sum()
    # 5 % of 1000 are promised at most; 100 would be seven standard errors more.
    assert failures < 100


def test_fewer_independent_trials_widen_the_bounds() -> None:
    maxima = [3] * 90 + [5] * 10
    wide, narrow = (exceedance.curve(maxima, 10, independent=number) for number in (10.0, 100.0))
    inside = slice(3, 5)
    assert (wide["high"][inside] > narrow["high"][inside]).all()
    assert (wide["low"][inside] < narrow["low"][inside]).all()
    assert wide["probability"].tolist() == narrow["probability"].tolist()


def test_effective_number_of_independent_and_of_dependent_values() -> None:
    rng = generator()
    shocks = rng.normal(size=20_000)
    assert exceedance.effective_number(shocks) > 15_000
    walk = np.zeros(20_000)
    for step in range(1, len(walk)):
        walk[step] = 0.9 * walk[step - 1] + shocks[step]
    # In theory 20,000 (1 − 0.9) / (1 + 0.9) = 1053.
    assert 700 < exceedance.effective_number(walk) < 1500
    assert exceedance.effective_number(shocks, walk) == exceedance.effective_number(walk)


def test_constant_windows_are_one() -> None:
    assert exceedance.effective_number(np.full(50, 3.0), np.full(50, 0.1)) == 1.0
    assert exceedance.effective_number(np.full(50, 3.0), np.arange(50.0)) < 5


def test_bad_input_is_named() -> None:
    with pytest.raises(ValueError, match="maxima: empty"):
        exceedance.curve([], 3)
    with pytest.raises(ValueError, match="risk=0"):
        exceedance.trials_needed(0.0)


def naive_number(values: list[float], run: list[int]) -> float:
    """Sum all pairs of the same run lag by lag; correct for the mean until nothing changes."""
    size, mean = len(values), sum(values) / len(values)
    variance = sum((value - mean) ** 2 for value in values)
    number = float(size)
    for _ in range(100):
        total = 0.0
        for lag in range(1, size):
            pairs = [(i, i + lag) for i in range(size - lag) if run[i] == run[i + lag]]
            share = sum((values[i] - mean) * (values[j] - mean) for i, j in pairs) / variance
            share += len(pairs) / (size - lag) / number
            if share <= 1e-12:
                break
            total += share
        before, number = number, min(max(size / (1 + 2 * total), 1.0), size)
        if number >= before * (1 - 1e-6):
            break
    return number


@given(st.lists(st.integers(0, 6), min_size=2, max_size=30), st.lists(st.integers(1, 9), min_size=1, max_size=30))
def test_the_effective_number_is_that_of_its_slow_twin(numbers: list[int], lengths: list[int]) -> None:
    values = [number + 0.1 * place**0.5 for place, number in enumerate(numbers)]
    run = np.repeat(np.arange(len(lengths)), lengths)[: len(values)].tolist()
    run += [len(lengths)] * (len(values) - len(run))
    assert exceedance.effective_number(values, run=run) == pytest.approx(naive_number(values, run), rel=1e-4)
