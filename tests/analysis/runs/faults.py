"""A measure that fails in worlds with a given number of robots; in a module, as workers need it."""

from __future__ import annotations

import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from teamsight.agents.world import World
from teamsight.analysis.runs.run import Run


@dataclass(frozen=True)
class Faulty:
    """Runs a world and returns numbers that differ between runs, or fails in one of several ways.

    Parameters
    ----------
    folder : str
        A file "HOW-ROBOTS" in it is a fault; each run leaves a file "made-ROBOTS-SEED".
    """

    folder: str

    def __call__(self, world: World, steps: int) -> Any:
        """Run the world."""
        folder, robots = Path(self.folder), len(world.robots)
        world.run(steps)
        (folder / f"made-{robots}-{world.seed_used}").touch()
        for fault in folder.glob(f"*-{robots}"):
            how = fault.name.partition("-")[0]
            if how == "raise":
                raise KeyError(f"robots: {robots}")
            if how == "leave":
                sys.exit("away")
            if how == "interrupt":
                raise KeyboardInterrupt
            if how == "wrap":
                try:
                    raise KeyboardInterrupt
                except KeyboardInterrupt as interrupt:
                    raise RuntimeError("a callback failed") from interrupt
            if how == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            if how == "array":
                return [np.int64(robots)]
            if how == "lambda":
                return lambda: robots
        return [float(world.robots.position[0, 0]), robots]


def runs_of(folder: Path, *robots: int, seeds: int = 4) -> list[Run]:
    """Return the runs of teams of several sizes, so many of each."""
    measure = Faulty(str(folder))
    return [Run({"robots": number, "targets": 2}, seed, 3, measure) for number in robots for seed in range(seeds)]
