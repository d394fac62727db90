"""Files appear complete or not at all."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis import store


def test_a_table_comes_back_with_its_metadata(tmp_path: Path) -> None:
    table = pd.DataFrame({"robots": [1, 2], "seed": [2**63 - 1, 0], "observed_fraction": [0.25, 1 / 3]})
    store.write_table(tmp_path / "t.parquet", table, {"seed": 7, "settings": {"robot_speed": 0.1}, "version": "0.1.0"})
    back = pd.read_parquet(tmp_path / "t.parquet")
    pd.testing.assert_frame_equal(back, table)
    assert back.attrs == {"seed": 7, "settings": {"robot_speed": 0.1}, "version": "0.1.0"}
    assert table.attrs == {}


def test_json_and_text_are_utf8(tmp_path: Path) -> None:
    store.write_json(tmp_path / "j.json", {"δ": [1, 2.5, None]})
    assert json.loads((tmp_path / "j.json").read_text(encoding="utf-8")) == {"δ": [1, 2.5, None]}
    with pytest.raises(ValueError, match="JSON compliant"):
        store.write_json(tmp_path / "j.json", float("nan"))
    assert json.loads((tmp_path / "j.json").read_text(encoding="utf-8"))["δ"] == [1, 2.5, None]


@pytest.mark.parametrize("trouble", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, trouble: type[BaseException]
) -> None:
    def write_half() -> None:
        with store.complete(tmp_path / "result.md") as draft:
            draft.write(b"half")
            raise trouble

    store.write_text(tmp_path / "result.md", "old")
    with pytest.raises(trouble):
        write_half()
    assert [path.name for path in tmp_path.iterdir()] == ["result.md"]
    assert (tmp_path / "result.md").read_text() == "old"


def test_a_folder_is_made(tmp_path: Path) -> None:
    assert store.prepare_folder(tmp_path / "a" / "b").is_dir()
    assert list((tmp_path / "a" / "b").iterdir()) == []


def test_an_unwritable_place_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(store.UnwritableError, match=r"file/sub: cannot be written \(Not a directory\)") as caught:
        store.prepare_folder(tmp_path / "file" / "sub")
    assert "\n" not in str(caught.value)
    with pytest.raises(store.UnwritableError, match="gone"):
        store.write_text(tmp_path / "gone" / "x.md", "text")


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_is_told_before_any_work(tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    with pytest.raises(store.UnwritableError, match="Permission denied"):
        store.prepare_folder(folder)
