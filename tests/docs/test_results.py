"""A page of results and its tables are what the command makes."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight.analysis.papers import PAPERS, gathering, unreliable
from teamsight.analysis.stats.paired import Interval

DOCS = Path(__file__).resolve().parents[2] / "docs"
#: By the name of the paper: the page, and the runs that it is made of.
PAGES = {
    "tan1993": ("tasks/pursuit.md", "tasks/pursuit.parquet"),
    "ono_fukumoto1996": ("tasks/surround.md", "tasks/pursuit-modules.parquet"),
    "balch_arkin1994": ("tasks/foraging.md", "tasks/foraging.parquet"),
    "kube_zhang1992": ("tasks/pushing.md", "tasks/pushing.parquet"),
    "mataric": ("tasks/collecting.md", "tasks/collecting.parquet"),
}


def tables_in(text: str) -> list[str]:
    """Return the tables of a page of Markdown."""
    return re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)


@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_the_tables_that_its_command_makes(name: str) -> None:
    page, runs = (DOCS / place for place in PAGES[name])
    paper, text, table = PAPERS[name], page.read_text(encoding="utf-8"), pd.read_parquet(runs)
    plan = paper.plan()
    assert table.attrs[paper.name] == plan.conditions()
    made = tables_in(paper.page(table, plan))
    # A page may leave a table out, but not the claims, and shows none otherwise.
    assert made[-1] in text
    for one in made:
        assert one in text or one.splitlines()[0] not in text
    assert f"teamsight reproduce {name}" in text


@pytest.mark.parametrize("sweep", unreliable.SWEEPS)
def test_the_page_on_unreliable_teams_has_the_tables_of_its_points(sweep: str) -> None:
    points, plan = pd.read_parquet(DOCS / "unreliable.parquet"), unreliable.Unreliability()
    text = (DOCS / "unreliable.md").read_text(encoding="utf-8")
    assert points.attrs["unreliable"] == plan.conditions()
    made = unreliable.sweep_table(points, sweep, plan).splitlines()
    # The file and the figure have the rest.
    shown = [made[0], made[1], *(row for row in made if row.startswith("| gain"))]
    assert "\n".join(shown) + "\n" in text
    assert "teamsight reproduce unreliable" in text


def _cell(row: Any) -> gathering.Cell:
    """Return a cell from its row in the file, which has answers in place of the shortfalls."""
    answers = {"yes": Interval(0.0, 0.0, 0.0), "undecided": Interval(0.0, -math.inf, math.inf)}
    explore, skilled, saturation = (
        gathering.DeltaInterval(*(int(row[f"{name}_{part}"]) for part in ("delta", "low", "high")))
        for name in ("explore", "skilled", "saturation")
    )
    ratio, gain, skill = (Interval(row[name], row[f"{name}_low"], row[f"{name}_high"]) for name in ("ratio", "gain", "skill"))
    shortfall = {skilled.delta: answers[row["enough_at_skilled"]], explore.delta: answers[row["enough_at_explore"]]}
    given = {name: row[name] for name in ("objective", "tolerance", "censored", "too_few", "too_many", "crowded")}
    return gathering.Cell(
        row["task"], row["gathers"], row["size"], explore, skilled, ratio, saturation, shortfall, gain=gain, skill=skill,
        explored=shortfall[explore.delta], **given,
    )  # fmt: skip


def test_the_page_on_the_gathering_index_has_the_tables_of_its_files() -> None:
    folder = DOCS / "tasks"
    text = (folder / "gathering.md").read_text(encoding="utf-8")
    cells = [_cell(row) for _, row in pd.read_parquet(folder / "gathering-index.parquet").iterrows()]
    made = gathering.index_table([cell for cell in cells if cell.size in (8, 30)])
    assert made in text
    assert gathering.summary_table(gathering.judge(cells)) in text
    rounds = pd.read_parquet(folder / "gathering-rounds.parquet")
    further = [part["runs"].iloc[1:] for _, part in rounds.groupby(["task", "size"])]
    said = f"one or two rounds in every cell, {min(map(sum, further))} to {max(map(sum, further))} further runs"
    assert said in " ".join(text.split())
    assert "teamsight reproduce gathering" in text
