"""A column holds values of one type in all parts: a run with another one fails, and no other."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.sweep import sweep
from tests.analysis.studies.folders import Engine, odd, rows


def test_runs_with_another_type_than_parts_that_are_there_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # In one sweep, in a later one, in a shard of an array that has not seen the other's, and without the manifest.
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 1)
    many = odd("cmommt", "other_types", replicates=12)
    first = sweep(dataclasses.replace(many, replicates=6), tmp_path / "out")
    later = sweep(many, tmp_path / "out", executor=Engine())
    assert later.done + later.failed == 12
    assert later.failed > first.failed
    assert len(StudyFolder(tmp_path / "out").read("runs")) == later.done
    assert rows(tmp_path / "out")["a"].map(type).nunique() == 1
    (tmp_path / "out" / "manifest.json").unlink()
    sweep(many, tmp_path / "out")
    held = "text" if isinstance(rows(tmp_path / "out")["a"][0], str) else "number"
    assert all(StudyFolder(tmp_path / "out").settle({"a": kind}) == {"a": held} for kind in ("text", "number"))


def test_a_shard_is_made_again_if_another_one_has_decided_about_types(tmp_path: Path) -> None:
    study = odd("cmommt", "other_types", replicates=12)

    class Late(Engine):
        """Ends after another shard of a job array has decided."""

        def outcomes(self, function: Any, jobs: Any) -> Any:
            for outcome in super().outcomes(function, jobs):
                other = {"text": "number", "number": "text"}[outcome.value.kinds["a"]]
                StudyFolder(tmp_path / "out").settle({"a": other})
                yield outcome

    summary = sweep(study, tmp_path / "out", executor=Late())
    assert 0 < summary.done < 12
    assert summary.done + summary.failed == 12
    assert rows(tmp_path / "out")["a"].map(type).nunique() == 1
