"""What a decision of a controller costs, and how soon the first one is there."""

from __future__ import annotations

import subprocess
import sys
from functools import partial

from measure import Row, cpu_seconds, interleave, median
from start import cpu_of

from teamsight import Controller, Detections, Relayed

CALLS = 2000
FIRST = "from teamsight import Controller; Controller('a-cmommt', 'pairwise').decide()"


def measure_controller(rounds: int) -> list[Row]:
    """Measure decisions of A-CMOMMT with four targets and three teammates in sight, and a process with one decision."""
    taken = interleave({degree: partial(_decision, degree) for degree in ("ring", "pairwise", "shared")}, rounds)
    start = [sys.executable, "-c", FIRST]
    subprocess.run(start, check=True)
    rows = [
        median(f"a decision under {degree}", "µs", [1e6 * one for one in each], most=50)
        for degree, each in taken.items()
    ]
    first = [cpu_of(start) for _ in range(rounds)]
    return [*rows, median("python with one decision, full cache", "CPU s", first, most=1)]


def _decision(degree: str) -> float:
    robot = Controller(
        "a-cmommt", degree, identity=2, team=range(1, 9), sensing_range=2.0, awareness_range=4.0, speed=0.1
    )
    targets = Detections([0.5, 1.0, 1.5, 1.9], [0.1, 1.5, 3.0, -2.0], [11, 14, 19, 20])
    teammates = Detections([1.0, 2.0, 3.0], [0.2, -1.0, 2.5], [1, 5, 8])
    relayed = {one: Relayed(targets, 0.3) for one in (1, 5, 8)} if degree == "shared" else None

    def decide() -> None:
        for _ in range(CALLS):
            robot.decide(targets, teammates, heading=0.5, moved=(0.05, 0.0), relayed=relayed)

    return cpu_seconds(decide) / CALLS
