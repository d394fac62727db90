"""Comparison: the learned rule against the strongest A-CMOMMT, paired on common noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.evolution.cma import DELTA, GRID, SCREEN, STEPS
from teamsight.analysis.runs.experiment import Experiment, Request, make_tables
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.analysis.stats.paired import cell_means, half_width, paired
from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import OCCASIONS, WEIGHTS
from teamsight.policies.handmade.idle import BEHAVIOURS

RULES_OF_A_CMOMMT = ("idle", "idle_when", "weights")
#: No cell's interval may lie wholly below this [percentage points].
WORST = -2.0

Watch = Callable[[float, float], None]


class Gain(NamedTuple):
    """A mean difference in percentage points, with its 95 % interval."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.mean:+.2f} ({self.low:+.2f} to {self.high:+.2f})"


def screen(pool: WorkerPool, runs: int, watch: Watch = lambda done, total: None) -> pd.DataFrame:
    """Return what each setting of A-CMOMMT under pairwise awareness observes over the grid, the strongest first.

    Returns
    -------
    DataFrame
        Columns idle, idle_when, weights, observed [%].
    """
    settings = [dict(zip(RULES_OF_A_CMOMMT, rules, strict=True)) for rules in product(BEHAVIOURS, OCCASIONS, WEIGHTS)]
    experiment = Experiment("a-cmommt", {"policy": "a-cmommt", "awareness": "pairwise"}, GRID.cells)
    made = make_tables(
        [Request({"policy_options": options}, [experiment]) for options in settings],
        pool,
        root=SCREEN,
        runs=runs,
        steps=STEPS,
        progress=watch,
    )
    observed = [100.0 * float(tables["a-cmommt"]["observed_fraction"].mean()) for tables in made]
    table = pd.DataFrame(settings).assign(observed=observed)
    return table.sort_values("observed", ascending=False, ignore_index=True, kind="stable")


def compare(
    pool: WorkerPool,
    policies: Mapping[str, Evolved],
    strongest: Mapping[str, Any],
    *,
    root: int,
    runs: int,
    watch: Watch = lambda done, total: None,
) -> dict[str, pd.DataFrame]:
    """Return, for each policy under ring awareness, its runs beside those of A-CMOMMT in its strongest setting.

    Returns
    -------
    dict of str to DataFrame
        As `paired` returns them.
    """
    experiments = [
        Experiment(name, {"policy": policy, "awareness": "ring", "delta": DELTA}, GRID.cells)
        for name, policy in policies.items()
    ]
    rival = Experiment("strongest", {"policy": "a-cmommt", "awareness": "pairwise"}, GRID.cells)
    request = Request({"policy_options": dict(strongest)}, [*experiments, rival])
    (tables,) = make_tables([request], pool, root=root, runs=runs, steps=STEPS, progress=watch)
    return {name: paired(tables[name], tables["strongest"]) for name in policies}


def overall(differences: pd.DataFrame) -> Gain:
    """Return the mean difference over the grid; replicates are what its interval rests on."""
    means = 100.0 * differences.groupby("replicate")["difference"].mean().to_numpy()
    count = np.array([len(means)])
    se = np.array([means.std(ddof=1) / np.sqrt(len(means))]) if len(means) > 1 else np.array([np.nan])
    wide = float(half_width(se, count)[0])
    return Gain(float(means.mean()), float(means.mean()) - wide, float(means.mean()) + wide)


def by_cell(differences: pd.DataFrame) -> pd.DataFrame:
    """Return mean and 95 % interval for each cell [percentage points]."""
    cells = cell_means(differences, "difference")
    return cells.assign(**{name: 100.0 * cells[name] for name in ("mean", "se", "low", "high")})
