"""The options of commands that make worlds: those of `CMOMMT`, of its components, and of a task in place of it."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.agents import settings as cmommt
from teamsight.cli.options import Options, component_options, flag, options_in
from teamsight.cli.values import Treatment
from teamsight.core.component import Allowed, Declared, Positive, Seed, declared, value_in

if TYPE_CHECKING:
    from teamsight.agents.components.failures import Failures
    from teamsight.core.registry import Registry
    from teamsight.tasks.model import TaskModel
    from teamsight.tasks.task import Task


def TASKS() -> Registry[Any]:  # noqa: N802  named like the registries
    """Return the tasks that a command takes."""
    from teamsight.tasks import registry

    return registry.TASKS


TaskName = Annotated[str, Allowed(choices=TASKS)]


@dataclass(frozen=True, kw_only=True)
class TaskOptions(Options):
    """Options of commands that take a task in place of `CMOMMT`.

    Parameters
    ----------
    task : str, optional
        The task in place of CMOMMT, or module:TASK; then its parameters are options, such as those of its scenario.
    set : mapping of str to object
        A parameter of the task or model, such as one of its scenario. May be given several times.
    """

    task: Annotated[TaskName | None, Allowed(shown="CMOMMT")] = None
    set: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def brings(cls, arguments: Sequence[str]) -> Mapping[str, Declared]:
        """Return the options of the policies and degrees that are named, and those of the task."""
        found = component_options(cls, arguments)
        if named := options_in(arguments, "task"):
            from teamsight.tasks.model import TaskModel
            from teamsight.tasks.named import task_of

            taken = {"rng", *cls.options()}
            # A task that is none is refused with all else that is wrong.
            with contextlib.suppress(TypeError, ValueError):
                for name, one in declared(TaskModel(task_of(named[-1]))).items():
                    if name not in taken and one.kind not in ("object", "mapping"):
                        found[name] = one
        return found

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters of the task that were given, under their own names or by ``--set``."""
        own = {name: value for name, value in self.brought.items() if "." not in name}
        shared = {name: getattr(self, name) for name in self.given & self.world_options()}
        return {**shared, **own, **self.set}

    @classmethod
    def world_options(cls) -> frozenset[str]:
        """Return the names of the options that are parameters of `CMOMMT`."""
        world = {name for name, one in declared(cmommt.Settings).items() if one.kind != "object"}
        return frozenset(cls.options().keys() & world)

    def check_task(self, of_task: Sequence[str] = ("set", "treatment"), others: Sequence[str] = ()) -> None:
        """Refuse options that do not go together: those of a task without one, and what the task does not have.

        Parameters
        ----------
        of_task : sequence of str
            The options that need a task.
        others : sequence of str
            Options that a task does not have.

        Raises
        ------
        ValueError
            If there is one, or the task has no such parameter.
        """
        if self.task is None:
            for name in of_task:
                if name in self.given:
                    raise ValueError(f"--{flag(name)}: is for a task; give --task NAME too, or leave it out")
            return
        self.refuse(others, f"is for CMOMMT, not for the task {self.task}")
        for name in self.brought:
            if "." in name:
                raise ValueError(f"--{name}: is for CMOMMT, not for the task {self.task}; leave it out")
        for name in self.set:
            if name in self.parameters and name in self.given | self.brought.keys():
                raise ValueError(f"set={name}: is given as --{flag(name)} too; leave one out")
        self.model_of().parameters_known(self.parameters)

    def task_given(self) -> Task:
        """Return the task that was given."""
        from teamsight.tasks.named import task_of

        assert self.task is not None
        return task_of(self.task)

    def model_of(self, treatment: str | None = None, rng: int = 0) -> TaskModel:
        """Return the task that was given as a model."""
        from teamsight.tasks.model import TaskModel

        return TaskModel(self.task_given(), treatment, rng)  # type: ignore[arg-type]

    def chosen(self, treatment: str) -> dict[str, Any]:
        """Return the treatment and the scenario that were given, as `choose_delta` takes them.

        Other parameters of the world belong to the team: with them, the treatment is a mapping.
        """
        task, given = self.task_given(), self.parameters
        scenario = {name: value for name, value in given.items() if name in task.scenario}
        if len(scenario) == len(given):
            return {"treatment": treatment, "scenario": scenario}
        full = self.model_of(treatment).parameters(given)
        team = {name: value for name, value in full.items() if name not in task.scenario}
        return {"treatment": team, "scenario": scenario}

    def task_size(self) -> int:
        """Return N of the task that was given; 1 if that is no number, which its world refuses."""
        found = self.task_given()
        size = self.parameters.get(found.size, found.scenario[found.size])
        return size if isinstance(size, int) and size > 0 else 1

    def world(self) -> dict[str, Any]:
        """Return the parameters of `CMOMMT` that were given, with the options of its components.

        Raises
        ------
        TypeError, ValueError
            If a component refuses its options.
        """
        given = {name: getattr(self, name) for name in self.given & self.world_options()}
        for name, value in self.brought.items():
            base, dot, option = name.partition(".")
            if not dot:
                continue
            if f"{base}_options" in declared(cmommt.Settings):
                given[f"{base}_options"] = {**given.get(f"{base}_options", {}), option: value}
            else:
                made = given.get(base, getattr(self, base))
                registry: Any = declared(cmommt.Settings)[base].choices
                # Its other options keep their defaults.
                make = registry[made] if isinstance(made, str) else partial(replace, made)
                given[base] = make(**{option: value})
        return given


@dataclass(frozen=True, kw_only=True)
class WorldOptions(TaskOptions, cmommt.Settings):
    """Which world is simulated, and with which seed.

    Parameters
    ----------
    treatment : str, optional
        The team of the task.
    failures : float, optional
        Mean number of ticks until a robot fails.
    repair : float, optional
        Mean number of ticks until a failed robot is repaired.
    seed : int
        Seed of the world.
    """

    treatment: Annotated[Treatment | None, Allowed(shown="skilled")] = None
    failures: Annotated[Positive | None, Allowed(unit="ticks", shown="no failures")] = None
    repair: Annotated[Positive | None, Allowed(unit="ticks", shown="no repair")] = None
    seed: Seed = 0

    def source_of_failures(self) -> Failures | None:
        """Return the source of failures, if there are any."""
        if self.failures is None:
            return None
        from teamsight.agents.components.failures import Failures

        return Failures(self.failures, self.repair)


def listed(value: Any) -> list[Any]:
    """Return the values of a parameter that were given with commas between them."""
    return [value_in(part.strip()) for part in value.split(",")] if isinstance(value, str) else [value]
