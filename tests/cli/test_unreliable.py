"""``teamsight unreliable``: its settings are the plan's, and its results stay those of their settings."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight.analysis.unreliable import plan as plans
from teamsight.analysis.unreliable import results
from teamsight.cli import main
from teamsight.cli.unreliable import UnreliableSettings, plan_of


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["unreliable", *arguments])
    return int(left.value.code or 0), *capsys.readouterr()


def test_the_defaults_are_those_of_the_plan() -> None:
    assert plan_of(UnreliableSettings()) == plans.Plan()


def test_what_is_written_and_what_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results, "draw", lambda *given: b"\x89PNG")  # which takes longest
    line = ["--steps", "50", "--runs", "1", "--policies", "a-cmommt", "--workers", "1", "--out", str(tmp_path)]
    status, out, _ = call(capsys, *line)
    assert (status, out.count("N = 10, R = 5: gain")) == (0, 2)
    stored = pd.read_parquet(tmp_path / "unreliable.parquet")
    assert stored.attrs["unreliable"]["steps"] == 50
    assert len(stored) == 2 * 3 * (len(plans.AVAILABILITIES) + len(plans.PERIODS))
    status, _, err = call(capsys, *line, "--seed", "1")
    assert (status, "other settings" in err, "--force" in err) == (2, True, True)
    assert pd.read_parquet(tmp_path / "unreliable.parquet").equals(stored)


def test_the_team_of_a_task(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results, "draw", lambda *given: b"\x89PNG")
    line = ["--task", "graze", "--set", "robots=3", "--steps", "50", "--runs", "1", "--workers", "1"]
    status, out, _ = call(capsys, *line, "--out", str(tmp_path))
    assert (status, out.count("skilled, robots = 3: gain")) == (0, 2)
    stored = pd.read_parquet(tmp_path / "unreliable.parquet")
    assert stored.attrs["unreliable"]["scenario"]["robots"] == 3
    assert {"completion_time", "max_neighbours"} <= set(stored)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["--repair", "0"], "repair=0.0: must be a finite number, at least 1"),
        (["--policies", "a-cmomt"], "policies='a-cmomt': unknown; did you mean 'a-cmommt'?"),
        (["--steps", "49"], "steps=49: must be at least 50, the longest sensing period; give more steps"),
        (["--runs", "0"], "runs=0: must be at least 1"),
        (["--set", "robots=3"], "set=robots: is for another task than cmommt, whose scenarios are fixed; leave --set out"),
        (["--task", "graze", "--policies", "evolved"], "policies=evolved: is for cmommt; a task has one team"),
        (["--task", "grase"], "task='grase': unknown; did you mean 'graze'?"),
    ],
)
def test_wrong_options_are_named(capsys: pytest.CaptureFixture[str], line: list[str], message: str) -> None:
    status, _, err = call(capsys, *line)
    assert (status, message in err) == (2, True), err
