"""What the page on box pushing says of its claims is in its Parquet file."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.pushing.claims import verdicts

DOCS = Path(__file__).resolve().parents[2] / "docs" / "tasks"
PAGE = (DOCS / "pushing.md").read_text(encoding="utf-8")
TABLE = pd.read_parquet(DOCS / "pushing.parquet")


def _numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", text.replace("−", "-"))]


def test_the_claims_are_those_of_the_file() -> None:
    rows = [line.strip("| ").split(" | ") for line in PAGE.splitlines() if line.startswith(("| K", "| perceiving"))]
    found = verdicts(TABLE)
    assert len(rows) == len(found)
    for (_, _, measured, verdict), one in zip(rows, found, strict=True):
        assert verdict == one.verdict
        if measured == "the same in all runs":
            assert _numbers(one.measured) == [0.0, 0.0, 0.0]
        else:
            # The page rounds steps.
            said = _numbers(measured)
            assert _numbers(one.measured)[: len(said)] == pytest.approx(said, abs=0.51 if "steps" in measured else 1e-9)
