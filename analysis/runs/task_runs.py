"""Runs of a task: their seeds, and what they measure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeding import scenario_of
from teamsight.analysis.runs.seeds import model_seed, setting_seed
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.analysis.runs.run import Measure, Model
    from teamsight.tasks.task import Task

#: Columns of a run beside the metrics of its task.
NEIGHBOURS = ("max_neighbours", "mean_neighbours")


@dataclass(frozen=True)
class TaskMeasure:
    """Runs a world of a task and returns its metrics, and the neighbours of its team.

    Parameters
    ----------
    task : Task
        The task.
    """

    task: Task

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return the columns."""
        world.run(steps)
        return self.columns(world)

    def columns(self, world: World) -> dict[str, Any]:
        """Return the columns of a world that has made its steps."""
        found: dict[str, Any] = self.task.measure(world)
        for name in NEIGHBOURS:
            if name in found:
                raise ValueError(f"metrics: {name!r} is measured of every task; take another name")
        largest = int(world.recording.max_neighbours(self.task.team))
        return found | {"max_neighbours": largest, "mean_neighbours": float(world.recording.mean_neighbours)}


def task_seed(task: Task, root: int, replicate: int, scenario: Mapping[str, Any]) -> int:
    """Return the seed of one run of a task, which depends on the scenario and not on the team.

    Parameters
    ----------
    task : Task
        The task.
    root : int
        The root seed.
    replicate : int
        Number of the run: from 0 upwards; that of a world in which a team learns from −1 downwards.
    scenario : mapping
        The values that are given; the others are the defaults of the task.
    """
    full = {**task.scenario, **scenario}
    if is_cmommt(task):
        return model_seed(root, replicate, *scenario_of(full))  # type: ignore[arg-type]
    return setting_seed(root, replicate, full)


def is_cmommt(task: Task) -> bool:
    """Return whether the worlds of a task are `CMOMMT`, of which runs share one, and whose seeds are known."""
    from teamsight.agents.cmommt import CMOMMT

    return task.world is CMOMMT


def task_run(
    task: Task, parameters: Mapping[str, Any], seed: int, steps: int | None = None, measure: Measure | None = None
) -> Run:
    """Return one run of a task.

    Parameters
    ----------
    task : Task
        The task.
    parameters : mapping
        All parameters of the world; see `Task.parameters`.
    seed : int
        The seed.
    steps : int, optional
        Steps; by default those of the task.
    measure : callable, optional
        See `Run`; by default `TaskMeasure`.
    """
    model: Model | None = None if is_cmommt(task) else task.world
    return Run(parameters, seed, task.steps if steps is None else steps, measure or TaskMeasure(task), model)


def check_objective(task: Task) -> None:
    """Refuse a task whose objective is no metric of its own.

    Raises
    ------
    ValueError
        If it is none.
    """
    checks.choice("objective", task.objective.metric, task.metrics)
