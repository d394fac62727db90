"""The constants with which hunters of `pursuit` learn: the steps of a trial against α, T and the steps of learning.

python benchmarks/pursuit_constants.py [--trainings 5] [--runs 40]

Tan (1993) has α = 0.8 and T = 0.4. Each training has a seed of its own, and all teams are measured in the same worlds;
intervals are 95 %, over trainings. The table is in docs/tasks/pursuit.md.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from teamsight import TASKS, run_many
from teamsight.analysis.plot import markdown
from teamsight.analysis.runs.run import task_seed
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.stats.paired import interval_of
from teamsight.policies.online.prey_q import PreyQ
from teamsight.tasks.pursuit import Pursuit

TASK = TASKS["pursuit"]
ROOT = root("pursuit: constants")
RATES, TEMPERATURES, STEPS = (0.1, 0.3, 0.8), (0.01, 0.03, 0.1, 0.4), (20_000, 100_000, 500_000)


def learned(rate: float, temperature: float, number: int) -> Iterable[PreyQ]:
    """Let one team learn, and return what it knows after each number of steps."""
    depth = TASK.scenario["depth"]
    policy = PreyQ(depth, partner=depth, learning_rate=rate, temperature=temperature, moves=4, values_ends=True)
    world = Pursuit(**TASK.scenario, policy=policy, awareness="pairwise", rng=task_seed(TASK, ROOT, -1 - number, {}))
    for steps in STEPS:
        world.run(steps - world.tick, progress=False)
        yield replace(policy.frozen(world.hunters.policy_state.floats), temperature=temperature)


def trial_steps(policy: PreyQ, runs: int) -> float:
    """Return the mean number of steps of a trial; a run without any capture counts as one trial."""
    team = {"policy": policy, "awareness": "pairwise"}
    table = run_many(team, task=TASK, seeds=[task_seed(TASK, ROOT, replicate, {}) for replicate in range(runs)])
    return float(table["trial_steps"].replace(np.inf, TASK.steps).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trainings", type=int, default=5)
    parser.add_argument("--runs", type=int, default=40)
    options = parser.parse_args()
    rows = []
    for rate in RATES:
        for temperature in TEMPERATURES:
            found = np.array([
                [trial_steps(policy, options.runs) for policy in learned(rate, temperature, number)]
                for number in range(options.trainings)
            ])  # fmt: skip
            intervals = (interval_of(column) for column in found.T)
            shown = (f"{one.mean:.1f} ({one.low:.1f} to {one.high:.1f})" for one in intervals)
            rows.append([f"{rate:g}", f"{temperature:g}", *shown])
    columns = ["α", "T", *(f"{steps:,} steps" for steps in STEPS)]
    print(markdown.table(columns, rows, align="rrrrr"))


if __name__ == "__main__":
    main()
