"""The tables of the page on collecting are those of its Parquet file, and what it says is in them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from teamsight.analysis.collecting.claims import difference, verdicts
from teamsight.analysis.collecting.page import claims_table, conditions_table, rows_table
from teamsight.analysis.collecting.plan import Plan
from teamsight.analysis.stats.paired import interval_of

DOCS = Path(__file__).resolve().parents[2] / "docs" / "tasks"
PAGE = (DOCS / "collecting.md").read_text(encoding="utf-8")
TABLE = pd.read_parquet(DOCS / "collecting.parquet")


def test_the_tables_are_those_of_the_file() -> None:
    for table in (conditions_table(TABLE, Plan()), rows_table(TABLE, Plan()), claims_table(TABLE, Plan())):
        assert table in PAGE


def test_the_settings_are_the_defaults_of_the_command() -> None:
    assert TABLE.attrs["collecting"] == Plan().conditions()
    assert len(TABLE) == Plan().runs * sum(len(Plan().policies(size)) for size in Plan().sizes)


def _curves(condition: str) -> np.ndarray:
    part = TABLE[(TABLE["robots"] == 4) & (TABLE["condition"] == condition)].sort_values("replicate")
    return np.array(part["curve"].tolist())


def test_what_the_page_says_is_in_the_file() -> None:
    for one, other in (("events", "delayed"), ("progress", "events")):
        for at in range(len(Plan().times)):
            assert interval_of(_curves(one)[:, at] - _curves(other)[:, at]).low > 0
    # Without the estimator I fewer rows are right than by chance; with it no robots rest in company.
    assert {one.verdict for one in verdicts(TABLE, Plan()) if "by chance" in one.claim} == {"agrees", "differs"}
    early, late = (difference(TABLE, "progress", "delayed", name, 4) for name in ("delivered_early", "delivered"))
    assert early.high < 0
    assert late.low < 0 < late.high
    assert f"{late.mean:+.1f} pucks ({late.low:+.1f} to {late.high:+.1f})".replace("-", "−") in PAGE
    # Each claim says when it is judged.
    assert {one.claim.rpartition(", after ")[2] for one in verdicts(TABLE, Plan())} == {"20,000 steps", "80,000 steps"}
    shares = TABLE[TABLE["robots"] == 4].groupby("condition")["correct"].mean()
    assert shares["delayed"] < 2 / 3 * shares["progress"]
    for size, most in ((4, 2.0), (12, 3.0)):
        for coding in ("count", "ring"):
            for name in ("delivered_early", "delivered"):
                found = difference(TABLE, coding, "progress", name, size)
                assert found.low < 0 < found.high
                assert max(-found.low, found.high) < most
        pucks = TABLE[TABLE["robots"] == size].groupby("condition")["delivered"].mean()
        assert pucks.idxmax() == "by hand"
