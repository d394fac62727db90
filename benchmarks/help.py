"""Time until ``teamsight --help`` answers; the goal is half a second.

python benchmarks/help.py
"""

from __future__ import annotations

import subprocess
import sys
import time

RUNS = 5


def main() -> None:
    """Print the shortest of a few times [s]."""
    times = []
    for _ in range(RUNS):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-m", "teamsight", "--help"], stdout=subprocess.DEVNULL, check=True)
        times.append(time.perf_counter() - began)
    print(f"teamsight --help: {min(times):.2f} s, the shortest of {RUNS}")


if __name__ == "__main__":
    main()
