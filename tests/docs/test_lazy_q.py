"""The tables of docs/lazy-q.md are those of its Parquet file, which holds what its command measures."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd

from teamsight.analysis.learning import diagnosis_page
from teamsight.analysis.learning.diagnosis import Diagnosis, diagnose_explorations, diagnosis_points

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "lazy-q.md").read_text(encoding="utf-8")


def tables(text: str) -> list[str]:
    return re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)


def test_the_tables_are_those_of_the_measurements() -> None:
    made = diagnosis_page.page(diagnosis_points(pd.read_parquet(DOCS / "lazy-q.parquet")), Diagnosis().in_words())
    assert tables(made) == tables(PAGE)


def test_the_measurements_are_what_the_command_makes() -> None:
    shipped = pd.read_parquet(DOCS / "lazy-q.parquet")
    assert shipped.attrs["diagnosis"] == Diagnosis().conditions()
    # The first exploration from the paper's 600 transitions; the action's effect is measured with the most transitions.
    few = Diagnosis(samples=(600,), memories=1)
    made = diagnose_explorations(few)
    made = made[made["quantity"].isin(("matches", "matches by chance", "approach", "rewarded"))]
    first = shipped[(shipped["memory"] == 0) & (shipped["transitions"] == 600)]
    pd.testing.assert_frame_equal(made.reset_index(drop=True), first.reset_index(drop=True), check_exact=True)
