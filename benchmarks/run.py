"""Compare teamsight with plain mesa and plain C on one model and machine, in one run: python benchmarks/run.py"""

from __future__ import annotations

import statistics
import time

from numpy_policy import NumpyACmommt
from plain_c import PlainC
from plain_mesa import PlainCMOMMT

from teamsight import CMOMMT

ROBOTS, TARGETS, RADIUS = 15, 15, 5.0


def cpu(action, steps):
    begin = time.process_time()
    action()
    return (time.process_time() - begin) / steps


def steps_of(model, count):
    for _ in range(count):
        model.step()


def main() -> None:
    c = PlainC()
    print("first difference from C:", [c.first_difference(n, 15, r, 3000, 1) for n, r in ((15, 5.0), (30, 2.0))])
    settings = dict(robots=ROBOTS, targets=TARGETS, radius=RADIUS, rng=1)
    runner, stepper = CMOMMT(**settings), CMOMMT(**settings)
    numpy = CMOMMT(**settings, policy=NumpyACmommt())
    mesa = PlainCMOMMT(ROBOTS, TARGETS, RADIUS)
    for model in (runner, stepper, numpy, mesa):
        steps_of(model, 50)
    rounds = []
    for seed in range(9):
        rounds.append({
            "run": cpu(lambda: runner.run(60_000), 60_000),
            "c": c.run(ROBOTS, TARGETS, RADIUS, 60_000, "--seed", str(seed))["cpu_seconds"] / 60_000,
            "mesa": cpu(lambda: steps_of(mesa, 300), 300),
            "step": cpu(lambda: steps_of(stepper, 2000), 2000),
            "numpy": cpu(lambda: steps_of(numpy, 500), 500),
        })
    for name in rounds[0]:
        print(f"{name:6} {1 / statistics.median(r[name] for r in rounds):12,.0f} world-steps a second")
    for a, b in (("mesa", "run"), ("run", "c"), ("mesa", "step"), ("mesa", "numpy")):
        ratios = [r[a] / r[b] for r in rounds]
        print(f"{a} / {b}: {statistics.median(ratios):.2f}  ({min(ratios):.2f} to {max(ratios):.2f})")


if __name__ == "__main__":
    main()
