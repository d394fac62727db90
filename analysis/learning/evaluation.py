"""Evaluation: what policies observe on the same worlds, with intervals, and how much more than each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import pandas as pd

from teamsight.agents.awareness import Awareness, PairwiseAwareness, RingAwareness
from teamsight.analysis.learning.learners import Lesson, Progress, awareness_for, learn
from teamsight.analysis.learning.provenance import BODIES
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.analysis.stats.paired import cell_means, paired
from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory
from teamsight.world.limits import length

#: What a learner is measured by.
COOPERATIVE, COLLECTIVE, DESIGNED, RANDOM = "cooperative", "collective", "A-CMOMMT", "random walk"
#: The policy that ships with constants which evolution found; it learned from no memory.
EVOLVED = "evolved"

#: Policies to compare, each with its degree of awareness, by name.
Contenders = dict[str, tuple[Any, Awareness]]


class Stage(NamedTuple):
    """The worlds in which policies are compared; no exploration meets them, whatever its seed.

    Attributes
    ----------
    bodies : mapping
        What bodies can do, by parameters of `CMOMMT` such as "robot_speed"; the rest is the default. Worlds begin
        alike whatever it is.
    """

    robots: int = 5
    targets: int = 15
    radius: float = 3.0
    runs: int = 30
    steps: int = 600
    seed: int = 0
    bodies: Mapping[str, float] = MappingProxyType({})

    def run_seed(self, replicate: int) -> int:
        """Return the seed of a world."""
        return model_seed(self.seed, replicate, self.robots, self.targets, self.radius)


def bodies_of(memory: LazyMemory) -> dict[str, float]:
    """Return what bodies could do in all explorations of a memory, as `Stage` takes it; ranges are left out.

    Raises
    ------
    TypeError, ValueError
        If a number is none that a body can have.
    """
    told = {name: memory.settings.get(name) for name in BODIES}
    return {
        name: length(f"memory: {name}", value) if value else 0.0
        for name, value in told.items()
        if isinstance(value, int | float)
    }


def check_team(memory: LazyMemory, robots: int) -> None:
    """Refuse a team of a size to which the situations of a memory mean nothing.

    Raises
    ------
    ValueError
        If its situations have another number of inputs.
    """
    if not memory.added:
        return
    degree = awareness_for(memory)
    inputs = sum(degree.width(robots))
    if inputs != memory.inputs:
        explored = memory.settings.get("robots")
        raise ValueError(
            f"robots={robots}: awareness {degree.name!r} gives {inputs} inputs in a team of {robots}, and the memory "
            f"has {memory.inputs}, from a team of {explored}; evaluate {explored} robots, or explore with {robots}"
        )


def contenders(
    name: str, memory: LazyMemory, lesson: Lesson, progress: Progress = lambda done, total: None
) -> Contenders:
    """Return the policies to compare, each with its degree of awareness: the learner, and what it is measured by.

    The cooperative learner, which uses all inputs, is left out where the robot's own are all.
    """
    found: Contenders = {}
    widths = [memory.inputs, memory.own] if memory.added else [memory.own]
    work = float(sum(widths))
    before = 0

    def count(done: float, total: float) -> None:
        progress((before + width * done / total) / work, 1.0)

    for width in widths:
        policy = learn(name, memory, lesson, inputs=width, progress=count)
        found[COOPERATIVE if width > memory.own else COLLECTIVE] = policy, awareness_for(memory, width)
        before += width
        progress(before / work, 1.0)
    found[DESIGNED] = ACmommt(idle="wander"), PairwiseAwareness()
    found[EVOLVED] = Evolved(), RingAwareness()
    found[RANDOM] = RandomWalk(), awareness_for(memory, memory.own)
    return found


def evaluate(
    policies: Mapping[str, tuple[Any, Awareness]],
    stage: Stage,
    pool: WorkerPool,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> pd.DataFrame:
    """Run every policy on every world.

    Parameters
    ----------
    policies : mapping of str to tuple
        A policy and its degree of awareness by name.
    stage : Stage
        The worlds.
    pool : WorkerPool
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
    world = place | dict(stage.bodies)
    planned = [
        (name, number, Run(world | {"policy": policy, "awareness": degree}, stage.run_seed(number), stage.steps))
        for name, (policy, degree) in policies.items()
        for number in range(stage.runs)
    ]
    outcomes = run_all([run for *_, run in planned], pool, progress=progress)
    rows = [
        {"policy": name, **place, "replicate": number, "seed": run.seed, "observed_fraction": found.observed_fraction}
        for (name, number, run), found in zip(planned, outcomes, strict=True)
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
