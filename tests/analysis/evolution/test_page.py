"""The page about the evolved policy shows its table, and the table holds what is claimed."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.evolution import cma, compare, generalise
from teamsight.analysis.evolution.cma import GRID
from teamsight.analysis.evolution.compare import WORST, options_of
from teamsight.analysis.evolution.page import page
from teamsight.analysis.runs import files
from teamsight.analysis.runs.experiment import Grid
from teamsight.policies.evolved import Evolved, made

DOCS = Path(__file__).resolve().parents[3] / "docs"


def test_the_shipped_page_is_made_of_the_shipped_table(tmp_path: Path) -> None:
    table = pd.read_parquet(DOCS / "evolved.parquet")
    files.write_page(tmp_path / "evolved.md", page(table, table.attrs))
    assert (DOCS / "evolved.md").read_bytes() == (tmp_path / "evolved.md").read_bytes()


def test_a_cell_of_the_shipped_table_is_what_the_comparison_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compare, "GRID", Grid((10,), (4.0,)))
    table = pd.read_parquet(DOCS / "evolved.parquet")
    (options, *_) = options_of(table[table["part"] == "screen"])
    runs = table.attrs["runs"]
    (found,) = compare.compare({"evolved": Evolved()}, options, root=cma.TEST, runs=runs).values()
    (cell,) = compare.by_cell(found).to_dict("records")
    shipped = table[(table["part"] == "cell") & (table["robots"] == 10) & (table["radius"] == 4.0)].iloc[0]
    assert cell == {name: shipped[name] for name in cell}


def test_a_row_about_other_worlds_is_what_the_comparison_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    table = pd.read_parquet(DOCS / "evolved.parquet")
    (options, *_) = options_of(table[table["part"] == "screen"])
    shipped = table[table["part"] == "generalisation"].set_index("name")
    assert shipped.index.tolist() == [one.name for one in generalise.VARIATIONS]
    monkeypatch.setattr(generalise, "VARIATIONS", [one for one in generalise.VARIATIONS if one.name == "N = 3"])
    (row,) = generalise.generalise(Evolved(), options, runs=table.attrs["runs"]).to_dict("records")
    assert row == {"name": "N = 3"} | {name: shipped.loc["N = 3", name] for name in row if name != "name"}


def test_the_page_is_about_the_constants_that_ship() -> None:
    assert pd.read_parquet(DOCS / "evolved.parquet").attrs["made"] == made()


def test_the_policy_observes_more_and_nowhere_significantly_less() -> None:
    table = pd.read_parquet(DOCS / "evolved.parquet")
    overall, cells = table[table["part"] == "overall"], table[table["part"] == "cell"]
    assert len(cells) == len(GRID.cells)
    assert overall["low"].item() > 0
    assert not (cells["high"] < WORST).any()
