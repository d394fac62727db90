"""Disks that fill or cannot be written: one line of error, and nothing half-written counts."""

from __future__ import annotations

import errno
import os
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from made_parts import fill, names, part, prepared, runs_of, study
from processes import finished

from teamsight.analysis.studies.folder.study_folder import StudyFolder, verify
from teamsight.core.files import UnwritableError

# Functions of C that ask the system to write; "write" is that of files, too.
WRITING = {"open", "write", "flush", "fsync", "replace", "mkdir", "ftruncate"}


class FullDisk:
    """Lets one call that writes fail, counted from 0, and counts them."""

    def __init__(self, failing: int, reason: int) -> None:
        self.calls, self.failed, self._failing, self._reason = 0, "", failing, reason

    def __call__(self, frame: object, event: str, function: object) -> None:
        if event == "c_call" and getattr(function, "__name__", "") in WRITING:
            self.calls += 1
            if self.calls - 1 == self._failing:
                self.failed = function.__name__  # type: ignore[attr-defined]
                raise OSError(self._reason, os.strerror(self._reason))


def calls_until(work: Callable[[], object], failing: int, reason: int) -> tuple[int, str, str]:
    """Do some work in which one call fails; return how many calls there were, which failed, and the error."""
    disk, error = FullDisk(failing, reason), ""
    sys.setprofile(disk)
    try:
        work()
    except (UnwritableError, OSError) as found:
        error = str(found)
    finally:
        sys.setprofile(None)
    return disk.calls, disk.failed, error


@pytest.mark.parametrize("reason", [errno.ENOSPC, errno.EROFS, errno.EIO])
def test_every_call_that_writes_a_shard_may_fail(tmp_path: Path, reason: int) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    parts = {"steps": part(plan, runs_of(plan), 3), "runs": part(plan, runs_of(plan))}
    runs, errors = names(plan, runs_of(plan)), []
    for failing in range(100):
        calls, failed, error = calls_until(lambda: folder.write(parts, runs), failing, reason)
        for path in (*tmp_path.glob("steps/*"), *tmp_path.glob("runs/*")):
            assert path.read_bytes() in parts.values(), f"call {failing}"
            path.unlink()
        if calls <= failing:
            break
        errors.append((failed, error))
    assert failing >= 10
    assert verify(tmp_path) == (0, (), (), (), 0, (), 0)
    cure = "free some space" if reason == errno.ENOSPC else "give"
    assert all(re.search(rf"cannot be written \(.*\); {cure}|^$", error) for _, error in errors), errors
    # What makes a new name durable is not available everywhere; a folder may exist.
    assert {failed for failed, error in errors if not error} <= {"open", "fsync", "mkdir"}, errors
    assert sum(bool(error) for _, error in errors) >= 8


@pytest.mark.parametrize("reason", [errno.ENOSPC, errno.EROFS])
def test_every_call_that_prepares_a_folder_may_fail(tmp_path: Path, reason: int) -> None:
    one, count = study(), 0
    prepared(tmp_path / "warm", one)
    for failing in range(100):
        path = tmp_path / str(failing)
        calls, _, error = calls_until(lambda: prepared(path, one), failing, reason)
        if calls <= failing:
            break
        count += bool(error)
        assert not error or "\n" not in error
        # The same command goes on afterwards.
        assert prepared(path, one).done().size == 0
        assert not list(path.glob(".*.part"))
    assert count >= 4


@pytest.mark.short
@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of resources")
def test_a_disk_that_fills_leaves_whole_parts(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    sizes = (0, 10, 1000, 2500)
    lines = finished("limited", tmp_path, *sizes).splitlines()
    assert len(lines) == 3 * len(sizes)
    for prepare, _, write in zip(lines[0::3], lines[1::3], lines[2::3], strict=True):
        assert prepare == "prepare: no error"
        assert re.fullmatch(r"write: UnwritableError: .*cannot be written \(File too large\); give .*", write)
    assert folder.done().size == folder.read("runs").num_rows == folder.read("steps").num_rows == 0
    fill(folder, folder.study.plan(), 12, steps=True)
    assert verify(tmp_path) == (2, (), (), (), 0, (), 0)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root, to become another user")
def test_a_folder_that_may_not_be_written_gives_one_line(tmp_path: Path) -> None:
    folder = prepared(tmp_path / "a")
    # Another user must reach it; how deep pytest's own folders are differs.
    for path in (tmp_path, *(each for each in tmp_path.parents if Path(tempfile.gettempdir()) in each.parents)):
        path.chmod(path.stat().st_mode | 0o055)
    before = sorted(folder.path.rglob("*"))
    lines = finished("powerless", folder.path, 65534).splitlines()
    assert len(lines) == 3
    for line, name in zip(lines, ("prepare", "lock", "write"), strict=True):
        assert re.fullmatch(rf"{name}: UnwritableError: .*cannot be written \(Permission denied\); give .*", line), line
    assert sorted(folder.path.rglob("*")) == before
    fill(folder, folder.study.plan())
    assert folder.done().size == 12


def test_a_part_that_reads_back_differently_is_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from teamsight.analysis.studies.folder import parts

    folder = prepared(tmp_path)
    plan = folder.study.plan()
    real = parts.files.open_regular

    def faulty(path: str) -> object:
        with open(path, "r+b") as file:
            file.seek(30)
            file.write(b"?")
        return real(path)

    monkeypatch.setattr(parts.files, "open_regular", faulty)
    with pytest.raises(UnwritableError, match="reads back as other bytes .*check the disk"):
        folder.write({"runs": part(plan, [(0, 0)])}, ["x"])
    monkeypatch.undo()
    assert list((tmp_path / "runs").iterdir()) == []


def test_a_full_disk_does_not_hide_the_error_of_a_sweep(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    (tmp_path / "sweeps.jsonl").touch()

    def work() -> None:
        with folder.recorded(engine="test", workers=1, code="x"):
            (tmp_path / "sweeps.jsonl").unlink()
            (tmp_path / "sweeps.jsonl").mkdir()
            raise UnwritableError("the disk is full")

    with pytest.raises(UnwritableError, match="the disk is full"):
        work()
    assert StudyFolder(tmp_path).progress[0].has_ended
