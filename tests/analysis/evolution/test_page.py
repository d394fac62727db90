"""The page on the learned rule says what its table holds, and the table what was promised."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from teamsight.analysis.evolution.cma import GRID
from teamsight.analysis.evolution.compare import WORST
from teamsight.analysis.evolution.page import page
from teamsight.policies.evolved.policy import made

DOCS = Path(__file__).resolve().parents[3] / "docs"


def test_the_page_is_that_of_its_table() -> None:
    table = pd.read_parquet(DOCS / "learned.parquet")
    assert (DOCS / "learned.md").read_text(encoding="utf-8") == page(table, table.attrs)


def test_the_page_is_about_the_rule_that_ships() -> None:
    assert pd.read_parquet(DOCS / "learned.parquet").attrs["made"] == made()


def test_the_rule_observes_more_and_nowhere_clearly_less() -> None:
    table = pd.read_parquet(DOCS / "learned.parquet")
    overall, cells = table[table["part"] == "overall"], table[table["part"] == "cell"]
    assert len(cells) == len(GRID.cells)
    assert overall["low"].item() > 0
    assert not (cells["high"] < WORST).any()
