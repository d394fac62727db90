"""A sweep through mesa's own batch_run, on two processes.

Sweep `rng`, not `seed`: mesa 3.5 writes its own value over a parameter of that name.
"""

from __future__ import annotations

import mesa
import pandas as pd

from teamsight import CMOMMT


def sweep(processes: int, steps: int = 100) -> pd.DataFrame:
    """Return the last row of each run, with the parameters that it was given."""
    parameters = {"robots": [5, 10], "radius": [2.0, 4.0], "awareness": ["none", "pairwise"], "rng": [1, 2]}
    rows = mesa.batch_run(
        CMOMMT,
        parameters,
        max_steps=steps,
        number_processes=processes,
        data_collection_period=-1,
        display_progress=False,
    )
    return pd.DataFrame(rows)


def main() -> None:
    table = sweep(processes=2)
    print(table.groupby(["radius", "robots", "awareness"])[["observed_fraction", "max_neighbours"]].mean())


# Worker processes import this file; without this line each of them would start the sweep again.
if __name__ == "__main__":
    main()
