"""The runs: both teams first, then the team with skill under each δ."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.gathering.plan import Plan
from teamsight.analysis.runs.checkpoint import Checkpoint, Key, code_digest, modules_of
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import NEIGHBOURS, Run, TaskMeasure, is_cmommt, task_seed
from teamsight.analysis.runs.seeds import canonical
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.analysis.teams import active_team_graph
from teamsight.tasks.task import Named, Task

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.agents.world import World

#: The δ of a team with a degree of awareness of its own.
OWN = -1


class Team(NamedTuple):
    """One team whose runs are measured."""

    task: Task
    size: int
    treatment: Named
    delta: int = OWN

    @property
    def learns(self) -> bool:
        """Whether the team has to learn."""
        return callable(self.task.teams[self.treatment])


@dataclass(frozen=True)
class _Exposure(TaskMeasure):
    """A `TaskMeasure` that also counts the robot-steps with 0, 1, 2 … neighbours."""

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        counts, end = np.zeros(1, np.int64), world.tick + steps
        while world.tick < end and world.running:
            world.run(1)
            here = np.bincount(active_team_graph(world, self.task.team).degree, minlength=len(counts))
            here[: len(counts)] += counts
            counts = here
        return self.columns(world) | {"robot_steps": counts.tolist()}


@dataclass(frozen=True)
class _TeamRuns:
    """Runs of a team: a job that lets the team learn first, if it has to, so that workers train side by side."""

    plan: Plan
    team: Team
    training: int
    replicates: tuple[int, ...]

    @property
    def key(self) -> Key:
        task, size, treatment, delta = self.team
        scenario, seeds = self.plan.scenario_of(task, size), map(str, self.seeds)
        # What a team has learned may have no text of its own, so it is known by how it was learned.
        return (
            task.name, canonical(scenario), treatment, f"{self.plan.degree} {delta}", f"training {self._root}",
            f"steps={self.plan.steps_of(task)}", *seeds, code_digest(__name__, *modules_of(task)),
        )  # fmt: skip

    @property
    def seeds(self) -> list[int]:
        """The seeds of the runs."""
        task, scenario = self.team.task, self.plan.scenario_of(self.team.task, self.team.size)
        return [task_seed(task, self.plan.seed, replicate, scenario) for replicate in self.replicates]

    @property
    def cost(self) -> float:
        return float(len(self.replicates) * self.plan.steps_of(self.team.task) * self.team.size / 15)

    def make(self, worlds: ReusedWorlds) -> list[Any]:
        """Let the team learn, if it has to, and return what was measured in each run."""
        task, size, treatment, delta = self.team
        scenario = self.plan.scenario_of(task, size)
        awareness = None if delta == OWN else self.plan.awareness(delta)
        parameters = task.parameters(treatment, scenario, awareness=awareness, rng=self._root)
        model = None if is_cmommt(task) else task.world
        steps = self.plan.steps_of(task)
        # δ of both teams comes from these runs, and so does what a robot meets beyond it.
        measure = _Exposure(task) if delta == OWN else TaskMeasure(task)
        runs = [Run(parameters, seed, steps, measure, model) for seed in self.seeds]
        worlds.expect((run.parameters, run.seed) for run in runs)
        return [run.make(worlds) for run in runs]

    def describe(self) -> str:
        """Return the job in words."""
        team = self.team
        degree = "its own degree" if team.delta == OWN else f"{self.plan.degree} δ={team.delta}"
        return f"{len(self.replicates)} runs of {team.task.name}, {team.treatment}, N={team.size}, {degree}"

    @property
    def _root(self) -> int:
        """The root seed of the learning."""
        return self.plan.seed + self.training


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
        the objective; infinite for a censored run), counted, max_neighbours, mean_neighbours, and for teams with a
        degree of their own robot_steps: how many a robot had 0, 1, 2 … neighbours.
    """
    jobs = [job for team in teams for job in _jobs(plan, team)]
    found = run_all(jobs, pool, progress=progress, checkpoint=checkpoint)
    return pd.DataFrame([row for job, measured in zip(jobs, found, strict=True) for row in _rows(job, measured)])


def cost_of(plan: Plan, team: Team) -> int:
    """Return the steps of all robots of a team in all runs."""
    return team.size * plan.steps_of(team.task) * plan.runs


def _jobs(plan: Plan, team: Team) -> list[_TeamRuns]:
    # Trainings share the runs.
    count = plan.trainings if team.learns else 1
    return [_TeamRuns(plan, team, training, tuple(range(training, plan.runs, count))) for training in range(count)]


def _rows(job: _TeamRuns, measured: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    task, steps = job.team.task, job.plan.steps_of(job.team.task)
    return [
        {
            "task": task.name,
            "size": job.team.size,
            "treatment": job.team.treatment,
            "delta": job.team.delta,
            "training": job.training,
            "replicate": replicate,
            "seed": seed,
            "steps": steps,
            "value": found[task.objective.metric],
            "counted": task.objective.counted(found[task.objective.metric], steps),
            **{name: found[name] for name in NEIGHBOURS},
            "robot_steps": found.get("robot_steps"),
        }
        for replicate, seed, found in zip(job.replicates, job.seeds, measured, strict=True)
    ]
