"""What `choose_delta` simulates: a task, keyword parameters of `CMOMMT`, or a class or function of a user."""

from __future__ import annotations

import contextlib
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from teamsight.analysis.delta.degrees import Factory, FromSeed
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import Measure, Run, task_run, task_seed
from teamsight.analysis.runs.seeds import model_seed, run_seed
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.tasks.task import Task, Treatment

# T where nothing else says it (§4).
_STEPS = 600


class Simulated(Protocol):
    """Worlds in which neighbours are counted."""

    @property
    def steps(self) -> int:
        """The usual length of a run."""

    @property
    def team(self) -> str | None:
        """The only team that counts, unless another is given."""

    def runs(self, root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        """Return the runs."""

    def check_pool(self, pool: WorkerPool | None) -> None:
        """Refuse worlds that cannot be sent to the processes of a pool."""

    def name(self, robots: int) -> str:
        """Return what is simulated, in words."""


def simulated(
    model: Task | str | Factory | Mapping[str, Any], treatment: Treatment | None, scenario: Mapping[str, Any] | None
) -> Simulated:
    """Return what a user gives to `choose_delta`.

    Raises
    ------
    TypeError, ValueError
        If it is nothing that can be simulated, or a treatment or scenario is given for what is no task.
    """
    from teamsight.tasks.named import task_of
    from teamsight.tasks.task import Task

    if isinstance(model, (Task, str)):
        return TaskWorlds(task_of(model), treatment or "explore", dict(scenario or {}))
    for name, value in (("treatment", treatment), ("scenario", scenario)):
        if value is not None:
            raise ValueError(f"{name}={checks.shown(value)}: is for a task; give one, such as 'cmommt', or omit it")
    if isinstance(model, Mapping):
        return CmommtWorlds(dict(model))
    if not callable(model):
        raise TypeError(
            f"model={model!r}: must be a task, keyword parameters of CMOMMT, or a callable from a seed to a model"
        )
    return FactoryWorlds(model)


@dataclass(frozen=True)
class TaskWorlds:
    """Worlds of a task under one treatment.

    Parameters
    ----------
    task : Task
        The task.
    treatment : "explore", "skilled" or mapping
        The team.
    scenario : mapping
        The values that are given.
    more : mapping
        Further parameters of the world, such as a degree of awareness; with them, `parameters` is complete.
    """

    task: Task
    treatment: Treatment
    scenario: Mapping[str, Any]
    more: Mapping[str, Any] = field(default_factory=dict)

    @property
    def steps(self) -> int:
        """The usual length of a run."""
        return self.task.steps

    @property
    def team(self) -> str | None:
        """The only team that counts, unless another is given."""
        return self.task.team

    def runs(self, root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        """Return the runs, which share what a team has learned."""
        parameters = self.task.parameters(self.treatment, self.scenario, rng=root, **self.more)
        seeds = (task_seed(self.task, root, run, self.scenario) for run in range(runs))
        return [task_run(self.task, parameters, seed, steps, measure) for seed in seeds]

    def check_pool(self, pool: WorkerPool | None) -> None:
        """Refuse a task whose worlds cannot be sent to the processes of a pool."""
        _check_can_be_sent("task", self.task.world, pool)

    def name(self, robots: int) -> str:
        """Return what is simulated, in words."""
        team = self.treatment if isinstance(self.treatment, str) else checks.shown(self.treatment)
        given = "".join(f", {name}={value}" for name, value in {**self.scenario, **self.more}.items())
        return f"task {self.task.name}, {team}{given}, {robots} robots"


@dataclass(frozen=True)
class CmommtWorlds:
    """Worlds of `CMOMMT` with these keyword parameters."""

    settings: Mapping[str, Any]
    steps: int = _STEPS
    team: str | None = None

    def runs(self, root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        """Return the runs."""
        from teamsight.agents.cmommt import CMOMMT

        settings = self.settings
        for name in ("rng", "seed"):
            if name in settings:
                raise ValueError(
                    f"{name}={settings[name]!r}: each run gets a seed of its own; give rng to choose_delta instead"
                )
        with contextlib.closing(CMOMMT(**settings, rng=0)) as first:
            # Given, or by default.
            scenario = [first.settings[name] for name in ("robots", "targets", "radius")]
        return [Run(settings, model_seed(root, run, *scenario), steps, measure) for run in range(runs)]

    def check_pool(self, pool: WorkerPool | None) -> None:
        """Do nothing: what cannot be sent is named where it is."""

    def name(self, robots: int) -> str:
        """Return what is simulated, in words."""
        return f"CMOMMT({', '.join(f'{name}={value}' for name, value in self.settings.items())})"


@dataclass(frozen=True)
class FactoryWorlds:
    """Worlds that a class or function makes from a seed."""

    factory: Factory
    steps: int = _STEPS
    team: str | None = None

    def runs(self, root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        """Return the runs."""
        made = FromSeed(self.factory)
        return [Run({}, run_seed(root, run), steps, measure, made) for run in range(runs)]

    def check_pool(self, pool: WorkerPool | None) -> None:
        """Refuse what cannot be sent to the processes of a pool."""
        _check_can_be_sent("model", self.factory, pool)

    def name(self, robots: int) -> str:
        """Return what is simulated, in words."""
        model: Any = self.factory
        given = ""
        if isinstance(model, partial):
            named = (f"{name}={value!r}" for name, value in model.keywords.items())
            given, model = f"({', '.join([*map(repr, model.args), *named])})", model.func
        return f"{getattr(model, '__name__', type(model).__name__)}{given}, {robots} robots"


def _check_can_be_sent(what: str, model: Any, pool: WorkerPool | None) -> None:
    if pool is None or pool.size == 1:
        return
    try:
        pickle.dumps(model)
    except Exception as error:
        raise TypeError(
            f"{what}={model!r}: cannot be sent to worker processes; give a function of a module, or leave out pool"
        ) from error
