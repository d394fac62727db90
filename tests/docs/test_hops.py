"""The page of hops has the tables of its runs, and its runs are those of today."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, Study
from teamsight.analysis.papers.hops import OBSERVE, ceiling_table, ceilings, points, tables
from teamsight.analysis.runs.seeds import root

ROOT = Path(__file__).resolve().parents[2]
FOUND, POSSIBLE = (pd.read_parquet(ROOT / "docs" / f"{name}.parquet") for name in ("hops", "ceilings"))


@pytest.fixture
def hops(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    yield __import__("hops")
    sys.modules.pop("hops")


def test_the_page_has_the_tables_of_the_runs() -> None:
    page, shown = (ROOT / "docs" / "hops.md").read_text(encoding="utf-8"), tables(FOUND)
    for name in ("gain", "δ"):
        assert shown[name] in page, f"{name}: python examples/hops.py 200 docs/hops.parquet"
    assert ceiling_table(FOUND, POSSIBLE) in page


def test_ceilings_are_those_of_the_same_cell() -> None:
    cell = POSSIBLE[(POSSIBLE["robots"] == 20) & (POSSIBLE["radius"] == 5)]
    mean = 100 * cell[cell["team"] == "sharing"]["observed_fraction"].mean()
    assert ceilings(POSSIBLE)["sharing"].mean == pytest.approx(mean)
    observed = FOUND[FOUND["reports"].isin(["0", "all"]) & (FOUND["team"] == "a-cmommt") & (FOUND["neighbours"] == 2)]
    none, every = observed["score"]
    assert f" {100 * (every - none) / (mean - none):.0f} % (" in ceiling_table(FOUND, POSSIBLE).splitlines()[2]


def test_a_row_is_what_its_runs_give(hops: Any, tmp_path: Path) -> None:
    study = Study.from_file(hops.FILE)
    assert study.as_dict()["seed"] == root("hops")
    one = {"team": ["consume"], "neighbours": [5], "reports": ["0", "1", "all, 30 % lost"]}
    found = points(Study.from_dict({**study.as_dict(), "axes": one}).run(tmp_path / "out").frame)
    kept = FOUND[(FOUND["team"] == "consume") & (FOUND["neighbours"] == 5) & FOUND["reports"].isin(one["reports"])]
    pd.testing.assert_frame_equal(found, kept.reset_index(drop=True), check_dtype=False)


def test_controls_gain_nothing() -> None:
    assert (FOUND[FOUND["team"].isin(["centroid", "forage, ignoring"])][["gain", "more"]] == 0).all(axis=None)


def test_points_are_paired_differences_in_the_direction_of_better() -> None:
    rng, rows = np.random.default_rng(1), []
    noise = rng.normal(0, 10, 30)
    for team, better in (("a-cmommt", 3.0), ("consume", -3.0)):
        for reports, gain in (("0", 0.0), ("1", better), ("all", 2 * better)):
            for replicate in range(30):
                score, delta = 50 + noise[replicate] + gain, replicate if reports == "all" else 1
                rows.append((team, 2, reports, replicate, score, True, delta, 0.5))
    names = ["team", "neighbours", "reports", "replicate", "score", "has_ended", "delta", "known"]
    found = points(pd.DataFrame(rows, columns=names)).set_index(["team", "reports"])
    for team in ("a-cmommt", "consume"):
        assert (team in OBSERVE) == (team == "a-cmommt")
        np.testing.assert_allclose(found.loc[team, "gain"], [0, 3, 6], atol=1e-12)
        np.testing.assert_allclose(found.loc[team, "more"], [-3, 0, 3], atol=1e-12)
        assert found.loc[team, "counts"].tolist() == [False, True, True]
        # 28 of 30 runs are not 95 %, 29 are.
        assert found.loc[team, "delta"].tolist() == [1, 1, 28]
        assert found.loc[team, "largest"].tolist() == [1, 1, 29]


@pytest.mark.parametrize("policy", ["a-cmommt", "centroid"])
def test_who_hears_no_report_is_a_team_without_awareness(hops: Any, policy: str) -> None:
    found = []
    for degree in (hops.BLIND, "none"):
        world = CMOMMT(policy=policy, awareness=degree, rng=3)
        world.run(200)
        found.append((world.robots.position.tobytes(), world.targets.position.tobytes()))
    assert found[0] == found[1]
