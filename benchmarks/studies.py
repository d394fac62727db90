"""How studies use two cores: worker processes against one, and Dask against worker processes."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from measure import Row, interleave, median, ratio

from teamsight.analysis.runs.dask_executor import DaskExecutor
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.simulate import IMPORTS
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.analysis.studies.study import Study
from teamsight.analysis.studies.sweep import sweep

MODULES = (*IMPORTS, "teamsight.analysis.studies.shard")
RANGES = tuple(round(0.5 + 0.1 * number, 1) for number in range(10))


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
    fixed = {"robots": 15, "targets": 15, "radius": 5.0, "policy": "a-cmommt"}
    study = Study(fixed=fixed, axes={"awareness_range": RANGES}, replicates=runs // len(RANGES), steps=600)
    with WorkerPool(1, MODULES) as one, WorkerPool(2, MODULES) as two, DaskExecutor(workers=2) as dask:
        engines: dict[str, Executor] = {"one": one, "two": two, "dask": dask}
        for engine in engines.values():
            seconds(Study(fixed=fixed, axes={"awareness_range": RANGES}, replicates=4, steps=600), engine)
        taken = interleave(
            {name: (lambda engine=engine: seconds(study, engine)) for name, engine in engines.items()}, rounds
        )
    return [
        ratio(f"two workers against one, {runs:,} runs of 600 steps", taken["one"], taken["two"], least=1.85),
        ratio("Dask with two workers against two local ones", taken["two"], taken["dask"], least=0.8),
        median("one worker", "runs/s", [runs / one for one in taken["one"]]),
        median("two workers", "runs/s", [runs / one for one in taken["two"]]),
        median("Dask, two workers", "runs/s", [runs / one for one in taken["dask"]]),
    ]


def seconds(study: Study, engine: Executor) -> float:
    """Return how long a sweep of a study takes, parts on disk included [s]."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        sweep(study, Path(folder) / "study", executor=engine)
        return time.perf_counter() - begin
