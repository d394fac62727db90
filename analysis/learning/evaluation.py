"""Evaluation: what policies observe on the same worlds, and their paired differences, with intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import pandas as pd

from teamsight.agents.awareness import Awareness, NoAwareness, PairwiseAwareness, RingAwareness
from teamsight.analysis.learning.learners import Objective, Progress, awareness_for, learn
from teamsight.analysis.learning.provenance import BODIES
from teamsight.analysis.runs.experiment import Experiment, Request, make_tables
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.stats.paired import cell_means, paired
from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.follow_free import FollowFree
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory
from teamsight.world.limits import length

#: Names of the policies that are compared.
COOPERATIVE, COLLECTIVE, DESIGNED, RANDOM = "cooperative", "collective", "A-CMOMMT", "random walk"
#: The teams of other tasks.
SKILLED, RANDOM_TEAM = "skilled team", "team that explores"
#: The shipped policy whose constants evolution found.
EVOLVED = "evolved"

#: Policies by name, each with its degree of awareness.
Contenders = dict[str, tuple[Any, Awareness]]

#: Teams that learn nothing, the controls of those that learn a law: the force of free targets is set by hand.
BY_HAND: Contenders = {
    "by hand, f = 1": (FollowFree(0), RingAwareness()),
    "by hand, f = d": (FollowFree(1), RingAwareness()),
    "by hand, unaware, f = d⁴": (FollowFree(4, teammates=0), NoAwareness()),
    "by hand, unaware, f = d⁸": (FollowFree(8, teammates=0), NoAwareness()),
    "by hand, unaware, f = d⁶⁴": (FollowFree(64, teammates=0), NoAwareness()),
}


class Scenario(NamedTuple):
    """The worlds on which policies are compared; no exploration uses them, whatever its seed.

    Attributes
    ----------
    bodies : mapping
        Parameters of `CMOMMT` such as "robot_speed"; others have their defaults. Placements do not depend on them.
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
    """Return the speeds and ranges of all explorations of a memory, for `Scenario`.

    Parameters that differ between explorations are left out.

    Raises
    ------
    TypeError, ValueError
        If a value is not a valid length.
    """
    stored = {name: memory.settings.get(name) for name in BODIES}
    return {
        name: length(f"memory: {name}", value) if value else 0.0
        for name, value in stored.items()
        if isinstance(value, int | float)
    }


def check_team(memory: LazyMemory, robots: int) -> None:
    """Raise an error if the situations of a memory do not fit a team of this size.

    Raises
    ------
    ValueError
        If they have a different number of inputs.
    """
    if not memory.added:
        return
    degree = awareness_for(memory)
    inputs = sum(degree.width(robots))
    if inputs != memory.inputs:
        explored = memory.settings.get("robots")
        raise ValueError(
            f"robots={robots}: awareness {degree.name!r} gives {inputs} inputs in a team of {robots}, but the memory "
            f"has {memory.inputs}, from a team of {explored}; evaluate {explored} robots, or explore with {robots}"
        )


def contenders(
    name: str, memory: LazyMemory, objective: Objective, progress: Progress = lambda done, total: None
) -> Contenders:
    """Return the policies to compare in CMOMMT: what the learner learns, and others that learn nothing.

    Parameters
    ----------
    name, memory, objective, progress
        See `learned_policies`.
    """
    found = learned_policies(name, memory, objective, progress) | BY_HAND
    found[DESIGNED] = ACmommt(idle="wander"), PairwiseAwareness()
    found[EVOLVED] = Evolved(), RingAwareness()
    found[RANDOM] = RandomWalk(), awareness_for(memory, memory.own)
    return found


def learned_policies(
    name: str, memory: LazyMemory, objective: Objective, progress: Progress = lambda done, total: None
) -> Contenders:
    """Return what a learner learns from all inputs, and from the robot's own ones.

    Parameters
    ----------
    name : str
        The learner.
    memory : LazyMemory
        The transitions.
    objective : Objective
        What is to be learnt.
    progress : callable
        Called with the share of the work that is done, and 1.

    Returns
    -------
    dict
        "cooperative", which uses all inputs, is absent if the memory has only the robot's own ones.
    """
    found: Contenders = {}
    widths = [memory.inputs, memory.own] if memory.added else [memory.own]
    work = float(sum(widths))
    before = 0

    def count(done: float, total: float) -> None:
        progress((before + width * done / total) / work, 1.0)

    for width in widths:
        policy = learn(name, memory, objective, inputs=width, progress=count)
        found[COOPERATIVE if width > memory.own else COLLECTIVE] = policy, awareness_for(memory, width)
        before += width
        progress(before / work, 1.0)
    return found


def evaluate(
    policies: Mapping[str, tuple[Any, Awareness]],
    scenario: Scenario,
    pool: WorkerPool,
    progress: Callable[[float, float], None] = lambda done, total: None,
) -> pd.DataFrame:
    """Run each policy on each world.

    Parameters
    ----------
    policies : mapping of str to tuple
        Policies by name, each with its degree of awareness.
    scenario : Scenario
        The worlds.
    pool : WorkerPool
        Processes that do the work.
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
    cells = ((scenario.robots, scenario.radius),)
    experiments = [
        Experiment(name, {"policy": policy, "awareness": degree}, cells, scenario.targets)
        for name, (policy, degree) in policies.items()
    ]
    request = Request(scenario.bodies, experiments)
    (tables,) = make_tables(
        [request], pool, root=scenario.seed, runs=scenario.runs, steps=scenario.steps, progress=progress
    )
    table = pd.concat([rows.assign(policy=name) for name, rows in tables.items()], ignore_index=True)
    return table[["policy", "robots", "targets", "radius", "replicate", "seed", "observed_fraction"]]


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return what each policy observes, and the paired difference of the first to each other, with 95 % intervals.

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
