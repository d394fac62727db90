"""``teamsight sweep`` and ``teamsight rerun``: exit status, what they print, and what they refuse."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from teamsight.analysis.runs import checkpoint
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.cli import main

ROOT = Path(__file__).parents[2]
STUDY = """
replicates = 2
steps = 5

[fixed]
targets = 3
policy = "a-cmommt"

[axes]
robots = [2, 5]
radius = [2.0, 3.5]
"""
MODELS = """
import time
from teamsight import CMOMMT

def raising(robots=2, bad=1, *, rng):
    if robots == bad:
        raise RuntimeError(f"no team of {robots}")
    return CMOMMT(robots=robots, targets=2, policy="a-cmommt", rng=rng)

def slow(robots=2, *, rng):
    time.sleep(0.05)
    return CMOMMT(robots=robots, targets=2, policy="a-cmommt", rng=rng)
"""
NOT_FINITE = """
def measured(world, steps):
    world.run(steps)
    team = len(world.robots)
    ratio = {1: float("nan"), 3: None}.get(team, 0.5)
    return {"ratio": ratio, "time": float("inf") if team == 2 else ratio, "size": float(team)}
"""
RAISING = 'model = "models_of_a_user:raising"\nsteps = 5\n[fixed]\nbad = 2\n[axes]\nrobots = [1, 2, 3]\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a study file and models, which is the current one."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "raising.toml").write_text(RAISING)
    (tmp_path / "models_of_a_user.py").write_text(MODELS)
    sys.modules.pop("models_of_a_user", None)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, list[str], str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out.splitlines(), err


def sweep(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, list[str], str]:
    return call(capsys, "sweep", *arguments, "--out", "out", "--workers", "1")


@pytest.mark.short
def test_a_study_is_made_continued_and_extended(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = sweep(capsys, "study.toml")
    assert (status, err) == (0, "")
    assert re.fullmatch(r"8 runs made in \d+ s; out has 8 done of 8 runs", out[0])
    assert out[1] == "next: teamsight plot out --out figure.png"
    status, out, _ = sweep(capsys, "study.toml")
    assert (status, out[0].split(" in ")[0]) == (0, "0 runs made")
    (folder / "study.toml").write_text(STUDY.replace("replicates = 2", "replicates = 3"))
    status, out, _ = sweep(capsys, "study.toml")
    assert (status, out[0].split(" in ")[0]) == (0, "4 runs made")
    (folder / "study.toml").write_text(STUDY.replace("steps = 5", "steps = 6"))
    status, _, err = sweep(capsys, "study.toml")
    assert (status, "steps: 5 in the folder, 6 now" in err, err.count("\n")) == (2, True, 1)


@pytest.mark.short
def test_parts_of_a_job_array(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for part in ("2/2", "1/2"):
        status, out, _ = sweep(capsys, "study.toml", "--shard", part)
        assert (status, out[0].split("; ")[1]) == (0, f"out has 4 done of 4 runs of shard {part}")
    assert sweep(capsys, "study.toml")[1][0].split(" in ")[0] == "0 runs made"


@pytest.mark.short
def test_failed_runs_and_their_repetition(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = sweep(capsys, "raising.toml")
    assert status == 1
    (found,) = re.finditer(r"run ([0-9a-f]{16}-0) failed: RuntimeError: no team of 2\n", err)
    assert out[0].endswith("out has 2 done, 1 failed of 3 runs")
    assert out[1:] == [f"next: teamsight rerun out {found[1]}"]
    status, out, err = call(capsys, "rerun", "out", found[1])
    assert status == 1
    assert out[0].startswith(f"run {found[1]}: bad=2, robots=2, steps=5, rng=")
    assert out[1] == "failed: RuntimeError: no team of 2; as it did in the sweep"
    assert 'raise RuntimeError(f"no team of {robots}")' in err
    # It is failed still, and is not made again unless that is asked for.
    status, out, _ = sweep(capsys, "raising.toml")
    assert (status, out[0].split(" in ")[0]) == (1, "0 runs made")
    status, out, _ = sweep(capsys, "raising.toml", "--retry-failed")
    assert (status, out[0].split(" in ")[0]) == (1, "1 run made")
    # Of many failed runs the first is named at once, others at the end, and the rest are counted.
    Path("raising.toml").write_text(f"replicates = 9\n{RAISING}")
    status, out, err = call(capsys, "sweep", "raising.toml", "--out", "a folder", "--workers", "1")
    assert err.count(" failed: ") == 1
    assert [line.partition(" failed: ")[2] for line in out[1:5]] == ["RuntimeError: no team of 2"] * 4
    assert out[0].endswith("9 failed of 27 runs")
    assert out[5] == "and 4 more: teamsight status 'a folder' --failed"
    assert out[-1].startswith("next: teamsight rerun 'a folder' ")


@pytest.mark.short
def test_runs_whose_measures_are_nan_or_infinite_are_counted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What has no value, None, is not among them."""
    (folder / "measures_of_a_user.py").write_text(NOT_FINITE)
    text = 'replicates = 2\nsteps = 2\nrecord.measure = "measures_of_a_user:measured"\nfixed.targets = 2\n'
    (folder / "odd.toml").write_text(f'{text}fixed.policy = "a-cmommt"\naxes.robots = [1, 2, 3, 4]\n')
    status, out, err = sweep(capsys, "odd.toml")
    note = "NaN or infinite: ratio in 2 runs, time in 4 runs; these runs count as done"
    assert (status, err) == (0, "")
    assert out[1] == note
    assert note in call(capsys, "status", "out")[1]
    shown = json.loads(call(capsys, "status", "out", "--json")[1][0])
    assert (shown["done"], shown["not_finite"]) == (8, {"ratio": 2, "time": 4})


@pytest.mark.usefixtures("folder")
def test_a_study_of_finite_measures_says_nothing_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert not any("NaN" in line for line in sweep(capsys, "study.toml")[1] + call(capsys, "status", "out")[1])


def test_the_debugger_opens_where_the_run_fails(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    err = sweep(capsys, "raising.toml", "--on-error", "stop")[2]
    run = err.partition("run ")[2].split()[0]
    seen: list[str] = []

    def look(trace: object) -> None:
        while trace.tb_next:  # type: ignore[attr-defined]
            trace = trace.tb_next  # type: ignore[attr-defined]
        seen.append(trace.tb_frame.f_code.co_name)  # type: ignore[attr-defined]

    monkeypatch.setattr("pdb.post_mortem", look)
    assert call(capsys, "rerun", "out", run, "--pdb")[0] == 1
    assert seen == ["raising"]


@pytest.mark.short
def test_a_repeated_run_is_compared_to_the_last_bit(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sweep(capsys, "study.toml")
    run = StudyFolder("out").done().names()[0]
    status, out, _ = call(capsys, "rerun", "out", run)
    assert (status, out[1]) == (0, "the same as what is stored, to the last bit")
    # The same number with its last bit changed.
    (part,) = (folder / "out" / "runs").glob("*.parquet")
    table = pq.read_table(part)
    values = table["mean_neighbours"].to_pylist()
    place = table.column_names.index("mean_neighbours")
    changed = [value + 2**-50 for value in values]
    place_of = StudyFolder(folder / "other")
    sweep_other = call(capsys, "sweep", "study.toml", "--out", "other", "--workers", "1")
    assert sweep_other[0] == 0
    for path in (folder / "other" / "runs").glob("*.parquet"):
        path.unlink()
    buffer = pa.BufferOutputStream()
    pq.write_table(table.set_column(place, "mean_neighbours", pa.array(changed)), buffer)
    runs = [f"{setting}-{replicate}" for setting, replicate in zip(*(table[name].to_pylist() for name in ("setting", "replicate")), strict=True)]
    place_of.write({"runs": buffer.getvalue().to_pybytes()}, runs)
    status, out, _ = call(capsys, "rerun", "other", run)
    assert (status, out[1]) == (1, "differs from what is stored")
    assert len([line for line in out if "   stored: " in line]) == 1


@pytest.mark.short
def test_a_repeated_run_says_that_the_code_has_changed(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep(capsys, "study.toml")
    run = StudyFolder("out").done().names()[0]
    monkeypatch.setattr(checkpoint, "code_digest", lambda *modules: "0123456789abcdef")
    assert "note: teamsight has changed since the sweep" in call(capsys, "rerun", "out", run)[1]


@pytest.mark.short
@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["rerun", "out", "x"], "run='x': is no run id; copy one from the table"),
        (["rerun", "out", "0123456789abcdef-0"], "out has no such setting"),
        (["rerun", "out", "RUN-2"], "replicates are numbered from 0 to 1"),
        (["rerun", ".", "0123456789abcdef-0"], "is not the folder of a study"),
        (["sweep", "none.toml", "--out", "out"], "none.toml: cannot be read"),
        (["sweep", "study.toml"], "Missing option '--out'"),
        (["sweep", "study.toml", "--out", "study.toml"], "study.toml"),
        (["sweep", "study.toml", "--out", "out", "--shard", "3/2"], "shard='3/2': must be i/n with i from 1 to n; give, for example, 1/8"),
        (["sweep", "study.toml", "--out", "out", "--shard", "2"], "shard='2': must be i/n"),
        (["sweep", "study.toml", "--out", "out", "--engine", "ray"], "engine='ray': unknown"),
        (["sweep", "study.toml", "--out", "out", "--on-error", "ignore"], "on_error='ignore': unknown"),
        (["sweep", "study.toml", "--out", "out", "--scheduler", "tcp://x"], "scheduler=tcp://x: is for Dask; give --engine dask"),
        (["sweep", "study.toml", "--out", "out", "--tls-ca", "x"], "tls_ca=x: is for Dask; give --engine dask"),
    ],
)  # fmt: skip
def test_wrong_input_is_refused_in_one_line(
    line: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sweep(capsys, "study.toml")
    setting = StudyFolder("out").done().names()[0].split("-")[0]
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    status, out, err = call(capsys, *[word.replace("RUN", setting) for word in line])
    assert (status, out, err.count("\n")) == (2, [], 1), err
    assert message in err
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.skipif(not hasattr(signal, "SIGINT") or sys.platform == "win32", reason="sends a signal")
def test_sigterm_does_what_ctrl_c_does_and_says_what_is_kept(folder: Path) -> None:
    (folder / "slow.toml").write_text('model = "models_of_a_user:slow"\nreplicates = 2000\nsteps = 2\n')
    process = subprocess.Popen(
        [sys.executable, "-m", "teamsight", "sweep", "slow.toml", "--out", "out", "--workers", "1"],
        cwd=folder, env=dict(os.environ, PYTHONPATH=str(ROOT)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        while not list((folder / "out" / "runs").glob("*.parquet")):
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate()
    finally:
        process.kill()
    assert (process.returncode, out) == (130, "")
    kept = StudyFolder(folder / "out").done().size
    assert err.strip().splitlines()[-1] == (
        f"teamsight: interrupted; {kept} of 2000 runs are kept in out; the same command continues from there"
    )


def test_a_second_sweep_of_a_folder_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with StudyFolder("out").lock():
        found = subprocess.run(
            [sys.executable, "-m", "teamsight", "sweep", "study.toml", "--out", "out", "--workers", "1"],
            cwd=folder, env=dict(os.environ, PYTHONPATH=str(ROOT)), capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert (found.returncode, found.stdout) == (2, "")
        assert str(os.getpid()) in found.stderr
        assert found.stderr.count("\n") == 1
    assert sweep(capsys, "study.toml")[0] == 0
