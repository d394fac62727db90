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


@pytest.mark.parametrize(
    ("file", "fewer"),
    [
        ("relatives.toml", {"radius": [5.0], "awareness_range": [4.0]}),
        ("crowds.toml", {"robots": [2], "targets": [5], "target_policy": ["evasive"]}),
    ],
)
def test_a_row_of_each_table_is_what_its_runs_give(file: str, fewer: dict, relatives, tmp_path: Path) -> None:
    study = Study.from_file(ROOT / "examples" / file)
    values = study.as_dict()
    runs = Study.from_dict({**values, "axes": values["axes"] | fewer}).run(tmp_path / "out").frame
    for measure in relatives.MEASURES if file == "relatives.toml" else ("observed_fraction", "entropy"):
        row = relatives.compared(runs, measure, list(study.axes)).splitlines()[-1]
        assert row in PAGE, row
