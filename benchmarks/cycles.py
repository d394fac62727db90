"""What asynchronous cycles cost: robots that decide at times of their own, against robots that decide together."""

from __future__ import annotations

import math
from collections.abc import Callable

from measure import Row, cpu_seconds, interleave, ratio

from teamsight import CMOMMT, Cycle

PERIOD = 10
STEPS = 600
ASYNCHRONOUS = Cycle(PERIOD, phase="random", jitter=PERIOD / 2)
TOGETHER = Cycle(PERIOD)

#: Policies, each with a degree of awareness.
POLICIES = {"random walk": ("random-walk", "none"), "A-CMOMMT": ("a-cmommt", "pairwise"),
            "learned (ring)": ("lazy-cooperative", "ring")}  # fmt: skip
#: Robots, as many targets, steps and worlds.
SIZES = {"15 + 15": (15, STEPS, 8), "1,000 + 1,000": (1_000, 60, 1)}


def measure_cycles(rounds: int) -> list[Row]:
    """Compare the three for each policy and size, side by side."""
    rows = []
    for size, (robots, steps, worlds) in SIZES.items():
        for name, (policy, awareness) in POLICIES.items():
            kind = {"policy": policy, "awareness": awareness, "robots": robots}
            taken = interleave(
                {
                    "asynchronous": _runs(kind, ASYNCHRONOUS, steps, worlds),
                    "together": _runs(kind, TOGETHER, steps, worlds),
                    # As many decisions of each robot, and a tenth of the steps.
                    "plain": _runs(kind, Cycle(), steps // PERIOD, worlds),
                },
                rounds,
            )
            what = f"{size}, {name}: asynchronous cycles"
            rows.append(ratio(f"{what} / all at once", taken["asynchronous"], taken["together"], most=1.3))
            rows.append(ratio(f"{what} / as many decisions, every step", taken["asynchronous"], taken["plain"]))
    return rows


def _runs(kind: dict[str, object], cycle: Cycle, steps: int, worlds: int) -> Callable[[], float]:
    robots = int(str(kind["robots"]))
    radius = 5.0 * math.sqrt(robots / 15)
    models = [CMOMMT(targets=robots, radius=radius, cycle=cycle, rng=seed, **kind) for seed in range(worlds)]  # type: ignore[arg-type]

    def run() -> float:
        for seed, model in enumerate(models):
            model.reset(seed)
        return cpu_seconds(lambda: [model.run(steps) for model in models])

    run()
    return run
