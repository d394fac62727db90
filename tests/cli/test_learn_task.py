"""``teamsight learn evaluate`` with a memory of another task than CMOMMT."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from teamsight.cli import main

TESTS = ["--learner", "linear", "--runs", "2", "--steps", "20", "--workers", "1"]


def call(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as left:
        main(["learn", *arguments])
    return int(left.value.code or 0), *capsys.readouterr()


@pytest.fixture(scope="module")
def memory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("memories") / "pursuit.safetensors"
    line = ["--task", "pursuit", "--set", "side=6", "--set", "rule=alone", "--steps", "40", "--out", str(path)]
    with pytest.raises(SystemExit) as left:
        main(["learn", "explore", *line])
    assert not left.value.code
    return path


def test_robots_are_evaluated_in_the_task_that_they_explored(
    capsys: pytest.CaptureFixture[str], memory: Path, tmp_path: Path
) -> None:
    saved = tmp_path / "runs.parquet"
    line = ["evaluate", str(memory), *TESTS, "--set", "prey=1", "--save", str(saved)]
    status, out, _ = call(capsys, *line)
    assert (status, "reward interaction" in out, "cooperative better by" in out) == (0, True, True)
    assert "side = 6" in out
    assert "prey = 1" in out
    # Hunters that have learned leave the cells.
    assert "move in any direction" in out
    table = pd.read_parquet(saved)
    assert len(table) == 2 * 4
    assert {"trial_steps", "captures", "counted"} <= set(table)
    assert table.attrs["scenario"]["rule"] == "alone"
    status, _, err = call(capsys, *line, "--set", "side=5")
    assert (status, "other settings" in err, "--force" in err) == (2, True, True)


def test_another_task_can_be_given(capsys: pytest.CaptureFixture[str], memory: Path) -> None:
    status, out, _ = call(capsys, "evaluate", str(memory), *TESTS, "--task", "cmommt")
    assert (status, "observed_fraction [%] (more is better)" in out) == (0, True)
    status, out, _ = call(capsys, "evaluate", str(memory), *TESTS, "--task", "graze", "--reward", "keep")
    assert (status, "completion_time (less is better)" in out) == (0, True)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (["--robots", "3"], "robots: is no parameter of the scenario of pursuit"),
        (["--task", "cmommt", "--set", "side=5"], "side: is no parameter of the scenario of cmommt"),
        (["--set", "sied=5"], "sied: is no parameter of the scenario of pursuit; did you mean 'side'?"),
        (["--task", "grase"], "task='grase': unknown; did you mean 'graze'?"),
    ],
)
def test_wrong_options_are_named(
    capsys: pytest.CaptureFixture[str], memory: Path, line: list[str], message: str
) -> None:
    status, _, err = call(capsys, "evaluate", str(memory), *TESTS, *line)
    assert (status, message in err) == (2, True), err
