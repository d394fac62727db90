"""SIGKILL while parts are written: every part that is there is whole, and drafts are removed by the next sweep."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from made_parts import fill, part, prepared, runs_of
from processes import finished

from teamsight.analysis.studies.folder.parts import listed, load
from teamsight.analysis.studies.folder.study_folder import StudyFolder, verify
from teamsight.analysis.studies.standing import status

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
KILLS = 25


def test_every_part_is_whole_after_a_kill(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    (line,) = finished("killed", tmp_path, KILLS).splitlines()
    # Without drafts, no kill would have come while a part was written.
    assert int(line.removesuffix(" drafts")) >= 3
    assert all(load(each) for kind in ("runs", "steps") for each in listed(tmp_path, kind))
    fill(folder, folder.study.plan())
    assert status(tmp_path).missing == 0


def test_drafts_of_parts_never_count(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    whole = part(plan, runs_of(plan))
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / f".{'0' * 16}-{'1' * 16}.parquet.{'2' * 16}.part").write_bytes(whole)
    assert folder.done().size == status(tmp_path).done == folder.read("runs").num_rows == 0
    assert verify(tmp_path).drafts == 1


def test_a_line_that_was_cut_off_spoils_no_other(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    with folder.recorded(engine="test", workers=2, code="x") as heartbeat:
        heartbeat.update(3, 12, made=3)
    with open(tmp_path / "sweeps.jsonl", "ab") as file:
        file.write(b'{"event": "begin", "swe')
    with pytest.raises(KeyboardInterrupt), folder.recorded(engine="test", workers=2, code="x"):
        raise KeyboardInterrupt
    found = [(record["event"], record.get("outcome"), record.get("made")) for record in StudyFolder(tmp_path).sweeps]
    assert found == [("begin", None, None), ("end", "ended", 3), ("begin", None, None), ("end", "interrupted", 0)]


def test_processes_that_prepare_one_folder_for_two_studies_agree_on_one(tmp_path: Path) -> None:
    lines = finished("prepare_at_once", tmp_path, 4).splitlines()
    assert len(lines) == 5 * 5
    for first in range(0, len(lines), 5):
        *found, last = lines[first : first + 5]
        kept = int(last.removesuffix(" is kept"))
        assert sorted(found) == sorted([f"{kept} is accepted", f"{1 - kept} is refused"] * 2)
