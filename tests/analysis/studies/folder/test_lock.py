"""Locks: one sweep of a folder, or shards of a job array side by side; a killed process holds nothing."""

from __future__ import annotations

import errno
import os
import signal
import sys
import types
from pathlib import Path

import pytest
from made_parts import prepared
from processes import PATIENCE, child

from teamsight.analysis.studies.folder import lock as file_lock
from teamsight.analysis.studies.folder.lock import LockedError, holders
from teamsight.analysis.studies.folder.study_folder import StudyFolder

needs_flock = pytest.mark.skipif(sys.platform == "win32", reason="needs fcntl")


@pytest.mark.short
def test_a_second_process_is_refused_with_who_holds_the_folder(tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "a")
    with child("hold", folder.path) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(LockedError) as caught, folder.lock():
            pass
        text = str(caught.value)
        assert f"process {other.pid} on {os.uname().nodename} since 2" in text
        assert "wait for it with --wait" in text
        assert "\n" not in text
        (holder,) = holders(folder.path)
        assert (holder.pid, holder.shard) == (other.pid, "")
        other.kill()
        other.wait(PATIENCE)
        assert holders(folder.path) == ()
        with folder.lock():
            assert holders(folder.path)[0].pid == os.getpid()
    assert holders(folder.path) == ()


def test_waiting_ends_when_the_other_process_ends(tmp_path: Path) -> None:
    with child("hold", tmp_path) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == "held\n"
        with child("wait", tmp_path) as second:
            assert second.stdout is not None
            assert f"is in use (a sweep, process {first.pid} on" in second.stdout.readline()
            first.send_signal(signal.SIGKILL)
            assert second.stdout.readline() == "held\n"


@pytest.mark.short
def test_shards_run_side_by_side_but_not_beside_a_sweep_of_all(tmp_path: Path) -> None:
    one, two = StudyFolder(tmp_path), StudyFolder(tmp_path)
    with one.lock((1, 4)), two.lock((2, 4)):
        assert [holder.shard for holder in holders(tmp_path)] == ["1/4", "2/4"]
        for shard, words in ((None, "shard 1/4, process .*; shard 2/4"), ((2, 4), "shard 2/4")):
            with pytest.raises(LockedError, match=words), StudyFolder(tmp_path).lock(shard):
                pass
    with one.lock(), pytest.raises(LockedError, match="a sweep, process"), two.lock((1, 4)):
        pass
    with one.lock((1, 4)):
        pass


def test_shards_of_two_divisions_do_not_run_side_by_side(tmp_path: Path) -> None:
    with StudyFolder(tmp_path).lock((1, 2)):
        with pytest.raises(LockedError, match="is in use .shard 1/2, process"), StudyFolder(tmp_path).lock((1, 3)):
            pass
        with StudyFolder(tmp_path).lock((2, 2)):
            pass
    with StudyFolder(tmp_path).lock((1, 3)):
        pass
    # What is left of shards that have ended keeps nobody out.
    with child("hold", tmp_path, "2/3") as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(LockedError, match="shard 2/3"), StudyFolder(tmp_path).lock((2, 4)):
            pass
        other.kill()
        other.wait(PATIENCE)
        with StudyFolder(tmp_path).lock((2, 4)):
            pass


def test_the_lock_is_free_after_an_error_or_an_interrupt(tmp_path: Path) -> None:
    for kind in (KeyboardInterrupt, RuntimeError):
        with pytest.raises(kind), StudyFolder(tmp_path).lock():
            raise kind
        with StudyFolder(tmp_path).lock((3, 3)):
            pass


@pytest.mark.parametrize("shard", [(0, 4), (5, 4), (1, 0), (-1, 4), (1.5, 4)])
def test_shards_are_numbered_from_1(tmp_path: Path, shard: tuple[int, int]) -> None:
    with pytest.raises((ValueError, TypeError), match="shard="), StudyFolder(tmp_path).lock(shard):
        pass


def test_a_lock_whose_file_was_deleted_is_taken_anew(tmp_path: Path) -> None:
    with file_lock.opened(tmp_path / "x") as lock:
        (tmp_path / "x").unlink()
        assert not lock.take()
        assert lock.take()
        assert file_lock.is_held(tmp_path / "x")


def test_looking_at_a_lock_neither_takes_nor_makes_it(tmp_path: Path) -> None:
    assert not file_lock.is_held(tmp_path / "x")
    assert not list(tmp_path.iterdir())
    with file_lock.opened(tmp_path / "x") as lock:
        assert not file_lock.is_held(tmp_path / "x")
        assert lock.take()


@needs_flock
def test_a_file_that_is_only_read_is_asked_for_a_shared_lock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Network file systems give others to writers alone."""
    import fcntl

    asked: list[int] = []
    monkeypatch.setattr(fcntl, "flock", lambda number, how: asked.append(how))
    (tmp_path / "x").touch()
    assert not file_lock.is_held(tmp_path / "x")
    assert asked == [fcntl.LOCK_SH | fcntl.LOCK_NB]


@needs_flock
def test_a_link_is_never_locked_through(tmp_path: Path) -> None:
    (tmp_path / "thesis").write_text("mine")
    (tmp_path / "lock").symlink_to(tmp_path / "thesis")
    with pytest.raises(ValueError, match="lock: cannot be written"), file_lock.opened(tmp_path / "lock"):
        pass
    assert (tmp_path / "thesis").read_text() == "mine"


@needs_flock
def test_a_file_system_without_locks_gives_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import fcntl

    def flock(number: int, flags: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", flock)
    with pytest.warns(UserWarning, match="no locks .*start no second sweep"):
        folder = prepared(tmp_path)
    with pytest.warns(UserWarning, match="no locks"), folder.lock():
        assert holders(tmp_path) == ()


@pytest.fixture
def _bytes_are_locked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lock bytes, as on Windows, among the locks of this process."""
    held: dict[int, tuple[tuple[int, int], int, int]] = {}

    def locking(number: int, mode: int, size: int) -> None:
        assert mode == 2
        stat, first = os.fstat(number), os.lseek(number, 0, os.SEEK_CUR)
        for file, begin, end in held.values():
            if file == (stat.st_dev, stat.st_ino) and first < end and begin < first + size:
                raise PermissionError(errno.EACCES, "Permission denied")
        held[number] = ((stat.st_dev, stat.st_ino), first, first + size)

    close = os.close

    def closing(number: int) -> None:
        held.pop(number, None)
        close(number)

    fake = types.ModuleType("msvcrt")
    fake.locking, fake.LK_NBLCK = locking, 2  # type: ignore[attr-defined]
    monkeypatch.setattr(os, "close", closing)
    monkeypatch.setattr(file_lock, "_module", lambda name: fake if name == "msvcrt" else None)


@pytest.mark.usefixtures("_bytes_are_locked")
def test_the_same_rules_hold_where_bytes_are_locked(tmp_path: Path) -> None:
    test_shards_run_side_by_side_but_not_beside_a_sweep_of_all(tmp_path)
    test_the_lock_is_free_after_an_error_or_an_interrupt(tmp_path)
