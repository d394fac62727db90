"""Figure 11: how long the two learned surfaces take, on two cores."""

from __future__ import annotations

import time

from measure import Row

from teamsight.analysis.crew import Crew
from teamsight.analysis.execute import IMPORTS, Request, make_tables
from teamsight.analysis.experiments import chosen
from teamsight.analysis.study import PAPER, QUICK, Grid

RUNS, STEPS, WORKERS = 5, 600, 2


def measure_learning(quick: bool) -> list[Row]:
    """Make both surfaces once, at the defaults; the coarse grid has no goal."""
    grid: Grid = QUICK if quick else PAPER
    experiments = chosen(("lazy-cooperative", "lazy-collective"), grid, {})
    queries = len(experiments) * RUNS * STEPS * sum(robots for robots, _ in grid.cells)
    with Crew(WORKERS, IMPORTS) as crew:
        begin = time.perf_counter()
        make_tables(crew, [Request({}, experiments)], root=2000, runs=RUNS, steps=STEPS)
        taken = time.perf_counter() - begin
    where = "coarse grid" if quick else "full grid"
    return [
        Row(f"Figure 11, {where}, {WORKERS} workers, wall time", "s", taken, most=None if quick else 120),
        Row(f"Figure 11, {where}: decisions a second", "million", queries / taken / 1e6),
    ]
