"""What the designed feature of the regression is worth: that a teammate may be nearer to a target, and the prior on it.

python benchmarks/designed_feature.py [--explorations 100] [--workers 2]

Each exploration of 600 transitions is used by every treatment and reward, in the same worlds; intervals are 95 %, over
explorations. The table is in docs/learning-results.md.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from scipy import stats

from teamsight.agents.awareness import Awareness, NoAwareness, RingAwareness
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.registry import REWARDS
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, root
from teamsight.analysis.runs.simulate import run_all
from teamsight.policies import LazyRegression
from teamsight.policies.lazy.readings import FREE, KINDS, TAKEN
from teamsight.policies.memory import LazyMemory

ROOT = root("designed feature")
CELLS = [(robots, radius) for robots in (5, 10, 20, 30) for radius in (2.0, 4.0, 8.0)]
TARGETS, STEPS = 15, 600
CHOSEN = ("keep", "team", "own")


def undivided(memory: LazyMemory, reward: Any) -> LazyRegression:
    """Return a cooperative learner whose law for all targets is the collective one."""
    policy = LazyRegression(memory, reward)
    law = LazyRegression(memory, reward, inputs=memory.own).forces[KINDS[FREE]]
    forces = {**policy.forces, KINDS[FREE]: law, KINDS[TAKEN]: law}
    object.__setattr__(policy, "forces", forces)
    return policy


TREATMENTS: dict[str, Any] = {
    "cooperative": lambda memory, reward: (LazyRegression(memory, reward), RingAwareness()),
    "without the prior": lambda memory, reward: (LazyRegression(memory, reward, significance=0), RingAwareness()),
    "without the feature": lambda memory, reward: (undivided(memory, reward), RingAwareness()),
    "collective": lambda memory, reward: (LazyRegression(memory, reward, inputs=memory.own), NoAwareness()),
}


def memories(count: int) -> list[LazyMemory]:
    """Return explorations of which none was selected."""
    return [explore(Exploration(seed=model_seed(ROOT, -1 - number, 5, 10, 3.0))) for number in range(count)]


def runs_of(policy: LazyRegression, awareness: Awareness, replicate: int) -> list[Run]:
    """Return a run in each cell."""
    return [
        Run(
            {"robots": robots, "targets": TARGETS, "radius": radius, "policy": policy, "awareness": awareness},
            model_seed(ROOT, replicate, robots, TARGETS, radius),
            STEPS,
        )
        for robots, radius in CELLS
    ]


def interval(values: npt.NDArray[np.float64]) -> str:
    """Return the mean and half of its 95 % interval."""
    half = stats.sem(values) * stats.t.ppf(0.975, len(values) - 1)
    return f"{values.mean():.1f} ± {half:.1f}"


def main() -> None:
    """Run all treatments and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--explorations", type=int, default=100)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    explored = memories(options.explorations)
    names = [(reward, treatment) for reward in CHOSEN for treatment in TREATMENTS]
    runs = [
        run
        for reward, treatment in names
        for number, memory in enumerate(explored)
        for run in runs_of(*TREATMENTS[treatment](memory, REWARDS[reward]), number)
    ]
    with WorkerPool(options.workers) as pool:
        results = run_all(runs, pool)
    shares = 100 * np.array([result.observed_fraction for result in results])
    means = shares.reshape(len(names), len(explored), len(CELLS)).mean(axis=2)
    table = Table(box=SIMPLE_HEAD)
    for heading in ("reward", "treatment", "observed targets [%]", "worst exploration", "minus cooperative"):
        table.add_column(heading)
    of = dict(zip(names, means, strict=True))
    for (reward, treatment), found in of.items():
        less = "" if treatment == "cooperative" else interval(found - of[reward, "cooperative"])
        table.add_row(reward, treatment, interval(found), f"{found.min():.1f}", less)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
