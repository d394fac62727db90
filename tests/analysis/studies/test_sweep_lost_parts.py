"""A part that is lost is made again."""

from __future__ import annotations

import io
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from teamsight.analysis.studies import sweep as sweeping
from teamsight.analysis.studies.folder import parts as part_files
from teamsight.analysis.studies.folder.study_folder import StudyFolder, verify
from teamsight.analysis.studies.results import open_study
from teamsight.analysis.studies.standing import status
from teamsight.analysis.studies.study import Record, Until
from teamsight.analysis.studies.sweep import sweep
from tests.analysis.studies.folders import odd, parts


@pytest.mark.parametrize("kind", ["steps", "trajectories", "events"])
def test_a_lost_part_of_any_kind_is_made_again(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweeping, "_MOST_RUNS", 2)
    study = odd("cmommt", "logging", replicates=4, record=Record("odd_models:logging", True, 2, True))
    sweep(study, tmp_path)
    before = parts(tmp_path)
    assert not verify(tmp_path).damaged
    next((tmp_path / kind).iterdir()).unlink()
    assert [each.reason for each in verify(tmp_path, repair=False).damaged] == [f"its part of {kind} is lost"]
    found, seen = open_study(tmp_path), status(tmp_path)
    assert (found.planned, found.done, found.missing, found.lost) == (4, 2, 2, 2)
    assert (seen.planned, seen.done, seen.missing) == (4, 2, 2)
    # What was measured is there nevertheless.
    assert len(found.frame) == 4
    assert "2 missing (of 2 a recorded part is lost): teamsight sweep continues" in repr(found)
    assert found.warning == "partial: 2 of 4 runs, parts of 2 lost"
    with pytest.warns(UserWarning, match=rf"^{kind}: rows of 2 of 4 runs may lack, .*teamsight sweep makes them again"):
        assert getattr(found, kind).index.nunique() == 2
    assert sweep(study, tmp_path).made == 2
    assert (open_study(tmp_path).missing, open_study(tmp_path).warning) == (0, "")
    assert before.items() <= parts(tmp_path).items()
    assert not verify(tmp_path).damaged


def test_what_a_killed_sweep_of_another_version_has_left_is_not_read(tmp_path: Path) -> None:
    """It had written the steps of a shard, but not its runs."""
    sweep(odd("cmommt", record=Record(steps=True)), tmp_path)
    (part,) = part_files.listed(tmp_path, "steps")
    whole = StudyFolder(tmp_path).read("steps")
    for other in range(20):
        # Some of them have names before that of the part that counts.
        target = io.BytesIO()
        table = pq.read_table(part.path)
        pq.write_table(table.set_column(2, table.schema.names[2], pa.array([other] * table.num_rows)), target)
        part_files.write(tmp_path, "steps", part.shard, target.getvalue())
    assert part_files.listed(tmp_path, "steps")[0].path != part.path
    assert StudyFolder(tmp_path).read("steps").equals(whole)
    next((tmp_path / "runs").iterdir()).unlink()
    assert not StudyFolder(tmp_path).read("steps").num_rows


def test_lost_parts_of_an_adaptive_study_are_missing_too(tmp_path: Path) -> None:
    until = Until(0.9, "observed_fraction", 3)
    sweep(odd("cmommt", until=until, replicates=2, record=Record(steps=True)), tmp_path)
    assert status(tmp_path).missing == open_study(tmp_path).missing == 0
    next((tmp_path / "steps").iterdir()).unlink()
    seen, found = status(tmp_path), open_study(tmp_path)
    assert (seen.planned, seen.done, seen.missing) == (found.planned, found.done, found.missing)
    assert seen.missing > 0
