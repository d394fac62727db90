"""The folder of a study: each new name is brought to disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.analysis.studies.folder.parts import make_folder
from teamsight.core import files


@pytest.mark.short
def test_each_new_folder_is_brought_to_disk_after_the_one_above(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[str, list[str]]] = []
    monkeypatch.setattr(
        files, "sync_folder", lambda folder: synced.append((folder.name, [each.name for each in folder.iterdir()]))
    )
    make_folder(tmp_path / "a" / "b" / "c", parents=True)
    assert synced == [(tmp_path.name, ["a"]), ("a", ["b"]), ("b", ["c"])]
    make_folder(tmp_path / "a" / "b" / "c", parents=True)
    assert len(synced) == 3
