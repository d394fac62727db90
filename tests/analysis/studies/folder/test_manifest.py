"""The manifest: damaged, of a newer version, or of somebody else; each gives one line with the cure."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from made_parts import prepared, study

from teamsight.analysis.studies.folder.study_folder import StudyFolder

pytestmark = pytest.mark.short


def changed(path: Path, **values: object) -> bytes:
    return json.dumps(json.loads(path.read_bytes()) | values).encode()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "it is not JSON"),
        (b"{", "it is not JSON"),
        (b"[" * 100_000, "it is not JSON"),
        (b"\xff\xfe", "it is not JSON"),
        (b"[]", "teamsight did not write it"),
        (b'{"software": "other"}', "teamsight did not write it"),
        (b'{"software": "teamsight", "format": 1}', "its digest differs"),
    ],
)
def test_a_damaged_manifest_is_refused_with_the_cure(tmp_path: Path, content: bytes, words: str) -> None:
    folder = prepared(tmp_path)
    (tmp_path / "manifest.json").write_bytes(content)
    with pytest.raises(ValueError, match=rf"{words}\); restore it from a copy, or move it away") as caught:
        _ = folder.study
    assert "\n" not in str(caught.value)
    with pytest.raises(ValueError, match="restore it"):
        prepared(tmp_path)
    assert (tmp_path / "manifest.json").read_bytes() == content


def test_every_flipped_bit_is_found(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    path = tmp_path / "manifest.json"
    whole, before = path.read_bytes(), folder.manifest
    found = 0
    for place in range(0, len(whole), 5):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        try:
            # A flipped space between values changes nothing.
            assert folder.manifest == before
        except ValueError:
            found += 1
    assert found > len(whole) / 5 * 0.8


def test_a_manifest_of_a_newer_version_says_so(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    path = tmp_path / "manifest.json"
    path.write_bytes(changed(path, format=7, study={"unknown": 1}))
    with pytest.raises(ValueError, match="was written by teamsight .* in format 7, and this one reads format 1 only; use that version"):
        _ = folder.manifest


def test_a_change_by_hand_is_found(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    path = tmp_path / "manifest.json"
    path.write_bytes(changed(path, code="0"))
    with pytest.raises(ValueError, match="its digest differs"):
        _ = folder.manifest


def test_all_numbers_return_to_the_last_bit(tmp_path: Path) -> None:
    radii = [0.1 + 0.2, 1e-17 + 1, 5e-324, 1.7976931348623157e308, 2.0]
    one = study(robots=(2,), name='a "quoted" nämé\u2028', seed=2**63 - 1)
    from teamsight.analysis.studies.study import Study

    one = Study.from_dict(one.as_dict() | {"axes": {"radius": radii}})
    found = prepared(tmp_path, one).study
    assert found == one
    assert StudyFolder(tmp_path).study.plan().ids.tolist() == one.plan().ids.tolist()


def test_a_study_that_moves_takes_its_folder_along(tmp_path: Path) -> None:
    from teamsight.analysis.studies.study import Study

    places = [tmp_path / "here", tmp_path / "there"]
    for place in places:
        place.mkdir()
        one = Study.from_dict(study().as_dict() | {"path": str(place)})
        folder = prepared(tmp_path / "out", one)
        assert Path(folder.study.path or "") == place
