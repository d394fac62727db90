"""Modules of a study: those which it imports are hashed, and those of another study are not taken for them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from teamsight.analysis.studies.folder.study_folder import StudyFolder

ROOT = Path(__file__).parents[3]
PROGRAM = """\
import sys
from pathlib import Path
from teamsight.analysis.studies.study import Record, Study
from teamsight.analysis.studies.sweep import sweep

for folder in sys.argv[2:]:
    study = Study(record=Record('parts_of_a_study:measure'), path=Path(folder), steps=2, replicates=int(sys.argv[1]))
    try:
        print(sweep(study, folder + '/out').made)
    except ValueError as error:
        print(error)
"""


def swept(at: Path, replicates: int, *folders: str) -> list[str]:
    """Return what a process says that sweeps the studies of some folders, one after the other."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(replicates), *folders], cwd=at, capture_output=True, text=True, check=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    return done.stdout.splitlines()


def written(folder: Path, number: int) -> None:
    folder.mkdir(exist_ok=True)
    (folder / "parts_of_a_study.py").write_text(
        "from other_parts import NUMBER\n\ndef measure(world, steps):\n    return {'x': NUMBER}\n"
    )
    (folder / "other_parts.py").write_text(f"NUMBER = {number}\n")
    # Its name is that of a module of Python, which nobody names here.
    (folder / "queue.py").write_text("raise RuntimeError\n")


@pytest.mark.short
def test_a_changed_module_that_a_module_of_the_study_imports_is_refused(tmp_path: Path) -> None:
    written(tmp_path / "a", 1)
    assert swept(tmp_path, 1, "a") == ["1"]
    written(tmp_path / "a", 23)
    (line,) = swept(tmp_path, 2, "a")
    assert "another version of module 'other_parts'" in line


def test_a_run_is_repeated_from_any_folder(tmp_path: Path) -> None:
    """The model's module is found beside the study file; whether teamsight has changed is said, too."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "models_of_it.py").write_text(
        "from teamsight import CMOMMT\n\ndef model(robots: int = 2, *, rng):\n"
        "    return CMOMMT(robots=robots, targets=2, rng=rng)\n"
    )
    (tmp_path / "a" / "study.toml").write_text('model = "models_of_it:model"\nsteps = 2\n[axes]\nrobots = [2]\n')

    def teamsight(at: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "teamsight", *arguments], cwd=at, env=dict(os.environ, PYTHONPATH=str(ROOT)),
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    assert teamsight(tmp_path / "a", "sweep", "study.toml", "--out", "out").returncode == 0
    run = StudyFolder(tmp_path / "a" / "out").done().names()[0]
    done = teamsight(tmp_path, "rerun", "a/out", run)
    assert (done.returncode, done.stderr) == (0, "")
    (tmp_path / "a" / "models_of_it.py").write_text((tmp_path / "a" / "models_of_it.py").read_text() + "# edited\n")
    done = teamsight(tmp_path, "rerun", "a/out", run)
    assert "models_of_it" in done.stdout + done.stderr


def test_a_module_of_another_study_in_the_same_process_is_refused(tmp_path: Path) -> None:
    for number, name in enumerate(("a", "b")):
        written(tmp_path / name, number)
    # Here the modules that the studies name differ, and those which these import are of one name.
    (tmp_path / "b" / "parts_of_a_study.py").unlink()
    lines = swept(tmp_path, 1, "a", "b")
    assert lines[0] == "1"
    assert "module 'other_parts' is " in lines[1]
    written(tmp_path / "b", 2)
    lines = swept(tmp_path, 2, "a", "b")
    assert lines[0] == "1"
    assert "module 'parts_of_a_study' is " in lines[1]
    assert "start a new Python" in lines[1]
    assert swept(tmp_path, 2, "b") == ["2"]
