"""Compare the evolved policy with the strongest A-CMOMMT, paired on common noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.evolution.cma import DELTA, GRID, SCREEN, STEPS
from teamsight.analysis.runs.experiment import Experiment, Request, make_tables
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Progress
from teamsight.analysis.stats.paired import cell_means, half_width, paired
from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import OCCASIONS, WEIGHTS, ACmommt
from teamsight.policies.handmade.forces import BEHAVIOURS

#: Options of A-CMOMMT of which all combinations are screened, and their values.
RULES: Mapping[str, tuple[str, ...]] = {
    "idle": tuple(BEHAVIOURS), "idle_when": tuple(OCCASIONS), "weights": tuple(WEIGHTS),
}  # fmt: skip
#: Constants that are then screened under the best rules, and their values.
CONSTANTS: Mapping[str, tuple[float, ...]] = {
    "turn_probability": (0.0, 0.01, 0.02, 0.05),
    "gain": (0.5, 1.0, 2.0, 4.0, 8.0),
}
OPTIONS = (*RULES, *CONSTANTS)
#: Number of combinations of rules under which constants are screened.
FINALISTS = 3
#: Gain [percentage points] below which no cell's interval may lie as a whole.
WORST = -2.0


class Gain(NamedTuple):
    """A mean difference with its 95 % confidence interval [percentage points]."""

    mean: float
    low: float
    high: float

    def __str__(self) -> str:
        # Rounded first, and 0 added: a number that rounds to 0 is not negative.
        mean, low, high = (f"{round(value, 2) + 0.0:+.2f}" for value in self)
        return f"{mean} ({low} to {high})"


def screen(runs: int, pool: WorkerPool | None = None, progress: Progress = lambda done, total: None) -> pd.DataFrame:
    """Return what A-CMOMMT observes over the grid with combinations of its options, the best first.

    First all `RULES` are screened with the default constants, then all `CONSTANTS` under the best rules.

    Parameters
    ----------
    runs : int
        Runs of each cell.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    DataFrame
        Columns `OPTIONS`, observed [%].
    """
    rules = [default_constants() | one for one in _combinations(RULES)]
    first = _observed(rules, runs, pool, progress)
    constants = [
        best | one
        for best in options_of(first)[:FINALISTS]
        for one in _combinations(CONSTANTS)
        if one != default_constants() and _differs(best, one)
    ]
    table = pd.concat([first, _observed(constants, runs, pool, progress)])
    return table.sort_values("observed", ascending=False, ignore_index=True, kind="stable")


def default_constants() -> dict[str, float]:
    """Return the default values of `CONSTANTS`."""
    policy = ACmommt()
    return {name: getattr(policy, name) for name in CONSTANTS}


def options_of(screened: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the options of A-CMOMMT in each row of a table."""
    return [dict(zip(OPTIONS, row, strict=True)) for row in screened[list(OPTIONS)].itertuples(index=False)]


def _combinations(values: Mapping[str, tuple[Any, ...]]) -> list[dict[str, Any]]:
    return [dict(zip(values, chosen, strict=True)) for chosen in product(*values.values())]


def _differs(best: Mapping[str, Any], constants: Mapping[str, float]) -> bool:
    """Return whether A-CMOMMT uses the constants: a robot that does not wander has no turn probability."""
    return best["idle"] == "wander" or constants["turn_probability"] == default_constants()["turn_probability"]


def _observed(
    options: Sequence[Mapping[str, Any]], runs: int, pool: WorkerPool | None, progress: Progress
) -> pd.DataFrame:
    """Return what A-CMOMMT observes over the grid with each of some options, the best first."""
    experiment = Experiment("a-cmommt", {"policy": "a-cmommt", "awareness": "pairwise"}, GRID.cells)
    requests = [Request({"policy_options": one}, [experiment]) for one in options]
    made = make_tables(requests, pool, root=SCREEN, runs=runs, steps=STEPS, progress=progress)
    observed = [100.0 * float(tables["a-cmommt"]["observed_fraction"].mean()) for tables in made]
    table = pd.DataFrame([{name: one[name] for name in OPTIONS} for one in options]).assign(observed=observed)
    return table.sort_values("observed", ascending=False, ignore_index=True, kind="stable")


def compare(
    policies: Mapping[str, Evolved],
    options: Mapping[str, Any],
    pool: WorkerPool | None = None,
    *,
    root: int,
    runs: int,
    progress: Progress = lambda done, total: None,
) -> dict[str, pd.DataFrame]:
    """Return the runs of each policy under ring awareness, paired with those of A-CMOMMT under pairwise awareness.

    Parameters
    ----------
    policies : mapping of str to Evolved
        The policies by name.
    options : mapping
        Options of A-CMOMMT.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    root : int
        Root seed.
    runs : int
        Runs of each cell.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    dict of str to DataFrame
        As `paired` returns them.
    """
    experiments = [
        Experiment(name, {"policy": policy, "awareness": "ring", "delta": DELTA}, GRID.cells)
        for name, policy in policies.items()
    ]
    baseline = Experiment("a-cmommt", {"policy": "a-cmommt", "awareness": "pairwise"}, GRID.cells)
    request = Request({"policy_options": dict(options)}, [*experiments, baseline])
    (tables,) = make_tables([request], pool, root=root, runs=runs, steps=STEPS, progress=progress)
    return {name: paired(tables[name], tables["a-cmommt"]) for name in policies}


def overall(differences: pd.DataFrame) -> Gain:
    """Return the mean difference over the grid, with an interval over replicates."""
    means = 100.0 * differences.groupby("replicate")["difference"].mean().to_numpy()
    count = np.array([len(means)])
    se = np.array([means.std(ddof=1) / np.sqrt(len(means))]) if len(means) > 1 else np.array([np.nan])
    wide = float(half_width(se, count)[0])
    return Gain(float(means.mean()), float(means.mean()) - wide, float(means.mean()) + wide)


def by_cell(differences: pd.DataFrame) -> pd.DataFrame:
    """Return mean and 95 % interval of each cell [percentage points]."""
    cells = cell_means(differences, "difference")
    return cells.assign(**{name: 100.0 * cells[name] for name in ("mean", "se", "low", "high")})
