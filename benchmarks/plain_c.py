"""The plain C program: building it, running it, and comparing it with teamsight step by step."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from teamsight import CMOMMT
from teamsight.world.noise import key_of

SOURCE = Path(__file__).with_name("plain.c")
FLAGS = ["-O3", "-march=native", "-ffp-contract=off"]


class PlainC:
    """The compiled program.

    Attributes
    ----------
    is_there : bool
        Whether gcc was found.
    """

    def __init__(self) -> None:
        gcc = shutil.which("gcc")
        self.is_there = gcc is not None
        self._folder = tempfile.TemporaryDirectory(prefix="plain-c-")
        self._program = Path(self._folder.name, "plain")
        if gcc:
            subprocess.run([gcc, *FLAGS, "-o", str(self._program), str(SOURCE), "-lm"], check=True)

    def run(self, robots: int, targets: int, radius: float, steps: int, *options: str) -> dict[str, Any]:
        """Run a world; return its ``observed_fraction``, ``max_neighbours`` and ``cpu_seconds``."""
        command = [str(self._program), str(robots), str(targets), repr(radius), str(steps), *options]
        return dict(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))

    def first_difference(self, robots: int, targets: int, radius: float, steps: int, seed: int) -> int | None:
        """Run teamsight and C from one start with one noise; return the first step whose counts differ, if any."""
        model = CMOMMT(robots=robots, targets=targets, radius=radius, rng=seed)
        start, history = Path(self._folder.name, "start"), Path(self._folder.name, "history")
        bodies = np.concatenate([np.hstack([group.position, group.heading]) for group in (model.robots, model.targets)])
        # Hexadecimal, so that no bit is lost.
        start.write_text("\n".join(" ".join(float(value).hex() for value in row) for row in bodies))
        key = [str(int(word)) for word in key_of(model.seed_used)]
        files = ["--start", str(start), "--history", str(history)]
        self.run(robots, targets, radius, steps, "--noise", "philox", "--key", *key, *files)
        model.run(steps)
        counts = model.recording.history * [targets, robots, 1]
        model.close()
        differs = (np.rint(counts.to_numpy()) != np.loadtxt(history, ndmin=2)).any(axis=1)
        return int(np.argmax(differs)) + 1 if differs.any() else None
