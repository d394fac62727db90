"""The values of an axis: lists and ranges, exact in decimal numbers."""

from __future__ import annotations

import math
from decimal import Decimal
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from teamsight.analysis.studies.definition.settings import axis_values


@pytest.mark.short
@pytest.mark.parametrize(
    ("given", "values"),
    [
        ([1, 2.5, "a", True], (1, 2.5, "a", True)),
        (range(3), (0, 1, 2)),
        (np.array([1.5, 2.0]), (1.5, 2.0)),
        ({"from": 0.1, "to": 0.5, "step": 0.1}, (0.1, 0.2, 0.3, 0.4, 0.5)),
        ({"from": 0, "to": 1, "step": 0.3}, (0.0, 0.3, 0.6, 0.9)),
        ({"from": 5, "to": 15, "step": 5}, (5, 10, 15)),
        ({"from": 1, "to": 2, "count": 5}, (1.0, 1.25, 1.5, 1.75, 2.0)),
        ({"from": 1, "to": 9, "count": 5}, (1, 3, 5, 7, 9)),
        ({"from": 0.1, "to": 0.7, "count": 7}, (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)),
        ({"from": 0.001, "to": 10, "count": 5, "scale": "log"}, (0.001, 0.01, 0.1, 1.0, 10.0)),
        ({"from": 1, "to": 16, "count": 5, "scale": "log"}, (1, 2, 4, 8, 16)),
        ({"from": 1, "to": 2, "count": 2, "scale": "linear"}, (1, 2)),
    ],
)  # fmt: skip
def test_values(given: Any, values: tuple[Any, ...]) -> None:
    found = axis_values("x", given)
    assert found == values
    assert [type(one) for one in found] == [type(one) for one in values]


@given(st.decimals(-1000, 1000, places=3), st.decimals("0.001", 10, places=3), st.integers(1, 50))
def test_steps_are_those_of_decimal_numbers(first: Decimal, step: Decimal, more: int) -> None:
    last = first + more * step
    found = axis_values("x", {"from": float(first), "to": float(last), "step": float(step)})
    assert found == tuple(float(first + i * step) for i in range(more + 1))


@given(st.floats(1e-6, 1e6), st.floats(1.01, 1e6), st.integers(2, 40))
def test_ratios_of_a_log_scale_are_equal(first: float, factor: float, count: int) -> None:
    last = first * factor
    found = axis_values("x", {"from": first, "to": last, "count": count, "scale": "log"})
    assert (found[0], found[-1], len(found)) == (first, last, count)
    ratios = np.diff(np.log(np.array(found, float)))
    assert ratios == pytest.approx(math.log(factor) / (count - 1), rel=1e-6)


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9), st.integers(2, 200))
def test_ends_belong_to_a_range(first: float, last: float, count: int) -> None:
    assume(last - first > 1e-3)
    found = np.array(axis_values("x", {"from": first, "to": last, "count": count}), float)
    assert (found[0], found[-1]) == (first, last)
    assert np.diff(found) == pytest.approx((last - first) / (count - 1), rel=1e-3)


@pytest.mark.short
@pytest.mark.parametrize(
    ("given", "kind", "words"),
    [
        ([], ValueError, ["axes.x=[]", "at least one"]),
        (5, TypeError, ["axes.x=5", "a list of values", "fixed"]),
        ("ab", TypeError, ["axes.x='ab'", "a list of values"]),
        (np.float64(2), TypeError, ["a list of values"]),
        ([1.0, math.nan], ValueError, ["axes.x[1]=nan", "finite"]),
        ([2**70], ValueError, ["axes.x[0]=1180591620717411303424", "2^63"]),
        ([10**5000], ValueError, ["about 10^", "2^63"]),
        (range(10**12), ValueError, ["1,000,000,000,000 values", "10,000,000"]),
        ({"form": 1}, ValueError, ["'form'", "did you mean 'from'"]),
        ({"from": 1, "step": 1}, ValueError, ["'to'"]),
        ({"from": 1, "to": 2}, ValueError, ["step or count"]),
        ({"from": 1, "to": 2, "step": 1, "count": 2}, ValueError, ["step or count"]),
        ({"from": 2, "to": 2, "step": 1}, ValueError, ["from=2", "less than to=2"]),
        ({"from": 0, "to": 1e12, "step": 1}, ValueError, ["1,000,000,000,001 values", "10,000,000", "larger step"]),
        ({"from": 0, "to": 1e300, "step": 1e-300}, ValueError, ["about 10^600 values"]),
        ({"from": 0, "to": 1, "step": 0}, ValueError, ["axes.x.step=0", "above 0"]),
        ({"from": 0, "to": 1, "step": math.inf}, ValueError, ["axes.x.step=inf", "finite"]),
        ({"from": 0, "to": math.nan, "step": 1}, ValueError, ["axes.x.to=nan", "finite"]),
        ({"from": "a", "to": 2, "step": 1}, TypeError, ["axes.x.from='a'", "number"]),
        ({"from": True, "to": 2, "step": 1}, TypeError, ["axes.x.from=True", "number"]),
        ({"from": 1, "to": 2, "count": 1}, ValueError, ["axes.x.count=1", "at least 2", "list"]),
        ({"from": 1, "to": 2, "count": 10**8}, ValueError, ["axes.x.count=100000000", "at most 10000000"]),
        ({"from": 1, "to": 2, "count": 2.5}, TypeError, ["axes.x.count=2.5", "whole"]),
        ({"from": 0, "to": 2, "count": 3, "scale": "log"}, ValueError, ["from=0", "greater than 0", "linear"]),
        ({"from": 1, "to": 2, "step": 1, "scale": "log"}, ValueError, ["axes.x.step=1", "count"]),
        ({"from": 1, "to": 2, "count": 3, "scale": "logarithm"}, ValueError, ["'logarithm'", "did you mean 'log'"]),
        ({"from": 1.0, "to": 1.0000000000000002, "count": 9}, ValueError, ["9 values", "too near"]),
    ],
)  # fmt: skip
def test_errors_name_value_limit_and_cure(given: Any, kind: type[Exception], words: list[str]) -> None:
    with pytest.raises(kind) as error:
        axis_values("x", given)
    assert type(error.value) is kind
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)
