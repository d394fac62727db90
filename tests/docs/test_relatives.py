"""The page of A-CMOMMT's relatives has the numbers of the command that it names."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from teamsight import Study

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "relatives.md").read_text(encoding="utf-8").splitlines()


@pytest.fixture
def relatives(monkeypatch: pytest.MonkeyPatch) -> object:
    monkeypatch.syspath_prepend(str(ROOT / "examples"))
    yield __import__("relatives")
    sys.modules.pop("relatives")


def test_a_row_of_the_table_is_what_its_runs_give(relatives, tmp_path: Path) -> None:
    study = Study.from_file(ROOT / "examples" / "relatives.toml")
    values = study.as_dict()
    fewer = {"radius": [5.0], "awareness_range": [4.0]}
    runs = Study.from_dict({**values, "axes": values["axes"] | fewer}).run(tmp_path / "out").frame
    row = relatives.compared(runs, "observed_fraction", list(study.axes)).splitlines()[-1]
    assert row in PAGE, row
