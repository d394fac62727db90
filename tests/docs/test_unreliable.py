"""The tables of the page on unreliable teams are those of its Parquet file, and its numbers are in them."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.unreliable.page import sweep_table
from teamsight.analysis.unreliable.plan import SWEEPS, Plan

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "unreliable.md").read_text(encoding="utf-8")
POINTS = pd.read_parquet(DOCS / "unreliable.parquet")


@pytest.mark.parametrize("sweep", SWEEPS)
def test_the_tables_are_those_of_the_file(sweep: str) -> None:
    assert sweep_table(POINTS, sweep) in PAGE


def test_the_settings_are_the_defaults_of_the_command() -> None:
    assert POINTS.attrs["unreliable"] == Plan().conditions()


def _gains(sweep: str, value: float) -> pd.Series:
    of = POINTS[(POINTS["policy"] == "a-cmommt") & (POINTS["sweep"] == sweep)]
    return of[of["value"] == value].reset_index(drop=True)["gain"]


def test_what_the_page_says_is_in_the_file() -> None:
    lost = _gains("failures", 1.0) - _gains("failures", 0.9)
    assert (round(lost.min()), round(lost.max())) == (10, 13)
    failing = POINTS[POINTS["sweep"] == "failures"]
    assert (failing["gain_low"] > 0).all()
    for _, rows in failing.groupby(["policy", "robots", "radius"]):
        assert rows["aware"].is_monotonic_decreasing
        assert 0 <= rows["delta"].iloc[0] - rows["delta"].iloc[-1] <= 2
        assert rows["neighbours"].iloc[-1] < 0.5 * rows["neighbours"].iloc[0]
    periods = POINTS[POINTS["sweep"] == "periods"]
    assert (periods["delta"].min(), periods["delta"].max()) == (3, 6)
    teams = periods.groupby(["policy", "robots", "radius"])
    common = teams["delta_low"].max() <= teams["delta_safe"].min()
    assert common[~common].index.tolist() == [("a-cmommt", 10, 5.0)]
