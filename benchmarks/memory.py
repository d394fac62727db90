"""The memory of large worlds, each in a process of its own; and how long the command line takes to answer."""

from __future__ import annotations

import importlib.util
import json
import resource
import subprocess
import sys
import time

from measure import Row, median

ROBOTS = 100_000
POLICIES = ("random-walk", "centroid", "a-cmommt")
DEGREES = ("none", "ring", "pairwise")


def measure_memory(policies: tuple[str, ...]) -> list[Row]:
    """Build and run each world in a process of its own, and report the greatest memory that it ever held."""
    rows = []
    for policy in policies:
        for degree in DEGREES:
            command = [sys.executable, __file__, policy, degree]
            answer = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            peak = json.loads(answer)["peak"]
            rows.append(Row(f"memory of {ROBOTS:,} + {ROBOTS:,}: {policy}, {degree}", "GiB", peak, most=2))
    return rows


def measure_help(rounds: int) -> list[Row]:
    """Measure the wall time of ``teamsight --help``, where there is a command line."""
    if importlib.util.find_spec("teamsight.cli") is None:
        return []
    command = [sys.executable, "-c", "from teamsight.cli import main; main(['--help'])"]
    taken = []
    for _ in range(rounds):
        begin = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        taken.append(time.perf_counter() - begin)
    return [median("teamsight --help, wall time", "s", taken, most=0.5)]


def main(policy: str, degree: str) -> None:
    """Run one large world, and print the greatest memory of this process [GiB]."""
    from scaling import radius_for

    from teamsight import CMOMMT

    model = CMOMMT(
        robots=ROBOTS, targets=ROBOTS, radius=radius_for(ROBOTS), policy=policy, awareness=degree, rng=1
    )  # fmt: skip
    model.run(50)
    unit = 1 if sys.platform == "darwin" else 1024
    print(json.dumps({"peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**30}))


if __name__ == "__main__":
    main(*sys.argv[1:])
