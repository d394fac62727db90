"""Whatever stands on the command line: exit status 0, 2 or 130, one line for each error, and no file of others changed."""

from __future__ import annotations

import os
import random
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight.agents.recording.transitions import FACTS
from teamsight.cli import main
from teamsight.policies.memory import LazyMemory

sys.path.insert(0, str(Path(__file__).parent))
import grammar

_CASES = int(os.environ.get("TEAMSIGHT_FUZZ", "1000"))
_PARTS = 10
#: What may stand in the settings of a memory that a user made.
ODD_SETTINGS: list[dict[str, Any]] = [
    {}, {"robots": 10**7}, {"robots": "x"}, {"robots": 1e300}, {"degree": ["ring"]}, {"degree": "ring", "robot_speed": 10**400}, {"awareness": "RingAwareness(delta=1)", "degree": "ring", "merged": 3},
    {"degree": "ring", "merged": [1]}, {"awareness": "RingAwareness(delta=1)", "merged": [1, {}]}, {"degree": "ring", "merged": [{"robot_speed": True}, {}]}, {"degree": "ring", "robot_speed": 1e155},
    {"degree": "ring", "robot_speed": -1}, {"degree": "ring", "awareness_range": 1e-320}, {"degree": "pairwise", "awareness": "x" * 5000}, {"degree": "ring"},
]  # fmt: skip
# What Python says of a mistake in a program, however it leaves.
_MISTAKE = re.compile(
    r"Traceback|a mistake in teamsight|object is not|object has no|unexpected keyword|positional argument|unsupported operand"
    r"|not supported between|codec can't|list index|invalid literal|pydantic|Errno"
)


def make_files(folder: Path) -> dict[str, bytes]:
    """Fill a folder with what a user may have there, and return what must never change."""
    (folder / "here").mkdir(parents=True)
    (folder / "a").mkdir()
    (folder / "elsewhere").mkdir()
    (folder / "notes.md").write_text("# My thesis\n")
    (folder / "here" / "r.parquet").write_bytes(b"PAR1 not at all")
    (folder / "elsewhere" / "target").write_text("what a link leads to\n")
    pd.DataFrame({"mine": [1, 2]}).to_parquet(folder / "table.parquet")
    noise = np.random.default_rng(1)
    time, robot = (grid.ravel() for grid in np.meshgrid(np.arange(40.0), np.arange(3), indexing="ij"))
    place = noise.uniform(-2, 2, (len(time), 2))
    trajectories = pd.DataFrame({"time": time, "robot": robot, "x": place[:, 0], "y": place[:, 1]})
    for name in ("trajectories.csv", "[red]trajectories.csv"):
        trajectories.to_csv(folder / name, index=False)
    (folder / "empty.csv").write_text("")
    main_quietly("learn", "explore", "--out", str(folder / "memory.safetensors"), "--robots", "2", "--steps", "5")
    damaged = bytearray((folder / "memory.safetensors").read_bytes())
    damaged[-1] ^= 1
    (folder / "damaged.safetensors").write_bytes(damaged)
    facts = {name: [1, 0, 0, 1] for name in FACTS}
    for number, settings in enumerate(ODD_SETTINGS):
        LazyMemory.of([[0.5] * 17] * 4, [[0, 0]] * 4, [[0.5] * 17] * 4, facts, own=16, settings=settings).save(folder / f"odd-{number}")
    (folder / "link").symlink_to("elsewhere/target")
    (folder / "dangling").symlink_to("elsewhere/new")
    (folder / "folder-link").symlink_to("elsewhere")
    os.mkfifo(folder / "pipe")
    names = ("notes.md", "here/r.parquet", "elsewhere/target", "table.parquet", "trajectories.csv", "[red]trajectories.csv", "empty.csv", "damaged.safetensors")
    return {name: (folder / name).read_bytes() for name in names}


def main_quietly(*arguments: str) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 0


def describe(arguments: list[str]) -> str:
    return " ".join(ascii(word if len(word) < 80 else word[:40] + "…") for word in arguments)


def complaints(folder: Path, kept: dict[str, bytes], arguments: list[str], status: object, err: str) -> list[str]:
    """Return what is wrong with how a command left and with what it left behind."""
    lines = err.split("\n")[:-1]
    found = {
        f"left with {status}": status not in (0, 2, 130),
        "said nothing": status != 0 and not lines,
        "a line is too long": any(len(line) >= 400 for line in lines),
        f"a mistake: {err[:400]}": _MISTAKE.search(err),
        f"a line of another kind: {err[:400]}":
            status != 0 and not all(line.startswith(("teamsight: ", "a job failed: ")) for line in lines),
        "replaced a link": not all((folder / name).is_symlink() for name in ("link", "dangling", "folder-link")),
        "replaced the pipe": not (folder / "pipe").is_fifo(),
        "followed a link": (folder / "elsewhere" / "new").exists(),
    }
    forced = any("--force".startswith(word) and len(word) > 4 for word in arguments)
    for name, content in kept.items():
        if forced:
            (folder / name).write_bytes(content)
        found[f"changed {name}"] = (folder / name).read_bytes() != content
    return [what for what, wrong in found.items() if wrong]


def refill(folder: Path, whole: Path) -> None:
    """Make the current folder anew."""
    os.chdir(whole)
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(whole, folder, symlinks=True, ignore=lambda *_: ["pipe"])
    os.mkfifo(folder / "pipe")
    (folder / "home").mkdir()
    os.chdir(folder)


@pytest.mark.parametrize("part", [0, *(pytest.param(part, marks=pytest.mark.rare) for part in range(1, _PARTS))])
def test_random_command_lines(
    part: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole, folder = tmp_path / "ints", tmp_path / "work"
    kept = make_files(whole)
    # Compiled kernels and fonts are where they were.
    monkeypatch.setenv("XDG_CACHE_HOME", os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache"))
    monkeypatch.setenv("HOME", str(folder / "home"))
    monkeypatch.delenv("TEAMSIGHT_TRACEBACK", raising=False)
    # Which line is the first to need a kernel, and on an empty cache says so, is up to the order of tests.
    monkeypatch.setattr("teamsight.analysis.runs.simulate._announced", True)
    monkeypatch.chdir(tmp_path)
    statuses, wrong = [], []
    for case in range(_CASES // _PARTS):
        if case % 50 == 0:
            refill(folder, whole)
        arguments = grammar.command_line(random.Random(f"{part}-{case}"))
        try:
            main(arguments)
        except SystemExit as left:
            statuses.append(left.code or 0)
        except BaseException as error:
            statuses.append(f"{error!r:.400}")
        _, err = capsys.readouterr()
        message = complaints(folder, kept, arguments, statuses[-1], err)
        wrong += [f"seed {part}-{case}: teamsight {describe(arguments)}: {what}" for what in message]
    assert not wrong, "\n".join(wrong[:20])
    # A grammar whose lines are all refused, or none, tests little.
    assert 0.1 < statuses.count(0) / len(statuses) < 0.9, f"{statuses.count(0)} of {len(statuses)} left with 0"


def test_the_memory_of_the_fuzzer_is_one(tmp_path: Path) -> None:
    make_files(tmp_path / "x")
    assert len(LazyMemory.load(tmp_path / "x" / "memory.safetensors")) == 10
