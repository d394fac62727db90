"""What each command prints fits a terminal of 80 columns, the answer is there, and a pipe gets plain lines."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest

from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.cli import main
from teamsight.cli.main import commands
from teamsight.cli.options import Command

# Boxes and bars, and what moves the cursor or sets a colour.
BOX = re.compile("[\u2500-\u259f\x1b\r]")
ONE = ["--workers", "1"]
#: Small runs of each command, in a folder that has the files; a new command needs a line here.
SMALL: dict[str, list[str]] = {
    "run": ["--steps", "40", "--robots", "3", "--evenness", "--failures", "20", "--repair", "5", "--events", "--record", "r.html"],
    "sweep": ["study.toml", "--out", "again", *ONE],
    "status": ["results"],
    "plot": ["results"],
    "submit": ["study.toml", "--out", "results", "--slurm", "--tasks", "2"],
    "rerun": ["results", "RUN"],
    "verify": ["results", "--dry-run"],
    "delta": ["--robots", "8", "--runs", "30", "--steps", "20", *ONE],
    "benchmark": [],
    "ceilings": ["a-cmommt:gain=4,idle=wander", "evolved", "--robots", "2,3", "--radius", "1.5", "--runs", "2", "--steps", "20", *ONE],
    "tasks": [],
    "plugins": [],
    "demo": ["--record", "demo.html"],
    "learn explore": ["--out", "more.safetensors"],
    "learn evaluate": ["memory.safetensors", "--runs", "2", "--steps", "10", *ONE],
    "learn imagine": ["memory.safetensors", "--generations", "1", "--population", "4", "--robots", "2", "--radius", "3", "--steps", "10", *ONE],
    "learn figure": ["--samples", "30,60", "--memories", "2", "--worlds", "1", "--steps", "5", "--robots", "2", "--out", "curves", *ONE],
    "learn diagnose": ["--samples", "30,60", "--k", "5", "--memories", "2", "--learners", "lazy", "--out", "diagnosis", *ONE],
    "learn curve": ["--set", "side=5", "--learned", "10,20", "--trainings", "2", "--runs", "2", "--out", "curve", *ONE],
}  # fmt: skip
STUDY = 'name = "awareness of small teams"\nsteps = 20\nreplicates = 2\n[fixed]\nradius = 3.0\ntargets = 3\n[axes]\nrobots = [2, 4]\n'


def works() -> dict[str, Command]:
    """Return the commands that do something, by name; those of papers are one, since one function makes them all."""
    found: dict[str, Command] = {}
    waiting: list[tuple[str, Any]] = list(commands.commands.items())
    for name, command in waiting:
        if isinstance(command, click.Group) and name != "reproduce":
            waiting += [(f"{name} {inner}", one) for inner, one in command.commands.items()]
        elif isinstance(command, Command):
            found[name] = command
    return found


def only_says(command: Command) -> bool:
    """Whether a command prints lines alone, which a terminal breaks between words, or what a program reads."""
    code = inspect.getsource(inspect.getmodule(command._work))  # type: ignore[arg-type]
    return "show_table" not in code and "wide_console" not in code


def test_each_command_that_prints_a_table_is_tried() -> None:
    found = works()
    assert SMALL.keys() <= found.keys()
    assert {name for name in found.keys() - SMALL.keys() if not only_says(found[name])} == {"schema", "watch"}


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a memory, a study file and its results, in which the commands run."""
    folder, before = tmp_path_factory.mktemp("results"), Path.cwd()
    os.chdir(folder)
    (folder / "study.toml").write_text(STUDY)
    for line in (["learn", "explore", "--out", "memory.safetensors"], ["sweep", "study.toml", "--out", "results", *ONE]):
        with pytest.raises(SystemExit) as left:
            main(line)
        assert not left.value.code
    yield folder
    os.chdir(before)


def run_id() -> str:
    """Return the id of the first run of the study."""
    return f"{int(StudyFolder('results').study.plan().ids[0]):016x}-0"


def printed(name: str, capsys: pytest.CaptureFixture[str]) -> str:
    arguments = [run_id() if one == "RUN" else one for one in SMALL[name]]
    force = ["--force"] if "--force" in {text for one in works()[name].params for text in one.opts} else []
    capsys.readouterr()
    with pytest.raises(SystemExit) as left:
        main([*name.split(), *arguments, *force])
    out, err = capsys.readouterr()
    assert not left.value.code, err
    return out


@pytest.mark.parametrize("name", SMALL)
def test_what_it_prints_fits_a_terminal_and_a_pipe_gets_plain_lines(
    name: str, results: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = printed(name, capsys)
    assert not BOX.search(out)
    assert not any(line != line.rstrip() for line in out.splitlines())
    monkeypatch.setattr("teamsight.cli.show.Console.is_terminal", True)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    shown = printed(name, capsys)
    assert "…" not in re.sub(r" … ", "", shown)
    # An address or a path is one word, and a command is copied.
    wide = [line for line in shown.splitlines() if len(line) > 80 and " " in line.strip() and "teamsight " not in line]
    assert not wide
