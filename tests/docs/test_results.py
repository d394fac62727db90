"""A page of results and its tables are what the command makes."""

from __future__ import annotations

import re
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.papers import PAPERS

DOCS = Path(__file__).resolve().parents[2] / "docs"
#: By the name of the paper: the page, and the runs that it is made of.
PAGES = {
    "tan1993": ("tasks/pursuit.md", "tasks/pursuit.parquet"),
    "ono_fukumoto1996": ("tasks/pursuit.md", "tasks/pursuit-modules.parquet"),
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
