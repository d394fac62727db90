"""Statistics of cells are those of pandas and SciPy."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from teamsight.analysis.studies.summary import summarise

pytestmark = pytest.mark.short

RUNS = st.lists(
    st.tuples(st.integers(0, 4), st.floats(-1e6, 1e6) | st.just(float("nan"))), max_size=40
)  # fmt: skip


def summary_of(runs: list[tuple[int, float]], cells: int = 5) -> pd.DataFrame:
    cell = np.array([one for one, _ in runs], np.int64)
    return summarise(np.array([value for _, value in runs], float), cell, cells)


@given(runs=RUNS)
def test_the_statistics_of_each_cell_are_those_of_pandas(runs: list[tuple[int, float]]) -> None:
    found = summary_of(runs)
    assert tuple(found.columns) == ("n", "mean", "low", "high", "maximum")
    grouped = (
        pd.DataFrame(runs, columns=["cell", "value"]).astype({"cell": int, "value": float}).groupby("cell")["value"]
    )
    wanted = grouped.agg(["count", "mean", "max"]).reindex(range(5))
    assert found["n"].tolist() == wanted["count"].fillna(0).tolist()
    assert found["mean"].to_numpy() == pytest.approx(wanted["mean"].to_numpy(), rel=1e-12, abs=1e-9, nan_ok=True)
    # A maximum is one of the values, not nearly one.
    assert np.array_equal(found["maximum"], wanted["max"], equal_nan=True)


@given(runs=RUNS)
def test_the_interval_is_that_of_students_distribution(runs: list[tuple[int, float]]) -> None:
    found = summary_of(runs)
    for cell, row in found.iterrows():
        values = np.array([value for one, value in runs if one == cell and not np.isnan(value)])
        if len(values) > 1:
            scale = stats.sem(values)
            wide = stats.t.ppf(0.975, len(values) - 1) * scale
            # Squares of rounding errors of the mean.
            wanted = pytest.approx([values.mean() - wide, values.mean() + wide], rel=1e-9, abs=1e-8)
            assert [row["low"], row["high"]] == wanted
        elif len(values) == 1:
            assert [row["low"], row["high"]] == [-np.inf, np.inf]
        else:
            assert np.isnan([row["mean"], row["low"], row["high"], row["maximum"]]).all()


def test_a_small_spread_around_a_large_mean_keeps_its_interval() -> None:
    values = 1e9 + np.array([0.0, 1.0, 2.0])
    row = summarise(values, np.zeros(3, np.int64), 1).iloc[0]
    assert row["high"] - row["low"] == pytest.approx(2 * stats.t.ppf(0.975, 2) / np.sqrt(3), rel=1e-6)


def test_equal_values_have_an_interval_without_width() -> None:
    row = summarise(np.full(7, 0.1), np.zeros(7, np.int64), 1).iloc[0]
    assert row["high"] - row["low"] < 1e-15


@given(st.lists(st.tuples(st.integers(0, 3), st.booleans()), max_size=60))
def test_the_interval_of_a_rate_is_wilsons(runs: list[tuple[int, bool]]) -> None:
    cell = np.array([one for one, _ in runs], np.int64)
    found = summarise(np.array([value for _, value in runs], float), cell, 4, are_flags=True)
    for number, row in found.iterrows():
        values = [value for one, value in runs if one == number]
        if not values:
            assert np.isnan([row["low"], row["high"]]).all()
            continue
        wanted = stats.binomtest(sum(values), len(values)).proportion_ci(0.95, "wilson")
        assert [row["low"], row["high"]] == pytest.approx([wanted.low, wanted.high], abs=1e-12)
        assert 0 <= row["low"] <= row["mean"] <= row["high"] <= 1
