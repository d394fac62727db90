"""``teamsight status``: numbers, failures and who runs a study; it never writes."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import pytest

from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.study import Until
from teamsight.cli import main

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis" / "studies" / "folder"))

from made_parts import failed_part, fill, names, part, prepared, runs_of, study

pytestmark = pytest.mark.short


def call(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["status", *map(str, arguments)])
    return int(left.value.code or 0), *capsys.readouterr()


def half_done(path: Path) -> StudyFolder:
    """Return a folder with 5 runs that are done, 2 that failed and 5 that are missing."""
    folder = prepared(path, study(name="walkers"))
    plan = folder.study.plan()
    runs = runs_of(plan)
    parts = {"runs": part(plan, runs[:5]), "failed": failed_part(plan, runs[5:7])}
    folder.write(parts, names(plan, runs[:7]))
    return folder


def test_the_numbers_add_up(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = half_done(tmp_path)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    status, out, err = call(capsys, tmp_path)
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == f"study 'walkers' in {tmp_path}: 12 runs of cmommt"
    assert [line.split() for line in lines[1:4]] == [
        ["done", "5", "41.7", "%"], ["failed", "2", "16.7", "%"], ["missing", "5", "41.7", "%"]
    ]  # fmt: skip
    assert lines[4] == f"no sweep is running; to continue: teamsight sweep STUDY --out {tmp_path}"
    first = sorted(names(folder.study.plan(), runs_of(folder.study.plan())[5:7]))[0]
    assert lines[5].startswith(f"failed: run {first}, seed ")
    assert lines[5].endswith(": no more batteries")
    assert lines[7] == f"to repeat one alone: teamsight rerun {tmp_path} {first}"
    assert "made with teamsight " in lines[8]
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


def test_json_has_all_of_it(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = half_done(tmp_path)
    with folder.lock(), folder.recorded(engine="local", workers=2, code="x") as heartbeat:
        heartbeat.update(5, 12, failed=2, running=4)
        found = json.loads(call(capsys, tmp_path, "--json")[1])
    counts = [found[name] for name in ("planned", "done", "failed", "missing", "running")]
    assert counts == [12, 5, 2, 5, 4]
    assert [failure["error"] for failure in found["failures"]] == ["no more batteries"] * 2
    assert (found["sweeps"][0]["pid"], found["sweeps"][0]["workers"]) == (os.getpid(), 2)


def test_settings_at_the_limit_are_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = prepared(tmp_path, study(until=Until(0.001, limit=5)))
    fill(folder, study(replicates=5).plan(), 5)
    status, out, _ = call(capsys, tmp_path)
    assert status == 0
    assert out.splitlines()[4].startswith("3 of 3 settings reached until.limit=5 with an interval wider than 0.001; raise")
    assert json.loads(call(capsys, tmp_path, "--json")[1])["wide"] == 3


def test_who_runs_it_is_shown(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = half_done(tmp_path)
    with folder.lock(), folder.recorded(engine="local", workers=2, code="x") as heartbeat:
        heartbeat.update(5, 12, failed=2, running=4)
        out = call(capsys, tmp_path)[1]
    assert f"running: a sweep, process {os.getpid()} on " in out
    assert "(local, 2 workers)" in out
    assert "of which 4 running" in out
    assert "no sweep" not in out


def test_failed_lists_all(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = prepared(tmp_path, study(replicates=9))
    plan = folder.study.plan()
    folder.write({"failed": failed_part(plan, runs_of(plan))}, names(plan, runs_of(plan)))
    assert call(capsys, tmp_path)[1].count("failed: run") == 5
    assert "and 22 more; --failed lists all" in call(capsys, tmp_path)[1]
    assert call(capsys, tmp_path, "--failed")[1].count("failed: run") == 27


def test_a_study_that_is_almost_done_is_not_at_100_percent(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = prepared(tmp_path, study(replicates=1000))
    plan = folder.study.plan()
    folder.write({"runs": part(plan, runs_of(plan)[1:])}, ["x"])
    done, failed, missing = call(capsys, tmp_path)[1].splitlines()[1:4]
    assert ("99.9 %" in done, "0.0 %" in failed, "0.1 %" in missing) == (True, True, True)
    assert "2,999" in done


def test_damaged_parts_are_named_with_the_cure(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    folder = prepared(tmp_path)
    fill(folder, folder.study.plan())
    victim = next((tmp_path / "runs").iterdir())
    victim.write_bytes(b"")
    status, out, _ = call(capsys, tmp_path)
    assert status == 0
    assert f"damaged: runs/{victim.name} is empty" in out
    assert f"teamsight verify {tmp_path}" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "nowhere: is not the folder of a study (it has no manifest.json); give one"),
        ([], "Missing argument 'DIR'"),
        (["a", "b"], "unexpected extra argument"),
        ([""], "folder='': is empty; give a folder"),
        (["--failing", "a"], "No such option"),
    ],
)
def test_wrong_input_is_named(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    status, out, err = call(capsys, *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err
