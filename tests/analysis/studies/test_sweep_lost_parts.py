"""A part that is lost is made again."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.analysis.studies import sharding
from teamsight.analysis.studies.folder.verify import verify
from teamsight.analysis.studies.study import Record
from teamsight.analysis.studies.sweep import sweep
from tests.analysis.studies.folders import odd, parts


@pytest.mark.parametrize("kind", ["steps", "trajectories", "events"])
def test_a_lost_part_of_any_kind_is_made_again(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sharding, "_MOST_RUNS", 2)
    study = odd("cmommt", "logging", replicates=4, record=Record("odd_models:logging", True, 2, True))
    sweep(study, tmp_path)
    before = parts(tmp_path)
    assert not verify(tmp_path).damaged
    next((tmp_path / kind).iterdir()).unlink()
    assert [each.reason for each in verify(tmp_path, repair=False).damaged] == [f"its part of {kind} is lost"]
    assert sweep(study, tmp_path).made == 2
    assert before.items() <= parts(tmp_path).items()
    assert not verify(tmp_path).damaged
