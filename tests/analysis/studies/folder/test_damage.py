"""Damaged, foreign and strange files among the parts: none counts, each is named, none is deleted."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from made_parts import content, failed_part, fill, names, part, prepared, runs_of, shards, study, table

from teamsight.analysis.studies.folder.parts import DamagedError
from teamsight.analysis.studies.folder.study_folder import StudyFolder, Verification, verify
from teamsight.analysis.studies.study import Record


def flipped(content: bytes, place: int, bit: int = 0) -> bytes:
    return content[:place] + bytes([content[place] ^ (1 << bit)]) + content[place + 1 :]


DAMAGE = {
    "empty": lambda whole: b"",
    "cut off": lambda whole: whole[: len(whole) // 2],
    "one byte short": lambda whole: whole[:-1],
    "one byte more": lambda whole: whole + b"1",
    "first magic": lambda whole: flipped(whole, 0),
    "pages": lambda whole: flipped(whole, 40, 3),
    "footer": lambda whole: flipped(whole, len(whole) - 100, 7),
    "length of the footer": lambda whole: flipped(whole, len(whole) - 8, 6),
    "last magic": lambda whole: flipped(whole, len(whole) - 1),
    "zeros, as after a power cut": lambda whole: bytes(len(whole)),
    "another file": lambda whole: b"%PDF-1.4" + whole,
}


def damaged_folder(path: Path, how: str, kind: str = "runs") -> tuple[StudyFolder, Path]:
    """Return a folder with steps of which one part is damaged, and that part."""
    folder = prepared(path)
    fill(folder, folder.study.plan(), steps=True)
    victim = sorted((path / kind).iterdir())[1]
    victim.write_bytes(DAMAGE[how](victim.read_bytes()))
    return folder, victim


def runs_in_shard(folder: StudyFolder, victim: Path) -> set[str]:
    from teamsight.analysis.studies.folder.parts import shard_of

    plan = folder.study.plan()
    (found,) = [names(plan, runs) for runs in shards(plan) if shard_of(names(plan, runs)) == victim.name[:16]]
    return set(found)


@pytest.mark.short
@pytest.mark.parametrize("how", DAMAGE)
def test_runs_of_a_damaged_part_are_missing(tmp_path: Path, how: str) -> None:
    folder, victim = damaged_folder(tmp_path, how)
    missing = runs_in_shard(folder, victim)
    assert set(folder.done().names()) == set(names(folder.study.plan(), runs_of(folder.study.plan()))) - missing
    with pytest.raises(DamagedError, match=rf"{victim.name}: .*; run teamsight verify") as caught:
        folder.read("runs")
    assert "\n" not in str(caught.value)
    bytes_then = victim.read_bytes()
    assert [(each.kind, each.name) for each in folder.tidy()] == [("runs", victim.name)]
    assert (tmp_path / "damaged" / "runs" / victim.name).read_bytes() == bytes_then
    assert folder.read("runs").num_rows == folder.done().size == 9


@pytest.mark.parametrize("how", DAMAGE)
@pytest.mark.parametrize("kind", ["runs", "steps"])
def test_verify_names_the_runs_and_sets_all_parts_of_the_shard_aside(tmp_path: Path, how: str, kind: str) -> None:
    folder, victim = damaged_folder(tmp_path, how, kind)
    missing = runs_in_shard(folder, victim)
    before = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    found = verify(tmp_path, repair=False)
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == before
    assert (found.parts, found.aside, found.unnamed) == (8, (), 0)
    assert [(each.kind, each.name) for each in found.damaged] == [(kind, victim.name)]
    assert set(found.runs) == missing
    repaired = verify(tmp_path)
    assert repaired.damaged == found.damaged
    assert sorted(place.partition("/")[2].partition("/")[0] for place in repaired.aside) == ["runs", "steps"]
    assert all((tmp_path / place).is_file() for place in repaired.aside)
    assert verify(tmp_path) == Verification(6, (), (), (), 0, (), 0)
    assert folder.done().size == 9
    plan = folder.study.plan()
    again = [run for run in runs_of(plan) if names(plan, [run])[0] in missing]
    folder.write({"runs": part(plan, again), "steps": part(plan, again, 5)}, missing)
    assert verify(tmp_path).parts == 8
    assert folder.read("steps").num_rows == 5 * plan.runs


def test_runs_that_only_a_damaged_part_has_are_not_named(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    victim = sorted((tmp_path / "runs").iterdir())[0]
    victim.write_bytes(b"")
    found = verify(tmp_path)
    assert (found.runs, found.unnamed, len(found.aside)) == ((), 1, 1)


def test_a_part_with_wrong_content_is_damaged_although_its_name_fits(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    good = table(plan, [(0, 0)])
    wrong = (
        good.drop_columns(["setting"]),
        good.drop_columns(["replicate"]).append_column("replicate", [["x"]]),
        good.drop_columns(["setting"]).append_column("setting", [["xyz"]]),
        good.drop_columns(["setting"]).append_column("setting", [[None]]),
    )
    for number, each in enumerate(wrong):
        folder.write({"runs": content(each)}, [str(number)])
    folder.write({"runs": b"PAR1 nothing PAR1"}, ["x"])
    assert folder.done().size == 0
    assert len(folder.tidy()) == len(verify(tmp_path).damaged) + 5 == 5


def test_parts_of_another_study_are_set_aside(tmp_path: Path) -> None:
    folder = prepared(tmp_path / "a")
    fill(folder, folder.study.plan())
    others = {"steps": study(steps=8), "settings": study(robots=(7,)), "seeds": study(seed=1)}
    for name, other in others.items():
        strange = prepared(tmp_path / name, other)
        fill(strange, other.plan(), 5)
        for path in (tmp_path / name / "runs").iterdir():
            (tmp_path / "a" / "runs" / path.name).write_bytes(path.read_bytes())
        found = verify(tmp_path / "a")
        assert found.damaged
        assert all("another study" in each.reason for each in found.damaged)
        assert folder.read("runs").num_rows == folder.done().size == 12
        assert not verify(tmp_path / "a").damaged


def test_a_lost_part_of_steps_is_found(tmp_path: Path) -> None:
    folder = prepared(tmp_path, study(record=Record(steps=True)))
    plan = folder.study.plan()
    fill(folder, plan, steps=True)
    assert not verify(tmp_path).damaged
    assert folder.done().size == 12
    lost = next((tmp_path / "steps").iterdir())
    lost.unlink()
    assert folder.done().size == StudyFolder(tmp_path).done().size == 9
    found = verify(tmp_path)
    assert [(each.kind, each.reason) for each in found.damaged] == [("runs", "its part of steps is lost")]
    assert found.damaged[0].name.startswith(lost.name[:16])
    assert (len(found.runs), found.unnamed, folder.done().size) == (3, 0, 9)


@pytest.mark.short
def test_files_that_are_no_parts_are_named_and_left(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    draft = tmp_path / "runs" / f".{'0' * 16}-{'1' * 16}.parquet.{'a' * 16}.part"
    foreign = [tmp_path / "runs" / name for name in ("notes.txt", "copy.parquet", "0" * 33 + ".parquet", ".DS_Store")]
    for path in (draft, *foreign):
        path.write_text("mine")
    assert folder.done().size == folder.read("runs").num_rows == 12
    assert verify(tmp_path, repair=False)[-2:] == (("runs/" + "0" * 33 + ".parquet", "runs/copy.parquet", "runs/notes.txt"), 1)
    assert draft.exists()
    assert not verify(tmp_path).damaged
    assert [path.exists() for path in (draft, *foreign)] == [False, True, True, True, True]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_what_is_no_file_is_damaged_and_never_read(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    places = [tmp_path / "runs" / f"{number:016x}-{number:016x}.parquet" for number in range(3)]
    places[0].mkdir()
    os.mkfifo(places[1])
    places[2].symlink_to(tmp_path / "nowhere")
    found = verify(tmp_path)
    assert {each.name for each in found.damaged} >= {places[0].name, places[1].name}
    assert folder.read("runs").num_rows == folder.done().size == 12
    assert folder.tidy() == []


def test_a_damaged_part_set_aside_twice_is_kept_twice(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    for _ in range(3):
        folder.write({"runs": part(plan, [(0, 0)])}, ["x"])
        next((tmp_path / "runs").iterdir()).write_bytes(b"")
        assert len(folder.tidy()) == 1
    assert len(list((tmp_path / "damaged" / "runs").iterdir())) == 3


def test_a_part_of_failed_runs_counts_too(tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    plan = folder.study.plan()
    two = [(0, 0), (0, 1)]
    folder.write({"runs": part(plan, two[:1]), "failed": failed_part(plan, two[1:])}, names(plan, two))
    victim = next((tmp_path / "failed").iterdir())
    victim.write_bytes(victim.read_bytes()[:-1])
    assert (folder.done().size, folder.failed().size) == (1, 0)
    found = verify(tmp_path)
    assert (list(found.runs), found.unnamed, len(found.aside)) == (names(plan, two[:1]), 1, 2)
    assert folder.done().size == 0
