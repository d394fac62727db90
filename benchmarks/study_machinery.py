"""Which share of a study's CPU time is not its runs: a sweep beside a plain loop that makes the same runs.

The loop uses `ReusedWorlds` and calls the measure, in the order in which the sweep makes its runs, and keeps nothing.
Both are in this process, in turn, round after round: ``python benchmarks/study_machinery.py``.
"""

from __future__ import annotations

import argparse
import contextlib
import statistics
import sys
import tempfile
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from measure import cpu_seconds, interleave

from teamsight import CMOMMT
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.runs.run_many import summary
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import Selection, sweep

RADII = tuple(2.0 + 0.05 * number for number in range(100))
#: By name: robots, targets, steps of a run, runs, and the most of the CPU time that the machinery may take.
KINDS = {
    "very short": (2, 2, 5, 100_000, None),
    "short": (15, 15, 60, 20_000, None),
    "usual": (15, 15, 600, 5_000, 0.02),
}
# Runs that the loop announces at a time, as the sweep does.
_ANNOUNCED = 5_000


def study_of(name: str, share: float) -> Study:
    """Return the study of a kind of run, or of a share of its runs."""
    robots, targets, steps, runs, _ = KINDS[name]
    fixed = {"robots": robots, "targets": targets, "policy": "a-cmommt"}
    return Study(fixed=fixed, axes={"radius": RADII}, replicates=max(1, round(runs * share / len(RADII))), steps=steps)


def swept(study: Study) -> float:
    """Return the CPU time of a sweep in this process, its files included [s]."""
    with tempfile.TemporaryDirectory() as folder:
        return cpu_seconds(lambda: sweep(study, Path(folder, "study")))


def looped(study: Study) -> float:
    """Return the CPU time of a loop that makes the same runs [s]."""
    plan = study.plan()
    runs = [
        (plan.components(setting), plan.seed(setting, replicate))
        for setting, replicate in Selection(plan, np.full(plan.settings, study.replicates))
    ]

    def make() -> None:
        with contextlib.closing(ReusedWorlds()) as worlds:
            for first in range(0, len(runs), _ANNOUNCED):
                chunk = runs[first : first + _ANNOUNCED]
                worlds.expect(chunk)
                for parameters, seed in chunk:
                    summary(worlds.begin(CMOMMT, parameters, seed), study.steps)

    return cpu_seconds(make)


def lines(names: Iterable[str], rounds: int, share: float) -> Iterator[tuple[str, bool]]:
    """Yield a line for each kind of run, and whether its goal is met."""
    for name in names:
        robots, targets, steps, _, most = KINDS[name]
        study = study_of(name, share)
        # Compile, and import.
        small = study_of(name, 0.0)
        swept(small), looped(small)
        taken = interleave({"sweep": partial(swept, study), "loop": partial(looped, study)}, rounds)
        shares = [1 - loop / whole for loop, whole in zip(taken["loop"], taken["sweep"], strict=True)]
        middle, each = statistics.median(shares), 1e6 * statistics.median(taken["sweep"]) / study.runs
        goal = "" if most is None else f", goal at most {most:.0%}"
        yield (
            f"{name}: {study.runs:,} runs of {steps} steps, {robots} + {targets} bodies: {each:,.0f} µs a run, of "
            f"which {middle:.1%} ({min(shares):.1%} to {max(shares):.1%}) are machinery, {each * middle:,.0f} µs{goal}",
            most is None or middle <= most,
        )


def main() -> int:
    """Print the shares; the exit status is 1 if a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", choices=list(KINDS), help="a kind of run; may be repeated [all]")
    parser.add_argument("--rounds", type=int, default=3, help="how often each is measured [3]")
    parser.add_argument("--share", type=float, default=1.0, help="make a share of the runs only [1]")
    options = parser.parse_args()
    met = True
    for line, is_met in lines(options.only or KINDS, options.rounds, options.share):
        print(line, flush=True)
        met &= is_met
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())
