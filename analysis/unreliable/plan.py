"""The sweeps over failure rates and sensing periods: which worlds are run, and what is measured in them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from teamsight.agents.teammates import of_team
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.run import LabelledRun, Run, TaskMeasure, task_run, task_seed
from teamsight.analysis.runs.seeds import canonical, root
from teamsight.analysis.runs.simulate import Planned
from teamsight.analysis.unreliable.subject import CMOMMT, SCENARIOS, SKILLED, TEAMS, Subject, TaskSubject, subject_of
from teamsight.core.component import Allowed, Component, Positive
from teamsight.tasks.named import task_of
from teamsight.tasks.task import Task

if TYPE_CHECKING:
    from teamsight.agents.components import Failures
    from teamsight.agents.decisions import Cycle
    from teamsight.agents.world import World

#: Shares of the time in which a robot works, MTTF / (MTTF + MTTR).
AVAILABILITIES = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5)
#: Sensing periods [ticks].
PERIODS = (1, 2, 5, 10, 20, 50)
#: The sweeps, and the column with their values.
SWEEPS: Mapping[str, str] = MappingProxyType({"failures": "availability", "periods": "period"})


class _Condition(NamedTuple):
    """One value of a sweep, and what it does to a team."""

    sweep: str
    value: float
    failures: Failures | None
    cycle: Cycle | None


@dataclass(frozen=True)
class UnreliableMeasure:
    """Lets a team fail or sense rarely, runs the world, and measures the task.

    Parameters
    ----------
    task : Task
        The task.
    failures : Failures or None
        Failures of its team.
    cycle : Cycle or None
        When its robots sense and decide.
    """

    task: Task
    failures: Failures | None
    cycle: Cycle | None

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return the columns; see `TaskMeasure`."""
        for group in of_team(world.groups, self.task.team):
            if self.cycle is not None:
                world.adjust(group, cycle=self.cycle)
            if self.failures is not None:
                world.attach(self.failures, group)
        return TaskMeasure(self.task)(world, steps)


@dataclass(frozen=True)
class Plan(Component):
    """What to simulate.

    Parameters
    ----------
    runs : int
        Runs of each condition. Run r of every condition of a scenario has the same seed, so all differences are paired.
    steps : int, optional
        Steps of each run; by default those of the task.
    seed : int
        Root seed.
    repair : float
        Mean time to repair [ticks].
    policies : tuple of str
        Of CMOMMT, names in `TEAMS`; of another task, its one team with skill.
    availabilities, periods : tuple of float
        The values of the two sweeps.
    scenarios : tuple of (int, float)
        Of CMOMMT, numbers of robots and radii.
    task : Task or str
        The task.
    setting : mapping
        Of another task than CMOMMT, values of its scenario.

    Raises
    ------
    TypeError, ValueError
        If there is no such task, or a value has no meaning for it.
    """

    runs: limits.Runs = 60
    steps: limits.Steps | None = None
    seed: Annotated[int, Allowed(least=0)] = root("unreliable")
    repair: Annotated[Positive, Allowed(unit="ticks")] = 50.0
    policies: tuple[str, ...] | None = None
    availabilities: Annotated[tuple[Annotated[float, Allowed(above=0, most=1)], ...], Allowed()] = AVAILABILITIES
    periods: tuple[float, ...] = PERIODS
    scenarios: tuple[tuple[int, float], ...] = SCENARIOS
    task: Task | str = CMOMMT
    setting: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        task = task_of(self.task)
        object.__setattr__(self, "task", task)
        usual = tuple(TEAMS) if task.name == CMOMMT else (SKILLED,)
        object.__setattr__(self, "policies", self.policies or usual)
        object.__setattr__(self, "steps", self.steps or task.steps)

    @cached_property
    def subject(self) -> Subject:
        """The teams and scenarios."""
        return subject_of(task_of(self.task), self.setting, self.scenarios, self.seed)

    def conditions(self) -> dict[str, Any]:
        """Return the settings, fit for JSON."""
        names = ("runs", "steps", "seed", "repair", "policies", "availabilities", "periods")
        named = {name: getattr(self, name) for name in names}
        named |= self.subject.conditions()
        found: dict[str, Any] = json.loads(json.dumps(named))
        return found

    def planned(self) -> Iterator[Planned]:
        """Yield each run with the columns that identify it.

        These are sweep, value (the availability, or the period [ticks]), policy, aware (whether it has information
        about teammates), the scenario, replicate and seed. The conditions without failures and with period 1 are the
        same runs, which are made once; so are those of one team that several are compared with.
        """
        subject = self.subject
        for condition in self._treatments():
            for policy in self.policies or ():
                for aware in (True, False):
                    for scenario in subject.scenarios:
                        parameters = subject.parameters(policy, aware, scenario)
                        for replicate in range(self.runs):
                            seed = task_seed(subject.task, self.seed, replicate, scenario)
                            named = {"sweep": condition.sweep, "value": condition.value, "policy": policy}
                            named |= {"aware": aware, **scenario, "replicate": replicate, "seed": seed}
                            yield named, self._run(condition, parameters, seed, subject.name(policy, aware))

    def _run(self, condition: _Condition, parameters: Mapping[str, Any], seed: int, team: str) -> Run:
        task, failures, cycle = self.subject.task, condition.failures, condition.cycle
        steps = self.steps or task.steps
        if not isinstance(self.subject, TaskSubject):
            # As parameters, with which runs share a world.
            changed = {"events": failures, "cycle": cycle}
            given = {name: value for name, value in changed.items() if value is not None}
            return task_run(task, {**parameters, **given}, seed, steps)
        label = (task.name, canonical(task.full_scenario(self.setting)), team, repr(failures), repr(cycle))
        measure = UnreliableMeasure(task, failures, cycle)
        return LabelledRun(parameters, seed, steps, measure, task.world, (*label, f"learned {self.seed}"))

    def _treatments(self) -> Iterator[_Condition]:
        """Yield the conditions of both sweeps."""
        from teamsight import Cycle
        from teamsight.agents.components import Failures

        for value in self.availabilities:
            # One object for all runs, by which they recognise that they can share a world.
            failures = Failures(time_to_failure(value, self.repair), self.repair) if value < 1.0 else None
            yield _Condition("failures", value, failures, None)
        for period in self.periods:
            # Robots are not in step, as in a team without a common clock.
            cycle = None if period == 1 else Cycle(period, phase="random")
            yield _Condition("periods", float(period), None, cycle)


def time_to_failure(availability: float, repair: float) -> float:
    """Return the mean time to failure [ticks] that gives an availability below 1 with a mean time to repair."""
    return repair * availability / (1.0 - availability)
