"""Figure 11: how long the surfaces of its two readings take, on two cores."""

from __future__ import annotations

import time

from measure import Row

from teamsight.analysis.papers.touzet2000.experiments import EXPLORATIONS, LEARNED, experiments_of
from teamsight.analysis.runs.experiment import make_tables
from teamsight.analysis.runs.grid import FULL, QUICK, Grid
from teamsight.analysis.runs.processes import WorkerPool

RUNS, STEPS, WORKERS = 5, 600, 2


def measure_learning(quick: bool) -> list[Row]:
    """Make all four surfaces once, at the defaults; the coarse grid has no goal."""
    grid: Grid = QUICK if quick else FULL
    experiments = experiments_of(LEARNED)
    decisions = len(experiments) * RUNS * EXPLORATIONS * STEPS * sum(robots for robots, _ in grid.cells)
    with WorkerPool(WORKERS) as pool:
        begin = time.perf_counter()
        make_tables([({}, experiments)], pool, grid=grid, root=2000, runs=RUNS, steps=STEPS)
        taken = time.perf_counter() - begin
    where = f"{RUNS * EXPLORATIONS} explorations, {'coarse' if quick else 'full'} grid"
    return [
        Row(f"Figure 11, {where}, {WORKERS} workers, wall time", "s", taken, most=None if quick else 180),
        Row(f"Figure 11, {where}: decisions a second", "million", decisions / taken / 1e6),
    ]
