"""What 600 transitions give: `LazyRegression` from many unselected explorations, on the whole grid of Figure 11.

Beside it are teams of the same form whose force of free targets is set by hand: what it observes beyond them was
learned. Nothing was chosen on the root seed "learning: report", neither on its explorations nor on its worlds.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from teamsight.analysis.learning.evaluation import BY_HAND
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.papers.touzet2000.experiments import gains_of
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs.experiment import Experiment, Variant, make_tables
from teamsight.analysis.runs.grid import FULL, QUICK, Grid
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.stats.paired import Interval, interval_of
from teamsight.policies import ACmommt
from teamsight.policies.lazy.lazy_regression import LazyRegression
from teamsight.policies.lazy.readings import TAKEN, TEAMMATE
from teamsight.policies.memory import LazyMemory

ROOT = root("learning: report")
EXPLORATIONS, MANY, STEPS, WORKERS = 40, 200, 600, 2
#: Bandwidths of collective learners, of which the best counts; None is the default.
BANDWIDTHS = (None, 0.2, 0.6)
COOPERATIVE, BY_HAND_LAW, RANDOM = "cooperative", "by hand, f = d", "random walk"
#: Teams that learn nothing, each with its degree of awareness. The strongest A-CMOMMT is the best of those that
#: `teamsight evolve test` screened.
OTHERS = BY_HAND | {
    "A-CMOMMT, wandering": (ACmommt(idle="wander"), "pairwise"),
    "strongest A-CMOMMT": (ACmommt(idle="wander", weights="shared", turn_probability=0, gain=4), "pairwise"),
    RANDOM: ("random-walk", "none"),
}


def main() -> None:
    """Parse the command line, simulate and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a coarse grid and a tenth of the explorations")
    parser.add_argument("--out", type=Path, help="Parquet file for one row a run")
    options = parser.parse_args()
    tables = simulate(QUICK if options.quick else FULL, 0.1 if options.quick else 1.0)
    if options.out:
        pd.concat([one.assign(team=name) for name, one in tables.items()], ignore_index=True).to_parquet(options.out)
    print(report(tables))


def simulate(grid: Grid, share: float) -> dict[str, pd.DataFrame]:
    """Run all teams; each exploration runs every cell once, in the worlds of its replicate."""
    few, many = round(EXPLORATIONS * share), round(MANY * share)
    memories = [explore(Exploration(seed=model_seed(ROOT, number, 5, 10, 3.0))) for number in range(many)]
    experiments = [
        Experiment(COOPERATIVE, cooperative(memories), grid.cells, replicates=many),
        *(Experiment(named(one), collective(memories, one), grid.cells, replicates=few) for one in BANDWIDTHS),
        *(
            Experiment(name, {"policy": policy, "awareness": degree}, grid.cells, replicates=few)
            for name, (policy, degree) in OTHERS.items()
        ),
    ]
    with WorkerPool(WORKERS) as pool:
        (tables,) = make_tables([({}, experiments)], pool, root=ROOT, runs=1, steps=STEPS)
    return tables


def cooperative(memories: list[LazyMemory]) -> Callable[[object, int], Variant]:
    """Return the learners with all 32 inputs, by number of the exploration."""
    policies = [LazyRegression(memory) for memory in memories]
    return partial(_variant, policies, "ring")


def collective(memories: list[LazyMemory], bandwidth: float | None) -> Callable[[object, int], Variant]:
    """Return the learners with the robot's own 16 inputs, by number of the exploration."""
    given = {} if bandwidth is None else {"bandwidth": bandwidth}
    policies = [LazyRegression(memory, inputs=memory.own, **given) for memory in memories[: round(len(memories) / 5)]]
    return partial(_variant, policies, "none")


def _variant(policies: list[LazyRegression], awareness: str, setting: object, number: int) -> Variant:
    policy = policies[number]
    columns = {
        "exploration": policy.memory.settings["seed"],
        "heeds_teammates": policy.learned[[TAKEN, TEAMMATE]].any(),
    }
    return Variant({"policy": policy, "awareness": awareness}, columns)


def named(bandwidth: float | None) -> str:
    """Return the name of a collective learner."""
    return f"collective, bandwidth {LazyRegression.bandwidth if bandwidth is None else bandwidth:g}"


def report(tables: dict[str, pd.DataFrame]) -> str:
    """Return what each team observes, and by how much the learned one and one by hand exceed it, as Markdown."""
    count, learned = tables[RANDOM]["replicate"].nunique(), tables[COOPERATIVE]
    few = {name: table[table["replicate"] < count] for name, table in tables.items()}
    rows = []
    for name, table in tables.items():
        means = 100 * table.groupby("replicate")["observed_fraction"].mean().to_numpy()
        more = [
            "" if name == one else written(gains_of(few[one], few[name]).average(), sign="+")
            for one in (COOPERATIVE, BY_HAND_LAW)
        ]
        rows.append([name, str(len(means)), written(interval_of(means)), *more, f"{means.min():.1f}"])
    means = 100 * learned.groupby("replicate")["observed_fraction"].mean().to_numpy()
    below = ", ".join(f"{(means < limit).sum()} below {limit} %" for limit in (60, 70, 75))
    quantiles = ", ".join(f"{one:.1f}" for one in np.quantile(means, (0.01, 0.05, 0.5)))
    heeding = learned.groupby("replicate")["heeds_teammates"].first().sum()
    heads = [f"{one} minus this, {count} explorations [pp]" for one in (COOPERATIVE, BY_HAND_LAW)]
    table = markdown.table(["team", "explorations", "observed targets [%]", *heads, "worst [%]"], rows)
    return (
        f"{table}\n\nof {len(means)} cooperative teams: {below}; 1 %, 5 % and 50 % quantiles: {quantiles} %; in "
        f"{heeding} taken targets or teammates exert a force"
    )


def written(one: Interval, sign: str = "") -> str:
    """Return a mean with half its 95 % interval."""
    return f"{one.mean:{sign}.2f} ± {one.high - one.mean:.2f}"


if __name__ == "__main__":
    main()
