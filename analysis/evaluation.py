"""Evaluation: what policies observe on the same worlds, with intervals, and how much more than each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import pandas as pd

from teamsight.agents.awareness import Awareness, PairwiseAwareness
from teamsight.analysis.crew import Crew
from teamsight.analysis.execute import run_all
from teamsight.analysis.learners import Lesson, awareness_for, learn
from teamsight.analysis.observation import cell_means, paired
from teamsight.analysis.study import Run, model_seed
from teamsight.policies.a_cmommt import ACmommt
from teamsight.policies.lazy_memory import LazyMemory
from teamsight.policies.random_walk import RandomWalk

#: What a learner is measured by.
COOPERATIVE, COLLECTIVE, DESIGNED, RANDOM = "cooperative", "collective", "A-CMOMMT", "random walk"


class Stage(NamedTuple):
    """The worlds in which policies are compared; no exploration meets them, whatever its seed."""

    robots: int = 5
    targets: int = 15
    radius: float = 3.0
    runs: int = 30
    steps: int = 600
    seed: int = 0

    def run_seed(self, replicate: int) -> int:
        """Return the seed of a world."""
        return model_seed(self.seed, replicate, self.robots, self.targets, self.radius)


def contenders(name: str, memory: LazyMemory, lesson: Lesson) -> dict[str, tuple[Any, Awareness]]:
    """Return the policies to compare, each with its degree of awareness: the learner, and what it is measured by.

    The collective learner uses the robot's own inputs of the same pairs; it is left out where these are all.
    """
    found: dict[str, tuple[Any, Awareness]] = {}
    if memory.added:
        found[COOPERATIVE] = learn(name, memory, lesson), awareness_for(memory)
    own = awareness_for(memory, memory.own)
    found[COLLECTIVE] = learn(name, memory, lesson, inputs=memory.own), own
    found[DESIGNED] = ACmommt(search="wander"), PairwiseAwareness()
    found[RANDOM] = RandomWalk(), own
    return found


def evaluate(
    policies: Mapping[str, tuple[Any, Awareness]],
    stage: Stage,
    crew: Crew,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> pd.DataFrame:
    """Run every policy on every world.

    Parameters
    ----------
    policies : mapping of str to tuple
        A policy and its degree of awareness by name.
    stage : Stage
        The worlds.
    crew : Crew
        Who does the work.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    DataFrame
        One row a policy and world: policy, robots, targets, radius, replicate, seed, observed_fraction.

    Raises
    ------
    JobError
        If a policy does not fit its degree and the team.
    """
    place = {"robots": stage.robots, "targets": stage.targets, "radius": stage.radius}
    planned = [
        (name, Run(place | {"policy": policy, "awareness": degree}, number, stage.steps, stage.run_seed(number)))
        for name, (policy, degree) in policies.items()
        for number in range(stage.runs)
    ]
    outcomes = run_all(crew, [run for _, run in planned], progress)
    rows = [
        {"policy": name, **place, "replicate": run.replicate, "seed": run.seed}
        | {"observed_fraction": outcomes[run.key].observed_fraction}
        for name, run in planned
    ]
    return pd.DataFrame(rows)


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return what each policy observes, and how much more the first does on the same worlds, with 95 % intervals.

    Returns
    -------
    DataFrame
        One row a policy, in the order of the table: policy, mean, low, high, and of the difference `more`, more_low,
        more_high, which are NaN for the first.
    """
    names = list(dict.fromkeys(table["policy"]))
    first = table[table["policy"] == names[0]]
    rows = []
    for name in names:
        own = table[table["policy"] == name]
        mean = cell_means(own, "observed_fraction").iloc[0]
        row = {"policy": name, "mean": mean["mean"], "low": mean["low"], "high": mean["high"]}
        if name != names[0]:
            more = cell_means(paired(first, own), "difference").iloc[0]
            row |= {"more": more["mean"], "more_low": more["low"], "more_high": more["high"]}
        rows.append(row)
    return pd.DataFrame(rows)
