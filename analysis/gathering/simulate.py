"""The runs: both teams first, then the team with skill under each δ."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import pandas as pd

from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import canonical
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.runs.task_runs import TaskMeasure, is_cmommt, task_seed
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.tasks.task import Task
from teamsight.tasks.treatments import Named

#: The δ of a team with a degree of awareness of its own.
OWN = -1


class Team(NamedTuple):
    """One team whose runs are measured."""

    task: Task
    size: int
    treatment: Named
    delta: int = OWN


@dataclass(frozen=True)
class _TeamRun(Run):
    """A run of a team. What a team has learned may have no text of its own, so it is known by how it was learned."""

    label: tuple[str, ...] = ()

    @property
    def key(self) -> tuple[str, ...]:
        return (*self.label, f"steps={self.steps}", f"seed={self.seed}")


def both_teams(plan: Plan) -> list[Team]:
    """Return the team that explores and the one with skill, for each task and size."""
    return [
        Team(task, size, treatment)
        for task in plan.all_tasks
        for size in plan.sizes
        for treatment in ("explore", "skilled")
    ]  # fmt: skip


def simulate(
    plan: Plan,
    teams: Iterable[Team],
    pool: WorkerPool | None = None,
    *,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> pd.DataFrame:
    """Run teams and return one row for each run.

    Parameters
    ----------
    plan : Plan
        How many runs.
    teams : iterable of Team
        Which teams.
    pool, progress, checkpoint
        See `run_all`.

    Returns
    -------
    DataFrame
        task, size, treatment, delta (−1 for the degree of the team's own), training, replicate, seed, steps, value (of
        the objective; infinite for a censored run), counted, max_neighbours, mean_neighbours.
    """
    rows, runs = [], []
    for team in teams:
        for training, parameters in enumerate(_trainings(plan, team)):
            for replicate in range(plan.runs):
                run = _run(plan, team, training, parameters, replicate)
                runs.append(run)
                rows.append((team, training, replicate, run))
    found = run_all(runs, pool, progress=progress, checkpoint=checkpoint)
    return pd.DataFrame([_row(*row, measured) for row, measured in zip(rows, found, strict=True)])


def cost_of(plan: Plan, teams: Iterable[Team]) -> int:
    """Return the steps of all robots of these teams in all runs."""
    counted = ((team, plan.trainings if callable(team.task.teams[team.treatment]) else 1) for team in teams)
    return sum(team.size * plan.steps_of(team.task) * plan.runs * trainings for team, trainings in counted)


def _trainings(plan: Plan, team: Team) -> list[dict[str, Any]]:
    """Return the parameters of a team; one that learns has several."""
    awareness = None if team.delta == OWN else plan.awareness(team.delta)
    scenario = plan.scenario_of(team.task, team.size)
    count = plan.trainings if callable(team.task.teams[team.treatment]) else 1
    return [
        team.task.parameters(team.treatment, scenario, awareness=awareness, rng=plan.seed + training)
        for training in range(count)
    ]


def _run(plan: Plan, team: Team, training: int, parameters: Mapping[str, Any], replicate: int) -> _TeamRun:
    task, scenario = team.task, plan.scenario_of(team.task, team.size)
    label = (
        task.name, canonical(scenario), team.treatment, f"{plan.degree} {team.delta}",
        f"training {plan.seed + training}",
    )  # fmt: skip
    return _TeamRun(
        parameters,
        task_seed(task, plan.seed, replicate, scenario),
        plan.steps_of(task),
        TaskMeasure(task),
        None if is_cmommt(task) else task.world,
        label,
    )


def _row(team: Team, training: int, replicate: int, run: Run, measured: Mapping[str, Any]) -> dict[str, Any]:
    objective = team.task.objective
    value = measured[objective.metric]
    return {
        "task": team.task.name,
        "size": team.size,
        "treatment": team.treatment,
        "delta": team.delta,
        "training": training,
        "replicate": replicate,
        "seed": run.seed,
        "steps": run.steps,
        "value": value,
        "counted": objective.counted(value, run.steps),
        "max_neighbours": measured["max_neighbours"],
        "mean_neighbours": measured["mean_neighbours"],
    }
