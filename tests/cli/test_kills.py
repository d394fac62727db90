"""Kills while results are written: each file is absent, the old one or the new one, and complete."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from teamsight.cli import main

ROOT = Path(__file__).parents[2]
SMALL = ["--robots", "2", "--targets", "2", "--steps", "9"]
#: Each command, and what it is called with when it made the old results.
COMMANDS = {
    "run": (["run", *SMALL, "--save", "out/x.parquet", "--force"], ["--seed", "5"]),
    "delta": (["delta", *SMALL, "--runs", "3", "--out", "out", "--force"], ["--seed", "5"]),
    "reproduce": (["reproduce", "2", "8", "--quick", "--runs", "1", "--steps", "2", "--workers", "1", "--out", "out", "--force"], ["--seed", "5"]),
    "explore": (["learn", "explore", *SMALL, "--out", "out/x.safetensors", "--force"], ["--seed", "5"]),
    "append": (["learn", "explore", *SMALL, "--out", "out/x.safetensors", "--append"], ["--seed", "5"]),
}  # fmt: skip
# The program, which sends itself a signal at the event with a given number that concerns a file in the folder of results;
# with number 0 it prints how many there are.
PROGRAM = """
import atexit, os, runpy, signal, sys

number, stop = int(sys.argv[1]), int(sys.argv[2])
sys.argv = ["teamsight", *sys.argv[3:]]
signal.signal(signal.SIGINT, signal.default_int_handler)
met = 0

def hook(event, arguments):
    global met
    if event in ("open", "os.rename", "os.remove", "os.mkdir") and "out" in str(arguments[0]).split(os.sep):
        met += 1
        if met == number:
            os.kill(os.getpid(), stop)

if not number:
    atexit.register(lambda: print(met, file=sys.stderr))
sys.addaudithook(hook)
runpy.run_module("teamsight", run_name="__main__", alter_sys=True)
"""


@pytest.mark.rare
def test_kills_while_results_are_written(tmp_path: Path) -> None:
    script = Path(__file__).with_name("writes_until_killed.py")
    found = subprocess.run(
        [sys.executable, str(script), str(tmp_path), "25"], capture_output=True, text=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)), check=False,
    )  # fmt: skip
    assert (found.returncode, found.stdout) == (0, ""), found.stdout + found.stderr


def files_in(folder: Path) -> dict[str, bytes]:
    """Return the files that a user sees."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".")}


def run_whole(*arguments: str) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 0


def program(folder: Path, number: int, stop: int, line: list[str]) -> str:
    """Run a command that is stopped at an event, and return what it prints on standard error."""
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, str(number), str(stop), *line], cwd=folder, capture_output=True, text=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)), check=False,
    ).stderr  # fmt: skip


@pytest.mark.rare
@pytest.mark.parametrize("command", COMMANDS)
def test_kills_of_whole_commands(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    line, before = COMMANDS[command]
    noise = random.Random(command)
    for name in ("ints", "work", "events"):
        (tmp_path / name / "out").mkdir(parents=True)
        (tmp_path / name / "out" / "notes.txt").write_text("thesis")
        monkeypatch.chdir(tmp_path / name)
        run_whole(*line, *before)
    old = files_in(tmp_path / "work" / "out")
    monkeypatch.chdir(tmp_path / "ints")
    run_whole(*line)
    new = files_in(tmp_path / "ints" / "out")
    folder = tmp_path / "work" / "out"
    events = int(program(tmp_path / "events", 0, 0, line).split()[-1])
    assert files_in(tmp_path / "events" / "out") == new
    # While the last file is written, and at some event before.
    for number in (events, noise.randint(1, events)):
        program(tmp_path / "work", number, noise.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT)), line)
        for name, content in files_in(folder).items():
            assert content in (old.get(name), new.get(name)), (number, name)
        assert (folder / "notes.txt").read_text() == "thesis"
    monkeypatch.chdir(tmp_path / "work")
    run_whole(*line)
    assert files_in(folder) == new
