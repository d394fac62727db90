"""``teamsight reproduce`` and ``teamsight run``, from the command to the files."""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from teamsight import CMOMMT, World, __version__
from teamsight.analysis.papers.touzet2000.claims import CLAIMS
from teamsight.cli import main
from teamsight.core.kernel import Entry

ROOT = Path(__file__).parents[2]
SHORTEST = ("--quick", "--runs", "1", "--steps", "2", "--preset", "defaults")
SHORT = ("--quick", "--runs", "2", "--steps", "12", "--preset", "defaults")


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


def test_figures_become_tables_with_seeds_and_pictures(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, _ = call(capsys, "reproduce", "3", "5", "8", "9", "--out", str(tmp_path), "--workers", "1", *SHORT)
    assert status == 0
    assert "figure 3, figure 5, figure 8, figure 9 in" in out
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [f"figure-{name}.{kind}" for name in (3, 5, 8, 9) for kind in ("parquet", "png")]
        + ["figure-3-links.parquet", "figure-5-cells.parquet", "figure-8-cells.parquet"]
    )
    table = pd.read_parquet(tmp_path / "figure-5.parquet")
    assert len(table) == 7 * 7 * 2
    row = table.iloc[-1]
    model = CMOMMT(robots=int(row["robots"]), radius=row["radius"], rng=int(row["seed"]))
    model.run(12)
    assert (model.max_neighbours, model.observed_fraction) == (row["max_neighbours"], row["observed_fraction"])
    assert {"seed": 2000, "steps": 12, "version": __version__}.items() <= table.attrs.items()


def test_the_ledger_is_printed_and_written(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, _ = call(capsys, "reproduce", "ledger", "--out", str(tmp_path), "--workers", "1", *SHORTEST)
    assert status == 0
    content = json.loads((tmp_path / "ledger.json").read_text(encoding="utf-8"))
    assert [record["claim"] for record in content["claims"]] == list(CLAIMS)
    lines = out.splitlines()
    for record in content["claims"]:
        (line,) = [line for line in lines if f" {record['claim']} " in line]
        assert len(line) <= 80
    decidable = sum(bool(claim.rule) for claim in CLAIMS.values())
    assert f"defaults: {content['holding']['defaults']} of {decidable} claims hold" in out
    assert (tmp_path / "ledger.md").read_text(encoding="utf-8").count("\n## ") == len(CLAIMS) + 1
    assert {"setting", "experiment", "seed"} <= set(pd.read_parquet(tmp_path / "ledger.parquet").columns)


def test_what_figure_11_comes_to_is_reported(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    short = ("--quick", "--runs", "2", "--steps", "3", "--preset", "defaults")
    _, out, _ = call(capsys, "reproduce", "11", "--out", str(tmp_path), "--workers", "1", *short)
    assert re.search(r"^figure 11: gain from awareness over 10 explorations: .* pp on average over all cells.*single explorations", out, re.M)


def test_results_do_not_depend_on_workers_or_on_what_else_is_made(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for folder, names, workers in (("one", ("7",), "1"), ("two", ("8", "7"), "2")):
        call(capsys, "reproduce", *names, "--out", str(tmp_path / folder), "--workers", workers, *SHORT)
    for kind in ("parquet", "png"):
        one, two = ((tmp_path / folder / f"figure-7.{kind}").read_bytes() for folder in ("one", "two"))
        assert one == two


def test_an_unwritable_folder_is_reported_before_the_work(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr("teamsight.analysis.papers.reproduction.Paper.reproduce", lambda *given, **more: pytest.fail("worked in vain"))
    status, _, err = call(capsys, "reproduce", "--out", str(tmp_path / "file" / "sub"), "--preset", "defaults")
    assert (status, err.count("\n")) == (2, 1)
    assert "cannot be written" in err


def test_a_failing_run_stops_no_other_and_the_same_command_makes_it_again(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from teamsight.analysis.papers.balch_arkin1994 import UntilDone

    command = ["reproduce", "balch_arkin1994", "--runs", "1", "--steps", "20", "--robots", "1,2", "--attractors", "1"]
    command += ["--workers", "1", "--out", str(tmp_path / "results")]
    measure, made = UntilDone.__call__, list[str]()

    def fragile(self: UntilDone, world: World, steps: int) -> dict[str, Any]:
        made.append(self.task.name)
        if self.task.name == "consume" and fails:
            raise RuntimeError("the \x1bsensor broke")
        return measure(self, world, steps)

    fails = True
    monkeypatch.setattr(UntilDone, "__call__", fragile)
    status, out, err = call(capsys, *command)
    assert (status, out, len(made)) == (2, "", 18)
    first, last = err.splitlines()
    assert first.startswith(r"a job failed: RuntimeError: the \x1bsensor broke (in the run robots=1, attractors=1, ")
    assert re.match(r"teamsight: 6 of 18 jobs failed, the first: RuntimeError: .*; the other .* makes only these again$", last)
    assert [path.name for path in (tmp_path / "results").iterdir()] == ["foraging.checkpoint"]
    fails = False
    assert call(capsys, *command)[0] == 0
    assert made[18:] == ["consume"] * 6
    assert call(capsys, *command[:-1], str(tmp_path / "whole"))[0] == 0
    pd.testing.assert_frame_equal(*(pd.read_parquet(tmp_path / name / "foraging.parquet") for name in ("results", "whole")))


def hear_ctrl_c() -> None:
    """Undo what a shell does to jobs in the background, which must not hear Ctrl-C."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


# Python runs this file when it starts: a worker, or the process whose forks they are, announces through a named pipe that
# it imports the model.
ANNOUNCE = """
import os, sys

def hook(event, arguments):
    if event == "import" and arguments[0] == "teamsight.agents.world" and "multiprocessing." in " ".join(sys.orig_argv):
        with open({pipe!r}, "wb") as pipe:
            pipe.write(b".")

sys.addaudithook(hook)
"""


def test_ctrl_c_leaves_one_line_and_no_file(tmp_path: Path) -> None:
    out, hooks = tmp_path / "out", tmp_path / "hooks"
    hooks.mkdir()
    os.mkfifo(tmp_path / "begun")
    (hooks / "sitecustomize.py").write_text(ANNOUNCE.format(pipe=str(tmp_path / "begun")))
    command = [sys.executable, "-m", "teamsight", "reproduce", "7", "--steps", "10000000", "--out", str(out)]
    begun = os.open(tmp_path / "begun", os.O_RDWR | os.O_NONBLOCK)
    with subprocess.Popen(
        [*command, "--preset", "defaults", "--workers", "2"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=dict(os.environ, PYTHONPATH=f"{hooks}{os.pathsep}{ROOT}"), start_new_session=True, preexec_fn=hear_ctrl_c,
    ) as process:  # fmt: skip
        try:
            assert select.select([begun], [], [], 120)[0], "no worker began"
            os.killpg(process.pid, signal.SIGINT)
            printed, errors = process.communicate()
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        finally:
            os.close(begun)
    assert (process.returncode, printed) == (130, "")
    assert errors.split() == ["teamsight:", "interrupted;", "nothing", "was", "kept"]
    assert list(out.iterdir()) == []


def test_the_time_of_a_run_is_without_compilation(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    now, kernel = [0.0], Entry(steps_of_a_test)
    make_steps = CMOMMT.run

    def run(model: CMOMMT, steps: int) -> None:
        now[0] += 2.0  # in each of two calls
        assert kernel.address  # compiled in the first
        make_steps(model, steps)

    def compiles(entry: Entry) -> None:
        now[0] += 500.0
        really_compile(entry)

    really_compile = Entry._get_ready
    monkeypatch.setattr(Entry, "_get_ready", compiles)
    monkeypatch.setattr(CMOMMT, "run", run)
    for module in ("teamsight.core.kernel.entry", "teamsight.cli.look"):
        monkeypatch.setattr(f"{module}.perf_counter", lambda: now[0])
    _, out, _ = call(capsys, "run", "--robots", "2", "--targets", "1", "--steps", "2")
    assert re.search(r"^time +4\.000 s for 2 steps", out, re.M)


def steps_of_a_test(address: int) -> int:
    return 0


def test_run_prints_what_the_model_gives_and_saves_its_history(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "run.parquet"
    status, out, _ = call(
        capsys, "run", "--robots", "7", "--radius", "3", "--steps", "130", "--seed", "4", "--save", str(file)
    )
    model = CMOMMT(robots=7, radius=3.0, rng=4)
    model.run(130)
    assert status == 0
    assert f"{100 * model.observed_fraction:.1f} %" in out
    saved = pd.read_parquet(file)
    assert len(saved) == 130
    assert saved["observed"].tolist() == model.recording.history["observed"].tolist()
    assert saved.attrs["seed"] == 4


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--policy", "a-cmomt"], "did you mean 'a-cmommt'?"),
        (["--awareness", "pairwse"], "did you mean 'pairwise'?"),
        (["--preset", "touzet"], "preset='touzet'"),
        (["--delta", "0", "--awareness", "ring"], "delta=0"),
        (["--delta", "100000", "--awareness", "ring"], "delta=100000: must be at most 10000"),
        (["--delta", "8"], "delta=8: awareness 'pairwise' has no δ; leave --delta out, or give --awareness ring or nearest"),
    ],
)


def test_run_reports_what_the_model_refuses_in_one_line(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    status, out, err = call(capsys, "run", *arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_delta_explores_the_world_that_is_described(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, out, _ = call(
        capsys, "delta", "--robots", "6", "--radius", "2", "--runs", "20", "--steps", "20", "--out", str(tmp_path)
    )
    assert status == 0
    assert "δ = " in out
    assert len(pd.read_parquet(tmp_path / "delta_maxima.parquet")) == 20
