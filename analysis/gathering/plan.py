"""What is simulated: tasks, team sizes, runs, and the degrees of awareness that are compared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.agents.awareness.registry import awareness_named
from teamsight.analysis.gathering.scenarios import check_scenarios, scenario_for
from teamsight.analysis.runs import limits
from teamsight.core import checks
from teamsight.core.component import Allowed, Component, Count, Index
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task

if TYPE_CHECKING:
    from teamsight.agents.awareness import Awareness

#: Degrees of awareness with δ inputs, or places, about teammates.
DEGREES = ("nearest", "ring")
#: N of the teams.
SIZES = (4, 8, 16, 30)
#: δ at which the objective is measured by default.
DELTAS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)

_Share = Annotated[float, Allowed(above=0.0, most=1.0)]


@dataclass(frozen=True)
class Plan(Component):
    """What is simulated, and what counts as enough.

    Parameters
    ----------
    tasks : sequence of Task or str
        Tasks, or the names of some; each needs a team that explores and one with skill.
    sizes : sequence of int
        N, the sizes of the team, at least 2.
    runs : int
        Runs of each team and degree; a risk of 0.05 needs 86 for intervals that hold together with 95 %.
    steps : int, optional
        Steps of each run; by default those of each task.
    risk : float
        Accepted probability that any robot has more than δ neighbours during a run.
    tolerance : float
        By which share of the objective a degree may fall short of that with all N − 1 teammates and be enough.
    degree : "nearest" or "ring"
        The degree of awareness with δ: a list of the δ nearest teammates, or a ring of δ sectors.
    trainings : int
        How often a team that learns learns anew for each degree. They share the runs, and the intervals of the
        objective are over trainings.
    scenario : mapping
        Values of the scenarios, by their name for all tasks or as ``"task.name"`` for one; each is a value, or a
        sequence of one for each size.
    seed : int
        Root seed.
    deltas : sequence of int, optional
        The δ at which the objective is measured, beside 0, N − 1 and those of both teams; by default `DELTAS`. Fewer
        save trainings of a team that learns.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits, or a task has no team with skill.
    """

    tasks: Sequence[Task | str] = ("cmommt",)
    sizes: Annotated[Sequence[Annotated[int, Allowed(least=2)]], Allowed()] = SIZES
    runs: limits.Runs = 200
    steps: limits.Steps | None = None
    risk: _Share = 0.05
    tolerance: _Share = 0.02
    degree: Annotated[str, Allowed(choices=DEGREES)] = "nearest"
    trainings: Count = 1
    scenario: Mapping[str, Any] = field(default_factory=dict)
    seed: Index = 0
    deltas: Annotated[Sequence[Count], Allowed()] = DELTAS

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.tasks, (str, Task)):
            raise TypeError(f"tasks={checks.shown(self.tasks)}: must be several tasks, as in ['cmommt']")
        object.__setattr__(self, "tasks", tuple(map(task_of, self.tasks)))
        names = [task.name for task in self.all_tasks]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"tasks: {name!r} is the name of two; give each task once")
        if not names or not self.sizes:
            raise ValueError(f"{'tasks' if not names else 'sizes'}: there are none; give at least one")
        checks.count("runs", self.runs, least=2, cure="an interval needs two runs")
        checks.count("trainings", self.trainings, most=self.runs, cure="trainings share the runs, at least one each")
        for task in self.all_tasks:
            for treatment in ("explore", "skilled"):
                if task.teams[treatment] is None:
                    task.parameters(treatment)  # type: ignore[arg-type]
        check_scenarios(self.scenario, self.all_tasks, self.sizes)

    @property
    def all_tasks(self) -> tuple[Task, ...]:
        """The tasks as objects."""
        return tuple(map(task_of, self.tasks))

    def steps_of(self, task: Task) -> int:
        """Return the steps of a run of a task."""
        return task.steps if self.steps is None else self.steps

    def scenario_of(self, task: Task, size: int) -> dict[str, Any]:
        """Return the whole scenario of a task with a team of this size."""
        return scenario_for(self.scenario, task, self.sizes, size)

    def awareness(self, delta: int) -> Awareness:
        """Return the degree of awareness with this δ; 0 is none."""
        return awareness_of_delta(self.degree, delta)

    def conditions(self) -> dict[str, Any]:
        """Return the conditions of all results, fit for JSON."""
        return {
            "tasks": [task.name for task in self.all_tasks],
            "sizes": list(self.sizes),
            "runs": self.runs,
            "steps": {task.name: self.steps_of(task) for task in self.all_tasks},
            "risk": self.risk,
            "tolerance": self.tolerance,
            "degree": self.degree,
            "trainings": self.trainings,
            "deltas": list(self.deltas),
            "scenario": {
                name: list(value) if isinstance(value, (list, tuple)) else value
                for name, value in self.scenario.items()
            },
            "seed": self.seed,
        }


def awareness_of_delta(degree: str, delta: int) -> Awareness:
    """Return the degree of awareness of a name with δ inputs, or places; without any it is none."""
    return awareness_named("none") if delta == 0 else awareness_named(degree, {"delta": delta})


def deltas(plan: Plan, size: int, further: Iterable[int] = ()) -> tuple[int, ...]:
    """Return the δ at which the objective of a team of N robots is measured, in order.

    Parameters
    ----------
    plan : Plan
        The plan.
    size : int
        N.
    further : iterable of int
        More δ, such as those of both teams.
    """
    return tuple(sorted({delta for delta in (0, *plan.deltas, *further, size - 1) if delta < size}))
