"""Kills at random moments while results are written: each file is absent, the old one or the new one, and whole."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from teamsight.cli import main

ROOT = Path(__file__).parents[2]
SMALL = ["--robots", "2", "--targets", "2", "--steps", "9"]
#: Each command, and what it is called with when it made the old results.
COMMANDS = {
    "run": (["run", *SMALL, "--save", "out/x.parquet", "--force"], ["--seed", "5"]),
    "delta": (["delta", *SMALL, "--runs", "3", "--out", "out", "--force"], ["--seed", "5"]),
    "reproduce": (["reproduce", "2", "8", "--quick", "--runs", "1", "--steps", "2", "--workers", "1", "--out", "out"], ["--seed", "5"]),
    "explore": (["learn", "explore", *SMALL, "--out", "out/x.safetensors", "--force"], ["--seed", "5"]),
    "append": (["learn", "explore", *SMALL, "--out", "out/x.safetensors", "--append"], ["--seed", "5"]),
}  # fmt: skip


def test_kills_while_results_are_written(tmp_path: Path) -> None:
    script = Path(__file__).with_name("writes_until_killed.py")
    found = subprocess.run(
        [sys.executable, str(script), str(tmp_path), "25"], capture_output=True, text=True, timeout=300,
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


@pytest.mark.parametrize("command", COMMANDS)
def test_kills_of_whole_commands(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    line, before = COMMANDS[command]
    noise = random.Random(command)
    for name in ("ints", "work"):
        (tmp_path / name / "out").mkdir(parents=True)
        (tmp_path / name / "out" / "notes.txt").write_text("thesis")
        monkeypatch.chdir(tmp_path / name)
        run_whole(*line, *before)
    old = files_in(tmp_path / "work" / "out")
    monkeypatch.chdir(tmp_path / "ints")
    run_whole(*line)
    new = files_in(tmp_path / "ints" / "out")
    folder = tmp_path / "work" / "out"
    names = set(os.listdir(folder))
    process = subprocess.Popen(
        [sys.executable, "-m", "teamsight", *line], cwd=tmp_path / "work", stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    # From the first draft on, results are written.
    for _ in range(60_000):
        if set(os.listdir(folder)) != names or process.poll() is not None:
            break
        time.sleep(0.001)
    time.sleep(noise.uniform(0.0, 0.05))
    process.send_signal(noise.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGINT)))
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait(60)
    for name, content in files_in(folder).items():
        assert content in (old.get(name), new.get(name)), name
    assert (folder / "notes.txt").read_text() == "thesis"
    monkeypatch.chdir(tmp_path / "work")
    run_whole(*line)
    assert files_in(folder) == new
