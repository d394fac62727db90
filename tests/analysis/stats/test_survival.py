"""The Kaplan–Meier estimate, compared with statsmodels and with durations whose law is known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.duration.survfunc import SurvfuncRight

from teamsight.analysis.stats.survival import kaplan_meier, median


@settings(deadline=None)
@given(rows=st.lists(st.tuples(st.integers(1, 6), st.booleans()), min_size=1, max_size=25))
def test_survival_is_that_of_statsmodels(rows: list[tuple[int, bool]]) -> None:
    duration, censored = np.array(rows, dtype=float).T
    found = kaplan_meier(duration, censored > 0)
    if not (censored == 0).any():
        assert found.empty
        return
    wanted = SurvfuncRight(duration, 1 - censored)
    assert found["duration"].tolist() == wanted.surv_times.tolist()
    assert found["survival"].to_numpy() == pytest.approx(wanted.surv_prob, abs=1e-12)
    inside = found["survival"].between(1e-9, 1 - 1e-9)
    assert (found["low"] <= found["survival"]).all()
    assert (found["high"][inside] >= found["survival"][inside]).all()


def test_censoring_does_not_shorten_the_estimate() -> None:
    """Exponential durations with mean 10, censored at random: S(10) = 1/e, within 6.5 standard errors of Greenwood."""
    rng = np.random.default_rng(1)
    true, end = rng.exponential(10.0, 20_000), rng.uniform(0.0, 20.0, 20_000)
    found = kaplan_meier(np.minimum(true, end), true > end)
    row = found[found["duration"] <= 10.0].iloc[-1]
    spread = (row["high"] - row["low"]) / 2 / 1.96
    assert abs(row["survival"] - np.exp(-1)) < 6.5 * spread
    assert median(found) == pytest.approx(10 * np.log(2), rel=0.08)


def test_all_gone_and_none_gone() -> None:
    gone = kaplan_meier([1.0, 2.0], [False, False])
    assert gone[["survival", "low", "high"]].iloc[-1].tolist() == [0.0, 0.0, 0.0]
    assert np.isnan(median(kaplan_meier([1.0, 2.0], [True, True])))
    with pytest.raises(ValueError, match="finite and at least 0"):
        kaplan_meier([-1.0], [False])
