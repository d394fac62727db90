"""The plan: which teams are run in which scenarios, and the table of their completion times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs import limits
from teamsight.analysis.runs.files import as_json
from teamsight.analysis.runs.run import task_run, task_seed
from teamsight.analysis.runs.seeds import root
from teamsight.analysis.runs.simulate import Planned
from teamsight.core.component import Allowed, Component, Count
from teamsight.policies.schemas import COMMUNICATION
from teamsight.tasks.registry import TASKS
from teamsight.tasks.task import Task

if TYPE_CHECKING:
    from teamsight.agents.world import World

#: The tasks, by their names.
NAMES = ("forage", "consume", "graze")

# A run stops at the first multiple of these steps at which its task is done.
_PART = 250


@dataclass(frozen=True)
class UntilDone:
    """Runs a world until its task is done, and returns its objective and the largest number of neighbours.

    Parameters
    ----------
    task : Task
        The task.
    """

    task: Task

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world for at most so many steps."""
        metric = self.task.metrics[self.task.objective.metric]
        left = steps
        while left > 0 and self.task.objective.is_censored(metric(world) if left < steps else float("inf")):
            world.run(min(_PART, left))
            left -= _PART
        time = float(metric(world))
        return {
            "time": self.task.objective.counted(time, steps),
            "censored": self.task.objective.is_censored(time),
            "max_neighbours": int(world.recording.max_neighbours(self.task.team)),
        }


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each cell. Run r of all teams in a cell has the same seed.
    steps : int
        Steps after which a run is censored.
    seed : int
        Root seed.
    robots, attractors : tuple of int
        The numbers of robots, and of attractors where there are any; each of one with each of the other is a cell.
    """

    runs: limits.Runs = 30
    steps: limits.Steps = 8000
    seed: Annotated[int, Allowed(least=0)] = root("foraging")
    robots: Annotated[tuple[Count, ...], Allowed()] = (1, 2, 3, 4, 5)
    attractors: Annotated[tuple[Count, ...], Allowed()] = (1, 3, 5, 7)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        return as_json(self)

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it: task, robots, attractors (0 for graze) and so on."""
        for name in NAMES:
            task = TASKS[name]
            for robots in self.robots:
                for attractors in self.attractors if "attractors" in task.scenario else (0,):
                    cell = {"robots": robots} | ({"attractors": attractors} if attractors else {})
                    for replicate in range(self.runs):
                        seed = task_seed(task, self.seed, replicate, cell)
                        for communication in COMMUNICATION:
                            team = {"policy": "schemas", "communication": communication, "awareness": "pairwise"}
                            named = {"task": name, "robots": robots, "attractors": attractors, "replicate": replicate}
                            run = task_run(task, task.parameters(team, cell), seed, self.steps, UntilDone(task))
                            yield named | {"communication": communication, "seed": seed}, run
