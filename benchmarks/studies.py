"""How studies use two cores: worker processes against one, and Dask against worker processes."""

from __future__ import annotations

import tempfile
import time
from collections import deque
from pathlib import Path

from measure import Row, interleave, median, ratio

from teamsight import CMOMMT
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.runs.dask import DaskExecutor
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import sweep

RANGES = tuple(round(0.5 + 0.1 * number, 1) for number in range(10))
FIXED = {"robots": 15, "targets": 15, "radius": 5.0, "policy": "a-cmommt"}
STEPS = 600
# Runs of a job without a study.
BARE = 50


def measure_engines(rounds: int, quick: bool) -> list[Row]:
    """Sweep one study by each engine, side by side; all engines have been started and have compiled.

    Parameters
    ----------
    rounds : int
        How often; a round takes about half a minute, a sixth of that if `quick`.
    quick : bool
        Make 800 runs in place of 5,000.
    """
    runs = 800 if quick else 5_000
    study, first = (_study(count // len(RANGES)) for count in (runs, 40))
    with WorkerPool(1) as one, WorkerPool(2) as two, DaskExecutor(workers=2) as dask:
        engines: dict[str, Executor] = {"one": one, "two": two, "dask": dask}
        for engine in engines.values():
            seconds(first, engine)
        work = {name: (lambda engine=engine: seconds(study, engine)) for name, engine in engines.items()}
        work["bare one"] = lambda: bare_seconds(runs, one)
        work["bare two"] = lambda: bare_seconds(runs, two)
        taken = interleave(work, rounds)
    return [
        ratio(f"two workers against one, {runs:,} runs of {STEPS} steps", taken["one"], taken["two"], least=1.85),
        ratio("the same runs in the same workers without a study", taken["bare one"], taken["bare two"]),
        ratio("Dask with two workers against two local ones", taken["two"], taken["dask"], least=0.8),
        median("one worker", "runs/s", [runs / one for one in taken["one"]]),
        median("two workers", "runs/s", [runs / one for one in taken["two"]]),
        median("Dask, two workers", "runs/s", [runs / one for one in taken["dask"]]),
    ]


def _study(replicates: int) -> Study:
    return Study(fixed=FIXED, axes={"awareness_range": RANGES}, replicates=replicates, steps=STEPS)


def seconds(study: Study, engine: Executor) -> float:
    """Return how long a sweep of a study takes, parts on disk included [s]."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        sweep(study, Path(folder) / "study", executor=engine)
        return time.perf_counter() - begin


def bare_seconds(runs: int, pool: WorkerPool) -> float:
    """Return how long the same runs take in the same workers, in small jobs that write nothing [s]."""
    jobs = [(RANGES[number % len(RANGES)], number * BARE) for number in range(runs // BARE)]
    begin = time.perf_counter()
    deque(pool.outcomes(bare_runs, jobs), maxlen=0)
    return time.perf_counter() - begin


def bare_runs(job: tuple[float, int]) -> None:
    """Make `BARE` runs of one setting."""
    awareness_range, first = job
    worlds, parameters = ReusedWorlds(), {**FIXED, "awareness_range": awareness_range}
    worlds.expect((parameters, seed) for seed in range(first, first + BARE))
    for seed in range(first, first + BARE):
        worlds.begin(CMOMMT, parameters, seed).run(STEPS)
    worlds.close()
