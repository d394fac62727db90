"""The tables of docs/lazy-q.md are those of its Parquet file, which holds what its command measures."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd

from teamsight.analysis.learning.diagnosis import diagnose_explorations, diagnosis_points
from teamsight.analysis.learning.diagnosis_figure import page
from teamsight.analysis.learning.plans import Diagnosis

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "lazy-q.md").read_text(encoding="utf-8")


def tables(text: str) -> list[str]:
    return re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)


def test_the_tables_are_those_of_the_measurements() -> None:
    made = page(diagnosis_points(pd.read_parquet(DOCS / "lazy-q.parquet")), Diagnosis().in_words())
    # The page shows the first of the four tables, and rows of the third.
    heads = {found.splitlines()[0]: found.splitlines() for found in tables(made)[:3:2]}
    assert len(tables(PAGE)) == len(heads)
    for shown in map(str.splitlines, tables(PAGE)):
        assert set(shown) <= set(heads[shown[0]])
        assert len(shown) > 5


def test_the_measurements_are_what_the_command_makes() -> None:
    shipped = pd.read_parquet(DOCS / "lazy-q.parquet")
    assert shipped.attrs["diagnosis"] == Diagnosis().conditions()
    # The first exploration from the paper's 600 transitions; the action's effect is measured with the most transitions.
    few = Diagnosis(samples=(600,), memories=1)
    made = diagnose_explorations(few)
    made = made[made["quantity"].isin(("matches", "matches by chance", "approach", "rewarded"))]
    first = shipped[(shipped["memory"] == 0) & (shipped["transitions"] == 600)]
    # Equal but for rounding in the last bit of a cosine.
    pd.testing.assert_frame_equal(made.reset_index(drop=True), first.reset_index(drop=True), rtol=0, atol=1e-12)
