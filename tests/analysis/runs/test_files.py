"""Files appear complete or not at all."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.runs import files


def test_a_table_comes_back_with_its_metadata(tmp_path: Path) -> None:
    table = pd.DataFrame({"robots": [1, 2], "seed": [2**63 - 1, 0], "observed_fraction": [0.25, 1 / 3]})
    files.write_table(tmp_path / "t.parquet", table, {"seed": 7, "settings": {"robot_speed": 0.1}, "version": "0.1.0"})
    back = pd.read_parquet(tmp_path / "t.parquet")
    pd.testing.assert_frame_equal(back, table)
    assert back.attrs == {"seed": 7, "settings": {"robot_speed": 0.1}, "version": "0.1.0"}
    assert table.attrs == {}


def test_json_and_text_are_utf8(tmp_path: Path) -> None:
    files.write_json(tmp_path / "j.json", {"δ": [1, 2.5, None]})
    assert json.loads((tmp_path / "j.json").read_text(encoding="utf-8")) == {"δ": [1, 2.5, None]}
    with pytest.raises(ValueError, match="JSON compliant"):
        files.write_json(tmp_path / "j.json", float("nan"))
    assert json.loads((tmp_path / "j.json").read_text(encoding="utf-8"))["δ"] == [1, 2.5, None]


@pytest.mark.parametrize("trouble", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, trouble: type[BaseException]
) -> None:
    def write_half() -> None:
        with files.complete(tmp_path / "result.md") as draft:
            draft.write(b"half")
            raise trouble

    files.write_bytes(tmp_path / "result.md", b"old")
    with pytest.raises(trouble):
        write_half()
    assert [path.name for path in tmp_path.iterdir()] == ["result.md"]
    assert (tmp_path / "result.md").read_text() == "old"


def test_a_folder_is_made(tmp_path: Path) -> None:
    assert files.prepare_folder(tmp_path / "a" / "b").is_dir()
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_an_unwritable_place_is_reported_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(files.UnwritableError, match=r"file/sub: cannot be written \(Not a directory\)") as caught:
        files.prepare_folder(tmp_path / "file" / "sub")
    assert "\n" not in str(caught.value)
    with pytest.raises(files.UnwritableError, match="gone"):
        files.write_bytes(tmp_path / "gone" / "x.md", b"text")


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_reported_before_any_work(tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    with pytest.raises(files.UnwritableError, match="Permission denied"):
        files.prepare_folder(folder)


def full(*given: Any) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("failing", ["fsync", "replace", "open"])
def test_a_full_disk_is_one_line_and_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    path = tmp_path / "t.parquet"
    table = pd.DataFrame({"x": range(10)})
    files.write_table(path, table, {"seed": 1})
    before = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(os, failing, full)
        with pytest.raises(
            files.UnwritableError, match=r"^[^\n]*t.parquet: cannot be written \(No space left on device\); give"
        ):
            files.write_table(path, table, {"seed": 2})
    assert (path.read_bytes(), os.listdir(tmp_path)) == (before, [path.name])


def test_a_file_that_grows_too_large_is_one_line_and_loses_nothing(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    files.write_table(tmp_path / "t", pd.DataFrame({"x": [1.0]}), {})
    before = (tmp_path / "t").read_bytes()
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(files.UnwritableError, match="t: cannot be written .File too large."):
            files.write_table(tmp_path / "t", pd.DataFrame({"x": [n**0.5 for n in range(100_000)]}), {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert ((tmp_path / "t").read_bytes(), os.listdir(tmp_path)) == (before, ["t"])


def test_the_draft_is_made_exclusively_under_a_name_of_its_own(tmp_path: Path) -> None:
    names = []
    for _ in range(2):
        with files.complete(tmp_path / ("x" * 250)) as draft:
            names += os.listdir(tmp_path)
            assert not stat.S_IMODE(os.fstat(draft.fileno()).st_mode) & 0o111
        os.unlink(tmp_path / ("x" * 250))
    assert len(set(names)) == 2
    assert os.listdir(tmp_path) == []


def test_what_takes_the_place_meanwhile_stays(tmp_path: Path) -> None:
    path = tmp_path / "t"

    def write() -> None:
        with files.complete(path, files.check_replaceable) as draft:
            draft.write(b"mine")
            path.write_text("theirs")

    with pytest.raises(ValueError, match="t: holds something else; give --force"):
        write()
    assert (path.read_text(), os.listdir(tmp_path)) == ("theirs", ["t"])


def test_pandas_gets_no_name_that_it_could_read_in_another_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    Path("~").mkdir()
    for name in (str(tmp_path / "~" / "t.parquet"), "t.parquet.gz", "memory:x"):
        files.write_table(name, pd.DataFrame({"x": [1]}), {})
        with open(name, "rb") as file:
            assert pd.read_parquet(file)["x"].tolist() == [1]
    assert not (tmp_path / "home").exists()


def test_each_kind_of_result_is_known_again(tmp_path: Path) -> None:
    for _ in range(2):
        files.write_table(tmp_path / "t", pd.DataFrame({"x": [1]}), {"seed": 1})
        files.write_page(tmp_path / "p", "text")
        files.write_json(tmp_path / "j", {"software": "teamsight"})
    files.check_replaceable(tmp_path / "t", {"seed": 1})
    for about in ({"seed": 2}, {"more": 1}):
        with pytest.raises(
            ValueError, match=r"t: holds results of other settings; give --force \(in Python, force=True\)"
        ):
            files.check_replaceable(tmp_path / "t", about)
    files.check_replaceable(tmp_path / "t", {"seed": 2}, force=True)
    files.write_bytes(tmp_path / "b", b"anything")
    with pytest.raises(ValueError, match="b: holds something else"):
        files.write_bytes(tmp_path / "b", b"more")
    files.write_bytes(tmp_path / "b", b"more", force=True)


@pytest.mark.parametrize(
    ("name", "message"),
    [("~/x", "'~/x': ~ is not expanded; give Path"), ("", "is empty; give a"), ("a\0b", "null character; remove it")],
)
def test_a_place_that_cannot_be_meant_is_refused(
    name: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for write in (files.prepare_folder, lambda path: files.write_bytes(path, b"text")):
        with pytest.raises(files.UnwritableError, match=message):
            write(name)
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_fills_while_a_memory_is_saved_is_named(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    memory = explore(Exploration())
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(ValueError, match="cannot be written .File too large."):
            memory.save(tmp_path / "m")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert os.listdir(tmp_path) == []
