"""``teamsight verify``: damaged parts are set aside, and their runs made again, and no others."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import sweep
from teamsight.cli import main


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["verify", *map(str, arguments)])
    return int(left.value.code or 0), *capsys.readouterr()


def made(path: Path, replicates: int = 4, *, steps: bool = False) -> StudyFolder:
    """Return the folder of a study whose replicates were made one by one, so that there are as many parts."""
    for count in range(1, replicates + 1):
        one = Study(fixed={"targets": 2}, axes={"robots": [2, 3]}, replicates=count, steps=5, record={"steps": steps})
        sweep(one, path)
    return StudyFolder(path)


def contents(path: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for kind in ("runs", "steps") for each in (path / kind).glob("*.parquet")}


def test_a_whole_study_is_left_alone(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    made(tmp_path)
    before = contents(tmp_path)
    status, out, _ = call(capsys, tmp_path)
    assert (status, out) == (0, f"4 parts in {tmp_path}: all whole\n")
    assert contents(tmp_path) == before


@pytest.mark.parametrize("kind", ["runs", "steps"])
def test_runs_of_damaged_parts_are_made_again_to_the_same_bytes(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, kind: str
) -> None:
    made(tmp_path, steps=True)
    before = contents(tmp_path)
    victim = sorted((tmp_path / kind).iterdir())[2]
    victim.write_bytes(victim.read_bytes()[:-1])
    damaged = contents(tmp_path)
    status, out, _ = call(capsys, tmp_path, "--dry-run")
    assert (status, contents(tmp_path)) == (1, damaged)
    assert f"damaged: {kind}/{victim.name} is cut off" in out
    assert "nothing was changed" in out
    status, out, _ = call(capsys, tmp_path, "--workers", "1")
    assert status == 1
    assert "8 parts" in out
    assert "2 parts set aside" in out
    assert "2 runs made again" in out
    assert contents(tmp_path) == before
    assert (tmp_path / "damaged" / kind / victim.name).read_bytes() == damaged[victim.name]
    assert call(capsys, tmp_path)[0] == 0


def test_runs_that_were_missing_before_stay_missing(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = made(tmp_path, steps=True)
    first, second, *_ = sorted((tmp_path / "runs").iterdir())
    first.unlink()
    second.write_bytes(b"")
    assert "2 runs made again" in call(capsys, tmp_path, "--workers", "1")[1]
    assert folder.done().size == 6


def test_runs_of_unknown_names_are_made_if_none_was_missing_before(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = made(tmp_path)
    before = contents(tmp_path)
    victim = sorted((tmp_path / "runs").iterdir())[0]
    victim.write_bytes(b"")
    out = call(capsys, tmp_path, "--workers", "1")[1]
    assert "shards whose runs are not all known: 1" in out
    assert "2 runs made again" in out
    assert contents(tmp_path) == before
    assert folder.done().size == 8


def test_runs_of_unknown_names_stay_missing_if_others_were(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = made(tmp_path)
    with folder.recorded(engine="local", workers=1, code="x") as heartbeat:
        heartbeat.update(7, 8)
    next((tmp_path / "runs").iterdir()).write_bytes(b"")
    status, out, _ = call(capsys, tmp_path)
    assert (status, folder.done().size) == (1, 6)
    assert f"to make the missing runs: teamsight sweep STUDY --out {tmp_path}" in out


def test_without_a_repetition_the_next_command_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = made(tmp_path)
    next((tmp_path / "runs").iterdir()).write_bytes(b"")
    status, out, _ = call(capsys, tmp_path, "--no-rerun")
    assert status == 1
    assert f"teamsight sweep STUDY --out {tmp_path}" in out
    assert folder.done().size == 6


def test_files_that_are_no_parts_are_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    made(tmp_path, 1)
    (tmp_path / "runs" / "notes.txt").write_text("mine")
    status, out, _ = call(capsys, tmp_path)
    assert status == 0
    assert "runs/notes.txt: is no part of this study; move it away" in out
    assert (tmp_path / "runs" / "notes.txt").exists()


@pytest.mark.short
def test_a_running_sweep_is_not_disturbed(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with made(tmp_path, 1).lock():
        status, _, err = call(capsys, tmp_path)
        assert (status, "is in use (a sweep, process" in err, err.count("\n")) == (2, True, 1)
        assert call(capsys, tmp_path, "--dry-run")[0] == 0


@pytest.mark.short
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "nowhere: is not the folder of a study (it has no manifest.json); give one"),
        (["a", "--dry-run", "--workers", "2"], "workers=2: --dry-run repeats no runs; leave --workers out"),
        (["a", "--no-rerun", "--mixed-code"], "mixed_code=True: --no-rerun repeats no runs; leave --mixed-code out"),
    ],
)
def test_wrong_input_is_named(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    status, out, err = call(capsys, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err
