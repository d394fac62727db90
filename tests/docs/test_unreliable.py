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
    assert sweep_table(POINTS, sweep, Plan()) in PAGE


def test_the_settings_are_the_defaults_of_the_command() -> None:
    assert POINTS.attrs["unreliable"] == Plan().conditions()


def _gains(sweep: str, value: float) -> pd.Series:
    of = POINTS[(POINTS["policy"] == "a-cmommt") & (POINTS["sweep"] == sweep)]
    return of[of["value"] == value].reset_index(drop=True)["gain"]


def test_what_the_page_says_is_in_the_file() -> None:
    lost = _gains("failures", 1.0) - _gains("failures", 0.9)
    assert (round(lost.min()), round(lost.max())) == (9, 13)
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


def _of_teams(sweep: str) -> list[pd.DataFrame]:
    found = POINTS[POINTS["sweep"] == sweep].groupby(["policy", "robots", "radius"])
    return [rows.reset_index(drop=True) for _, rows in found]


def test_what_the_page_says_about_the_delta_to_use() -> None:
    # The page says between which bounds delta_safe changes, and that no increase is resolved.
    changed = {
        sweep: [rows["delta_safe"] - rows["delta_safe"][0] for rows in _of_teams(sweep)]
        for sweep in ("failures", "periods")
    }
    ends = {sweep: (min(map(min, of)), max(map(max, of))) for sweep, of in changed.items()}
    assert ends == {"failures": (-2, 0), "periods": (-1, 1)}
    for sweep in SWEEPS:
        assert all((rows["delta_low"] <= rows["delta_safe"][0]).all() for rows in _of_teams(sweep))


def test_what_the_page_says_about_the_loss_of_gain() -> None:
    shares = []
    for rows in _of_teams("failures"):
        lost, aware = rows["gain"][0] - rows["gain"], rows["aware"][0] - rows["aware"]
        share, helped = lost / rows["gain"][0], (1 - aware / lost)[1:]
        assert 0.19 <= share[1] <= 0.32
        assert 3 <= aware[1] <= 7
        assert (share[rows["value"] <= 0.6] > 0.5).all()
        assert helped.is_monotonic_decreasing
        harmed = (rows["unaware"] < rows["unaware"][0])[rows["value"] <= 0.6]
        assert harmed.all() if (rows["robots"][0], rows["radius"][0]) == (10, 5) else not harmed.any()
        shares.append((rows["radius"][0] == 3 or rows["robots"][0] == 20, helped[1]))
    assert all(0.65 < helped < 0.75 if crowded else 0.3 < helped < 0.4 for crowded, helped in shares)


def test_what_the_page_says_about_sensing_rarely() -> None:
    for rows in _of_teams("periods"):
        last = rows["gain"].iloc[-1]
        if rows["policy"][0] == "a-cmommt":
            assert -3.05 < last < -1.25
            assert rows["gain"][rows["value"] <= 2].min() > 0.9 * rows["gain"][0]
        else:
            assert 0.35 < last < 1.25
        # docs/time.md says the same.
        assert (rows["gain"][rows["value"] >= 10] < 0.5 * rows["gain"][0]).all()
