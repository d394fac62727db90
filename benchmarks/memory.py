"""The memory of large worlds, each in a process of its own."""

from __future__ import annotations

import json
import resource
import subprocess
import sys

from measure import Row

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
