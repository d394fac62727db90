"""Many runs with run_many, and the same through mesa's batch_run."""

from __future__ import annotations

import mesa
import pandas as pd

from teamsight import CMOMMT, run_many

SETTINGS = {"robots": [5, 10], "radius": [2.0, 4.0], "awareness": ["none", "pairwise"]}
SEEDS = [1, 2]


def sweep(workers: int, steps: int = 100) -> pd.DataFrame:
    """Return one row for each run."""
    return run_many(SETTINGS, steps=steps, seeds=SEEDS, workers=workers)


def sweep_with_mesa(processes: int, steps: int = 100) -> pd.DataFrame:
    """Return the last row of each run; sweep `rng`, since mesa 3.5 overwrites a parameter `seed`."""
    rows = mesa.batch_run(
        CMOMMT,
        {**SETTINGS, "rng": SEEDS},
        max_steps=steps,
        number_processes=processes,
        data_collection_period=-1,
        display_progress=False,
    )
    return pd.DataFrame(rows)


def main() -> None:
    table = sweep(workers=2)
    print(table.groupby(["radius", "robots", "awareness"])[["observed_fraction", "max_neighbours"]].mean())


# Worker processes import this file; without this line each of them would start the sweep again.
if __name__ == "__main__":
    main()
