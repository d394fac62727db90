"""Evaluation: what teams achieve in the same worlds of a task, and their paired differences, with intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from teamsight.agents.awareness import Awareness, NoAwareness, PairwiseAwareness, RingAwareness
from teamsight.analysis.learning.explore import BODIES
from teamsight.analysis.learning.learners import awareness_for, learn
from teamsight.analysis.learning.plans import Evaluation, Objective
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import LabelledRun, TaskMeasure, is_cmommt, task_seed
from teamsight.analysis.runs.seeds import canonical
from teamsight.analysis.runs.simulate import Progress, run_rows
from teamsight.analysis.stats.paired import interval_of
from teamsight.core import checks
from teamsight.policies.evolved import Evolved
from teamsight.policies.handmade.a_cmommt import ACmommt
from teamsight.policies.handmade.follow_free import FollowFree
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.policies.memory import LazyMemory
from teamsight.tasks.task import Task
from teamsight.world.limits import length

#: Names of the policies that are compared.
COOPERATIVE, COLLECTIVE, DESIGNED, RANDOM = "cooperative", "collective", "A-CMOMMT", "random walk"
#: The teams of other tasks.
SKILLED, RANDOM_TEAM = "skilled team", "team that explores"
#: The shipped policy whose constants evolution found.
EVOLVED = "evolved"

#: The task whose teams are many, and of which memories are that name no task.
CMOMMT = "cmommt"

#: Policies by name, each with its degree of awareness.
Contenders = dict[str, tuple[Any, Awareness]]
#: The parameters of worlds by the name of the team.
Teams = dict[str, dict[str, Any]]

#: Teams that learn nothing, the controls of those that learn a law: the force of free targets is set by hand.
BY_HAND: Contenders = {
    "by hand, f = 1": (FollowFree(0), RingAwareness()),
    "by hand, f = d": (FollowFree(1), RingAwareness()),
    "by hand, unaware, f = d⁴": (FollowFree(4, teammates=0), NoAwareness()),
    "by hand, unaware, f = d⁸": (FollowFree(8, teammates=0), NoAwareness()),
    "by hand, unaware, f = d⁶⁴": (FollowFree(64, teammates=0), NoAwareness()),
}


def bodies_of(memory: LazyMemory) -> dict[str, float]:
    """Return the speeds and ranges of all explorations of a memory, for the worlds of an evaluation.

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


def scenario_of(memory: LazyMemory, task: Task, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the whole scenario in which robots are evaluated that have learned from a memory.

    It has the values that are given, and otherwise those of the exploration, if that was of this task. Of CMOMMT these
    are the number of robots, speeds and ranges; the radius of the arena is 3.

    Raises
    ------
    TypeError, ValueError
        If a name is no parameter of the scenario, or the memory does not fit a team of this size.
    """
    explored = memory.settings.get("scenario") if memory.settings.get("task", CMOMMT) == task.name else {}
    known = {name: value for name, value in dict(explored or {}).items() if name in task.scenario}
    if task.name == CMOMMT:
        known = {"robots": memory.settings.get("robots", 5), "radius": 3.0, **bodies_of(memory)}
    scenario = task.full_scenario({**known, **given})
    check_team(memory, checks.count(f"memory: {task.size}", scenario[task.size]))
    return scenario


def contenders(
    name: str,
    memory: LazyMemory,
    objective: Objective,
    task: Task,
    scenario: Mapping[str, Any],
    progress: Progress = lambda done, total: None,
    *,
    rng: int = 0,
) -> Teams:
    """Return the teams to compare: what the learner learns, and teams that learn nothing from the memory.

    These are the team with skill and the one that explores; in CMOMMT also those whose forces are set by hand.

    Parameters
    ----------
    name, memory, objective, progress
        See `learned_policies`.
    task : Task
        The task.
    scenario : mapping
        Values of its scenario.
    rng : int
        Root seed of the learning of the team with skill, if it has to learn.

    Raises
    ------
    TypeError, ValueError
        If the learner cannot learn from the memory.
    """
    teams = learned_policies(name, memory, objective, progress)
    treatments: dict[str, Any] = {}
    if task.name == CMOMMT:
        teams |= BY_HAND
        teams[DESIGNED] = ACmommt(idle="wander"), PairwiseAwareness()
        teams[EVOLVED] = Evolved(), RingAwareness()
        teams[RANDOM] = RandomWalk(), awareness_for(memory, memory.own)
    else:
        treatments = {SKILLED: "skilled", RANDOM_TEAM: "explore"} if task.skilled else {RANDOM_TEAM: "explore"}
    given = {team: {"policy": policy, "awareness": degree} for team, (policy, degree) in teams.items()} | treatments
    return {team: task.parameters(treatment, scenario, rng=rng) for team, treatment in given.items()}


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
    teams: Teams,
    task: Task,
    scenario: Mapping[str, Any],
    evaluation: Evaluation | None = None,
    pool: Executor | None = None,
    progress: Progress = lambda done, total: None,
) -> pd.DataFrame:
    """Run each team on each world.

    Parameters
    ----------
    teams : dict of str to mapping
        The parameters of worlds by the name of the team; see `contenders`.
    task : Task
        The task.
    scenario : mapping
        Values of its scenario.
    evaluation : Evaluation, optional
        How many worlds, for how many steps, and with which seed.
    pool : Executor, optional
        What makes the runs; by default this process.
    progress : callable
        Called with the work done and the work in all.

    Returns
    -------
    DataFrame
        One row a team and world: policy, replicate, seed, counted (the objective; a censored run counts as its
        length), the metrics of the task, max_neighbours and mean_neighbours.

    Raises
    ------
    JobError
        If a policy does not fit its degree and the worlds.
    """
    plan = evaluation or Evaluation()
    steps = task.steps if plan.steps is None else plan.steps
    full, model = task.full_scenario(scenario), None if is_cmommt(task) else task.world
    planned = []
    for team, parameters in teams.items():
        for replicate in range(plan.runs):
            seed = task_seed(task, plan.seed, replicate, full)
            label = task.name, canonical(full), team
            run = LabelledRun(parameters, seed, steps, TaskMeasure(task), model, label)
            planned.append(({"policy": team, "replicate": replicate, "seed": seed}, run))
    table = run_rows(planned, pool, progress=progress)
    counted = [task.objective.counted(value, steps) for value in table[task.objective.metric]]
    table.insert(3, "counted", counted)
    return table


def summary(table: pd.DataFrame, task: Task) -> pd.DataFrame:
    """Return what each team achieves, and by how much the first is better than each other, with 95 % intervals.

    Parameters
    ----------
    table : DataFrame
        From `evaluate`.
    task : Task
        The task.

    Returns
    -------
    DataFrame
        One row a team, in the order of the table: policy, mean, low, high, censored (share of the runs), and of the
        paired difference `more`, more_low, more_high, positive if the first is better, which are NaN for the first.
    """
    wide = table.pivot(index="replicate", columns="policy", values="counted")
    names = list(dict.fromkeys(table["policy"]))
    rows = []
    for name in names:
        mean, low, high = interval_of(wide[name].to_numpy(np.float64))
        infinite = np.isinf(table.loc[table["policy"] == name, task.objective.metric])
        row = {"policy": name, "mean": mean, "low": low, "high": high, "censored": float(infinite.mean())}
        if name != names[0]:
            better = interval_of(task.objective.sign * (wide[names[0]] - wide[name]).to_numpy(np.float64))
            row |= {"more": better.mean, "more_low": better.low, "more_high": better.high}
        rows.append(row)
    return pd.DataFrame(rows)
