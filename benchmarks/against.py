"""Compare this checkout with another one, such as the commit before a change, side by side in one run.

git worktree add ../before HEAD~1 && python benchmarks/against.py ../before [--rounds 9] [--reproduce quick|full]

Each round measures the CPU time of both checkouts, one right after the other, each in a process of its own; the ratio
of a round is this one over the other. The table shows the median ratio of the rounds, the smallest and the largest.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent

# Runs in each checkout, so it uses only what both have. Checkouts from before reused worlds build each of them.
MEASURE = """
import json, time, timeit
from teamsight import CMOMMT

def best(deed, number, repeat=25):
    return min(timeit.repeat(deed, number=number, repeat=repeat, timer=time.process_time)) / number * 1e6

SETTINGS = {"robots": 15, "targets": 15, "radius": 5.0}
SEEDS = range(64)

def runs(steps):
    try:
        from teamsight.agents.reused_worlds import ReusedWorlds
    except ImportError:
        for seed in SEEDS:
            model = CMOMMT(**SETTINGS, rng=seed)
            model.run(steps)
            model.close()
        return
    worlds = ReusedWorlds()
    worlds.expect([(SETTINGS, seed) for seed in SEEDS])
    for seed in SEEDS:
        worlds.begin(CMOMMT, SETTINGS, seed).run(steps)
    worlds.close()

model = CMOMMT(rng=1)
model.run(10)
large = CMOMMT(robots=100, targets=100, radius=10.0, rng=1)
large.run(5)
print(json.dumps({
    "run(600)": best(lambda: model.run(600), 10),
    "run(1)": best(lambda: model.run(1), 500),
    "step()": best(model.step, 500),
    "run(100), 100 robots": best(lambda: large.run(100), 3),
    "64 runs of 600 steps": best(lambda: runs(600), 1, 9),
    "64 runs of 1 step": best(lambda: runs(1), 1, 9),
    "reset() and run(1)": best(lambda: (model.reset(1), model.run(1)), 30),
    "building": best(lambda: CMOMMT(rng=1).close(), 30),
    "building 500 robots": best(lambda: CMOMMT(robots=500, targets=500, radius=20.0, rng=1).close(), 3),
}))
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("other", type=Path, help="another checkout")
    parser.add_argument("--rounds", type=int, default=9, help="how often both are measured")
    parser.add_argument(
        "--reproduce", choices=("quick", "full"), help="also `teamsight reproduce` on two workers, minutes a round"
    )
    options = parser.parse_args()
    checkouts = HERE, options.other.resolve()
    found: dict[str, list[tuple[float, float]]] = {}
    for number in range(options.rounds + 1):
        measured = [measure(checkout, options.reproduce) for checkout in checkouts]
        # The first round compiles.
        for name in measured[0] if number else ():
            found.setdefault(name, []).append((measured[0][name], measured[1][name]))
    print(f"{'':24s}{'this':>12s}{'other':>12s}{'ratio':>9s}   smallest to largest")
    for name, pairs in found.items():
        ratios = sorted(this / other for this, other in pairs)
        this, other = (min(pair[side] for pair in pairs) for side in (0, 1))
        spread = f"{ratios[0]:.3f} to {ratios[-1]:.3f}"
        print(f"{name:24s}{this:10.1f}µs{other:10.1f}µs{statistics.median(ratios):9.3f}   {spread}")


def measure(checkout: Path, reproduce: str | None) -> dict[str, float]:
    """Return the CPU times of one checkout [µs], by name."""
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    timed = subprocess.run(
        [sys.executable, "-c", MEASURE], cwd=checkout, env=environment, check=True, capture_output=True, text=True
    )
    times: dict[str, float] = json.loads(timed.stdout)
    if reproduce:
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "teamsight", "reproduce", "--workers", "2", "--out", folder]
            command += ["--quick"] if reproduce == "quick" else []
            before = children_seconds()
            subprocess.run(command, cwd=checkout, env=environment, check=True, capture_output=True)
            times[f"reproduce, {reproduce}"] = 1e6 * (children_seconds() - before)
    return times


def children_seconds() -> float:
    """Return the CPU time of all processes that this one has started and that have ended."""
    used = os.times()
    return used.children_user + used.children_system


if __name__ == "__main__":
    main()
