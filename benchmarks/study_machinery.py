"""Which share of a study's CPU time is not its runs: ``python benchmarks/study_machinery.py``.

Sweeps are made in this process. A run lasts from the begin of its world to the end of its measure, which is measured
within the sweep: two sweeps differ by more than the machinery takes. Shards and heartbeats last seconds of the wall
clock, so other work on the machine makes the share larger.
"""

from __future__ import annotations

import argparse
import contextlib
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any
from unittest import mock

from measure import cpu_seconds

from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.runs import run_many
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import sweep

RADII = tuple(2.0 + 0.05 * number for number in range(100))
#: By name: robots, targets, steps of a run, runs, and the most of the CPU time that the machinery may take.
KINDS = {
    "very short": (2, 2, 5, 100_000, None),
    "short": (15, 15, 60, 20_000, None),
    "usual": (15, 15, 600, 5_000, 0.02),
}


def study_of(name: str, share: float) -> Study:
    """Return the study of a kind of run, or of a share of its runs."""
    robots, targets, steps, runs, _ = KINDS[name]
    fixed = {"robots": robots, "targets": targets, "policy": "a-cmommt"}
    return Study(fixed=fixed, axes={"radius": RADII}, replicates=max(1, round(runs * share / len(RADII))), steps=steps)


def swept(study: Study) -> tuple[float, float]:
    """Return the CPU time of a sweep in this process, its files included, and that of its runs [s]."""
    with tempfile.TemporaryDirectory() as folder, timed_runs() as taken:
        return cpu_seconds(lambda: sweep(study, Path(folder, "study"))), sum(taken)


@contextlib.contextmanager
def timed_runs() -> Iterator[list[float]]:
    """Append the CPU time of each run within the block [s]."""
    taken: list[float] = []

    def begin(*arguments: Any, plain: Callable[..., Any] = ReusedWorlds.begin) -> Any:
        taken.append(-time.process_time())
        return plain(*arguments)

    def summary(*arguments: Any, plain: Callable[..., Any] = run_many.summary) -> Any:
        found = plain(*arguments)
        taken[-1] += time.process_time()
        return found

    with mock.patch.object(ReusedWorlds, "begin", begin), mock.patch.object(run_many, "summary", summary):
        yield taken


def lines(names: Iterable[str], rounds: int, share: float) -> Iterator[tuple[str, bool]]:
    """Yield a line for each kind of run, and whether its goal is met."""
    for name in names:
        robots, targets, steps, _, most = KINDS[name]
        study = study_of(name, share)
        swept(study_of(name, 0.0))  # compiles and imports
        taken = [swept(study) for _ in range(rounds)]
        shares = [1 - runs / whole for whole, runs in taken]
        middle, each = statistics.median(shares), 1e6 * statistics.median(whole for whole, _ in taken) / study.runs
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
