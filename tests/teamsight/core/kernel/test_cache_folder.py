"""The folder of compiled kernels: what others can write to is neither read nor run."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import pytest

from teamsight.core.kernel import cache as cache_folder

pytestmark = [
    pytest.mark.short,
    pytest.mark.skipif(not hasattr(os, "geteuid"), reason="looks at owners and modes as POSIX has them"),
]


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home and a folder for temporary files of our own, and nothing chosen yet."""
    monkeypatch.delenv(cache_folder.VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(cache_folder, "_choose", cache(cache_folder._choose.__wrapped__))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return tmp_path


def shared(places: Path) -> Path:
    """Return the folder of this user among the temporary files."""
    return places / "temporary" / f"teamsight-{os.geteuid()}"


def is_private(folder: Path | None) -> bool:
    assert folder is not None
    found = folder.lstat()
    return stat.S_ISDIR(found.st_mode) and stat.S_IMODE(found.st_mode) == 0o700 and found.st_uid == os.geteuid()


def test_the_users_cache_folder_is_made_for_the_user_alone(places: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = cache_folder.cache_folder()
    assert folder is not None
    assert (places / "home") in folder.parents
    assert is_private(folder)
    assert capsys.readouterr().err == ""


def test_a_folder_of_an_earlier_version_is_closed_to_the_group(places: Path) -> None:
    folder = cache_folder._default()
    folder.mkdir(parents=True)
    folder.chmod(0o775)
    assert cache_folder.cache_folder() == folder
    assert is_private(folder)


def test_the_chosen_folder_is_made_and_may_be_reached_by_a_link(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("new/below", "link"):
        monkeypatch.setenv(cache_folder.VARIABLE, str(places / name))
        if name == "link":
            (places / "link").symlink_to(places / "new")
            (places / "new").chmod(0o755)
        assert cache_folder.cache_folder() == places / name
    assert is_private(places / "new" / "below")
    monkeypatch.setenv(cache_folder.VARIABLE, "~/kernels")
    assert cache_folder.cache_folder() == places / "home" / "kernels"
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o1777, 0o702])
def test_a_chosen_folder_that_others_can_write_to_is_not_used_and_that_is_said_once(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], mode: int
) -> None:
    chosen = places / "chosen"
    chosen.mkdir()
    chosen.chmod(mode)
    monkeypatch.setenv(cache_folder.VARIABLE, str(chosen))
    assert cache_folder.cache_folder() == cache_folder.cache_folder() == shared(places)
    assert is_private(shared(places))
    assert stat.S_IMODE(chosen.stat().st_mode) == mode
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert str(chosen) in message
    assert f"mode {mode:04o}" in message
    assert f"set {cache_folder.VARIABLE}" in message


def test_a_folder_of_another_user_is_not_used(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen, user = places / "chosen", os.geteuid()
    for folder in (chosen, shared(places)):
        folder.mkdir(mode=0o700)
    monkeypatch.setenv(cache_folder.VARIABLE, str(chosen))
    (places / "temporary" / "teamsight-123456").mkdir(mode=0o700)
    monkeypatch.setattr(os, "geteuid", lambda: 123456)
    folder = cache_folder.cache_folder()
    assert folder is not None
    assert folder.parent == places / "temporary"
    assert folder.name not in (f"teamsight-{user}", "teamsight-123456")
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert message.count(f"belongs to another user (uid {user})") == 2
    assert "until this process ends" in message


@pytest.mark.parametrize("trap", ["open to all", "link", "file", "dangling link"])
def test_nothing_that_lies_ready_among_the_temporary_files_is_trusted(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], trap: str
) -> None:
    own = places / "own"
    own.mkdir(mode=0o700)
    if trap == "open to all":
        shared(places).mkdir()
        shared(places).chmod(0o777)
    elif trap == "link":
        shared(places).symlink_to(own)
    elif trap == "dangling link":
        shared(places).symlink_to(places / "nothing")
    else:
        shared(places).write_text("a file")
    (places / "file").write_text("a file where the folder should be")
    monkeypatch.setenv(cache_folder.VARIABLE, str(places / "file"))
    folder = cache_folder.cache_folder()
    assert folder is not None
    assert folder not in (shared(places), own)
    assert is_private(folder)
    assert list(own.iterdir()) == []
    assert not (places / "nothing").exists()
    assert capsys.readouterr().err.count("\n") == 1


def test_a_private_folder_is_removed_at_the_end_of_its_process(places: Path) -> None:
    shared(places).write_text("a file where the folder should be")
    code = "from teamsight.core.kernel.cache import cache_folder; f = cache_folder(); print(f, f.is_dir())"
    environment = dict(
        os.environ,
        TEAMSIGHT_CACHE_DIR=str(shared(places)),
        TMPDIR=str(places / "temporary"),
        PYTHONDONTWRITEBYTECODE="1",
    )
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=Path(__file__).parents[4], capture_output=True, text=True
    )
    folder, existed = done.stdout.split()
    assert existed == "True", done.stderr
    assert not Path(folder).exists()
    assert list((places / "temporary").iterdir()) == [shared(places)]


def test_without_any_place_there_is_no_folder(
    places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (places / "file").write_text("a file where the folder should be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(places / "file"))
    monkeypatch.setattr(tempfile, "tempdir", str(places / "file"))
    assert cache_folder.cache_folder() is None
    assert capsys.readouterr().err.count("\n") == 1


def test_an_unwritable_home_is_no_news(places: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (places / "home").write_text("a file where the folder should be")
    assert cache_folder.cache_folder() == shared(places)
    assert capsys.readouterr().err == ""


def test_a_user_without_a_home_gets_no_folder_named_after_the_tilde(
    places: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *names, **options: "~/.cache/teamsight")
    monkeypatch.chdir(places)
    assert cache_folder.cache_folder() == shared(places)
    assert not (places / "~").exists()


def test_files_are_written_for_the_user_alone_and_at_once(places: Path) -> None:
    file = places / "entry"
    for content in (b"one", b"two"):
        cache_folder.write(file, content)
        assert cache_folder.read(file) == content
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert sorted(path.name for path in places.iterdir()) == ["entry", "temporary"]


def test_files_that_others_control_are_not_read(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = places / "entry"
    cache_folder.write(file, b"content")
    (places / "link").symlink_to(file)
    os.mkfifo(places / "pipe")
    (places / "folder").mkdir()
    for name in ("link", "pipe", "folder", "missing"):
        assert cache_folder.read(places / name) is None, name
    for mode in (0o620, 0o602):
        file.chmod(mode)
        assert cache_folder.read(file) is None
    file.chmod(0o644)
    assert cache_folder.read(file) == b"content"
    monkeypatch.setattr(os, "geteuid", lambda: 123456)
    assert cache_folder.read(file) is None


def test_failing_to_write_is_no_error_and_leaves_nothing(places: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cache_folder.write(places / "missing" / "entry", b"content")
    (places / "folder").mkdir()
    cache_folder.write(places / "folder", b"content")

    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    monkeypatch.setattr(Path, "replace", full)
    cache_folder.write(places / "entry", b"content")
    assert sorted(path.name for path in places.iterdir()) == ["folder", "temporary"]


@pytest.mark.parametrize("name", ["x" * 5000, "\x1b[31mred\nline", "x" * 200])
def test_a_notice_is_one_short_line_that_a_terminal_can_show(
    name: str, places: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = places / name
    if len(name) < 1000:
        file.write_text("a file where the folder should be")
    monkeypatch.setenv("TEAMSIGHT_CACHE_DIR", str(file))
    assert cache_folder.cache_folder() == shared(places)
    notice = capsys.readouterr().err
    assert len(notice) < 500
    assert notice.removesuffix("\n").isprintable()
