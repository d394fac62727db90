"""An exploration of any task: its worlds, its team that explores, and the transitions of this team."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from teamsight.agents.group import Group
from teamsight.agents.recording.explore import record_run
from teamsight.agents.recording.transitions import Transitions
from teamsight.agents.teammates import of_team
from teamsight.agents.world import World
from teamsight.analysis.learning.explore import Exploration
from teamsight.analysis.runs.run import Run, task_run, task_seed
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task


@dataclass(frozen=True)
class TeamTransitions:
    """Runs a world and returns the transitions of the first group of a team; of the first on any team for None."""

    team: str | None

    def __call__(self, world: World, steps: int) -> Transitions:
        """Run the world and return the transitions."""
        return record_run(world, group_of_team(world, self.team), steps)


def group_of_team(world: World, team: str | None) -> Group:
    """Return the first group of a team; the first that is on any for None."""
    return of_team(world.groups, team)[0]


@dataclass(frozen=True)
class TaskExploration(Exploration):
    """An exploration of a task.

    Parameters
    ----------
    task : Task or str
        The task; its team that explores acts.
    scenario : mapping
        Values of its scenario.
    steps, runs, awareness, seed
        See `Exploration`. The others of its parameters have no meaning here.

    Raises
    ------
    TypeError, ValueError
        As for `Exploration`; and if the task has no team that explores, or no such scenario.
    """

    task: Task | str = "cmommt"
    scenario: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        found = task_of(self.task)
        object.__setattr__(self, "task", found)
        object.__setattr__(self, "scenario", found.full_scenario(self.scenario))
        object.__setattr__(self, "robots", self.scenario[found.size])
        super().__post_init__()

    @property
    def parameters(self) -> dict[str, Any]:
        """Keyword parameters of its worlds."""
        return task_of(self.task).parameters("explore", self.scenario, awareness=self.awareness)

    @cached_property
    def all_runs(self) -> list[Run]:
        """The run of each world, which returns its transitions."""
        task, parameters = task_of(self.task), self.parameters
        measure = TeamTransitions(task.team)
        return [task_run(task, parameters, self.run_seed(run), self.steps, measure) for run in range(self.runs)]

    def model(self, run: int) -> World:
        """Return one of its worlds, before its first step."""
        return task_of(self.task).world(**self.parameters, rng=self.run_seed(run))

    def group_of(self, world: World) -> Group:
        """Return the group of one of its worlds whose transitions are recorded."""
        return group_of_team(world, task_of(self.task).team)

    def run_seed(self, run: int) -> int:
        """Return the seed of one of its worlds; see `Exploration.run_seed`."""
        return task_seed(task_of(self.task), self.seed, -1 - run, self.scenario)

    def settings(self) -> dict[str, Any]:
        """Return the settings that its memory stores."""
        return super().settings() | {"task": task_of(self.task).name, "scenario": dict(self.scenario)}
