"""``teamsight submit`` writes a script and says what to do with it; wrong options are refused before."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from teamsight.cli.exits import lines
from teamsight.cli.main import commands

pytestmark = pytest.mark.short

STUDY = 'model = "cmommt"\nreplicates = 2\nsteps = 10\n[axes]\nrobots = [2, 3]\n'


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def submit(*options: str) -> tuple[str, str]:
    """Return what the command prints, and its error."""
    result = CliRunner().invoke(commands, ["submit", "study.toml", "--out", "results", *options])
    error = result.exception
    return result.output, "" if error is None else "; ".join(lines(error)) if isinstance(error, Exception) else str(
        error
    )


def test_it_writes_a_script_and_prints_the_next_commands(study: Path) -> None:
    output, error = submit("--slurm", "--tasks", "4")
    assert (output, error) == (
        "study.sbatch: 4 runs in 4 tasks\nnext: bash study.sbatch\nthen: teamsight status results\n", ""
    )  # fmt: skip
    assert sorted(path.name for path in study.parent.iterdir()) == ["study.sbatch", "study.toml"]


def test_a_small_study_has_a_task_for_each_run(study: Path) -> None:
    assert submit("--slurm") == (
        "study.sbatch: 4 runs in 4 tasks\nnext: bash study.sbatch\nthen: teamsight status results\n", ""
    )  # fmt: skip


def test_a_dry_run_writes_nothing(study: Path) -> None:
    output, error = submit("--slurm", "--tasks", "2", "--dry-run", "--time", "02:00:00")
    assert output.startswith("#!/bin/bash\n")
    assert "#SBATCH --time=02:00:00\n" in output
    assert error == ""
    assert list(study.parent.iterdir()) == [study]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "slurm=False: .*give --slurm"),
        (("--slurm", "--tasks", "5"), "^tasks=5: are more than the 4 runs of the study; give fewer"),
        (("--slurm", "--tasks", "0"), "^tasks=0: must be at least 1"),
        (("--slurm", "--dry-run", "--submit"), "^submit=True: .*leave --submit out"),
        (("--slurm", "--tasks", "2", "--memory", "much"), "^memory='much': is not in SLURM's notation"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_written(
    study: Path, options: tuple[str, ...], message: str
) -> None:
    _, error = submit(*options)
    assert re.search(message, error), error
    assert list(study.parent.iterdir()) == [study]


def test_a_wrong_study_is_refused(study: Path) -> None:
    study.write_text(STUDY.replace("replicates = 2", "replicates = 0"))
    _, error = submit("--slurm")
    assert "replicates=0" in error
    assert list(study.parent.iterdir()) == [study]


def test_an_adaptive_study_is_divided_by_settings(study: Path) -> None:
    study.write_text("until = {interval = 0.1}\n" + STUDY)
    assert "tasks=3: are more than the 2 settings" in submit("--slurm", "--tasks", "3")[1]
    assert submit("--slurm", "--tasks", "2")[1] == ""
