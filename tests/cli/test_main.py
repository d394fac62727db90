"""The command line answers at once, explains itself, and reports what is wrong in one line each."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np
import pandas as pd
import pytest

from teamsight.cli import main, reproduce
from teamsight.cli.exits import lines
from teamsight.cli.main import commands


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    out, err = capsys.readouterr()
    return int(left.value.code or 0), out, err


@pytest.mark.parametrize("command", ["reproduce", "delta", "run"])
def test_the_help_of_each_command_shows_examples(capsys: pytest.CaptureFixture[str], command: str) -> None:
    status, out, _ = call(capsys, command, "--help")
    assert status == 0
    assert out.count(f"  teamsight {command}") >= 3


def test_no_line_of_any_help_is_wider_than_80_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    contexts = [click.Context(commands, info_name="teamsight", **commands.context_settings)]
    for context in contexts:
        wide = [line for line in context.get_help().splitlines() if len(line) > 80]
        assert not wide, context.command_path
        inner = context.command.commands if isinstance(context.command, click.Group) else {}
        contexts += [click.Context(command, context, name, **command.context_settings) for name, command in inner.items()]


def test_the_options_of_each_command_stand_under_headings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    contexts = [click.Context(commands, info_name="teamsight", **commands.context_settings)]
    for context in contexts:
        inner = context.command.commands if isinstance(context.command, click.Group) else {}
        contexts += [click.Context(command, context, name, **command.context_settings) for name, command in inner.items()]
        path, heading, under = context.command_path, "", {}
        for line in context.get_help().splitlines() if not inner else ():
            if line[:1].strip() and line.endswith(":"):
                heading = line.rstrip(":")
            elif line.startswith("  --"):
                under[line.split()[0]] = heading
        files = {"--out", "--save", "--force", "--record", "--format", "--reference"}
        assert {under[name] for name in files & under.keys()} <= {"Files"}, path
        assert {under[name] for name in {"--steps", "--seed", "--workers"} & under.keys()} <= {"Runs"}, path
        assert len(under) < 8 or len(set(under.values())) > 1, path


def test_the_help_shows_how_to_watch_a_team(capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = call(capsys, "--help")
    assert status == 0
    assert "  teamsight watch  " in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["reproduse"],
            ["command='reproduse': unknown; did you mean 'reproduce'? known are benchmark, calibrate, ceilings, "],
        ),
        (["run", "--robbots", "3"], ["No such option '--robbots'"]),
        (["run", "--robots"], ["Option '--robots' requires an argument"]),
        (["reproduce", "deta"], ["figures='deta': unknown; did you mean 'delta'?"]),
        (["reproduce", "delat"], ["figures='delat': unknown; did you mean 'delta'?"]),
        (["reproduce", "77"], ["figures='77': unknown; did you mean '7'? known are the figures 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, delta, ledger and the papers touzet2000, balch"]),
        (["reproduce", "touzet2000", "77"], ["figures='77': unknown; did you mean '7'? known are 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, delta, ledger"]),
        (["reproduce", "calibration"], ["command='calibration': unknown; did you mean 'teamsight calibrate'?"]),
        (["reproduce", "--runs", "0", "--steps", "x"], ["runs=0: must be at least 1", "steps='x': must be a whole"]),
        (
            ["reproduce", "--seed", "-1", "--workers", "1.5"],
            ["workers=1.5: must be a whole", "seed=-1: must be at least 0"],
        ),
        (
            ["run", "--robots", "0", "--radius", "nan"],
            ["robots=0: must be at least 1", "radius=nan: must be a finite number"],
        ),
        (
            ["run", "--radius", "-2", "--awareness-range", "inf"],
            ["radius=-2.0: must be", "awareness_range=inf: must be"],
        ),
        (["delta", "--risk", "2"], ["risk=2.0: must be a finite number, at least 1e-09 and at most 1"]),
        (["delta", "--window", "5"], ["window=5.0: is for recorded positions, and needs --trajectories; leave --window out"]),
        (["delta", "--trajectories", "t.csv", "--robots", "5"], ["robots=5: cannot be combined with --trajectories, which determines it; leave --robots out"]),
        (["delta", "--trajectories", "t.csv"], ["awareness_range: missing; give --awareness-range"]),
    ],
)
def test_what_is_wrong_is_reported_in_one_line_each(
    capsys: pytest.CaptureFixture[str], arguments: list[str], message: list[str]
) -> None:
    status, out, err = call(capsys, *arguments)
    assert (status, out) == (2, "")
    found = err.splitlines()
    assert len(found) == len(message)
    assert all(any(line.startswith(f"teamsight: {start}") for line in found) for start in message)


def test_a_paper_that_cannot_be_read_is_named(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str) -> click.Command:
        raise KeyError("template")

    monkeypatch.setattr(reproduce, "command_of", broken)
    for arguments in (["reproduce", "tan1993"], ["reproduce", "tan1993", "--help"]):
        status, _, err = call(capsys, *arguments)
        assert (status, err) == (2, "teamsight: the paper 'tan1993' cannot be read: KeyError: 'template'\n")


def test_errors_with_line_breaks_are_reported_on_one_line() -> None:
    assert lines(ValueError("one\n   two")) == ["one two"]
    assert lines(FileNotFoundError(2, "No such file", "a.csv")) == ["a.csv: No such file"]
    assert "please report it" in lines(KeyError("robots"))[0]


def test_an_error_in_code_of_the_user_says_where(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("import json\n\ndef model():\n    return json.loads([])\n")
    names = {"__name__": "mine"}
    exec(compile((tmp_path / "mine.py").read_text(), tmp_path / "mine.py", "exec"), names)
    with pytest.raises(TypeError) as raised:
        names["model"]()
    error = RuntimeError("no").with_traceback(raised.value.__traceback__)
    # The library that it calls is not the place, and neither is what called it.
    assert "mine.py:4; TEAMSIGHT_TRACEBACK=1 shows how it came there" in lines(error)[0]


def write_trajectories(folder: Path) -> Path:
    noise = np.random.default_rng(1)
    time, robot = (grid.ravel() for grid in np.meshgrid(np.arange(200.0), np.arange(6), indexing="ij"))
    place = noise.uniform(-2, 2, (len(time), 2))
    file = folder / "trajectories.csv"
    pd.DataFrame({"time": time, "robot": robot, "x": place[:, 0], "y": place[:, 1]}).to_csv(file, index=False)
    return file


def test_delta_from_trajectories_prints_and_writes_its_report(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = write_trajectories(tmp_path)
    out = tmp_path / "out"
    status, text, err = call(
        capsys, "delta", "--trajectories", str(file), "--awareness-range", "1", "--window", "20", "--out", str(out)
    )
    assert (status, err) == (0, "")
    assert "δ = " in text
    assert {"delta.md", "delta_exceedance.parquet", "delta_exceedance.png"} <= {path.name for path in out.iterdir()}


def test_an_unwritable_folder_is_reported_before_the_work(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = write_trajectories(tmp_path)
    status, out, err = call(capsys, "delta", "--trajectories", str(file), "--awareness-range", "1", "--out", str(file / "x"))
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert "cannot be written" in err


def test_missing_trajectories_are_reported_in_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status, _, err = call(capsys, "delta", "--trajectories", str(tmp_path / "none.csv"), "--awareness-range", "1")
    assert (status, err.count("\n")) == (2, 1)
    assert "none.csv" in err


def test_a_report_does_not_replace_its_trajectories(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    trajectories = tmp_path / "delta_over_time.parquet"
    pd.read_csv(write_trajectories(tmp_path)).to_parquet(trajectories)
    before = trajectories.read_bytes()
    given = ("delta", "--trajectories", str(trajectories), "--awareness-range", "1", "--out", str(tmp_path), "--force")
    status, _, err = call(capsys, *given)
    assert status == 2
    assert "is the trajectories file, which would be overwritten; give another place" in err
    assert trajectories.read_bytes() == before


def test_delta_of_square_ranges(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = str(write_trajectories(tmp_path))
    for given in (["--trajectories", file, "--window", "20"], ["--robots", "4", "--runs", "10", "--steps", "10", "--risk", "0.5"]):
        line = ["delta", *given, "--awareness-range", "1", "--range-shape"]
        status, text, err = call(capsys, *line, "square")
        assert (status, err) == (0, "")
        assert "Ranges are squares" in " ".join(text.split())
        assert "squares" not in call(capsys, *line, "disc")[1]
    assert "range_shape='cube': unknown" in call(capsys, "delta", "--range-shape", "cube")[2]
