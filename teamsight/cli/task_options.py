"""Options by which commands take a task in place of CMOMMT: ``--task``, ``--set`` and ``--treatment``."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Protocol

from teamsight.cli import values
from teamsight.core import references
from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.tasks.model import TaskModel
    from teamsight.tasks.task import Task


class _Tasks(Registry[Any]):
    """The tasks by name, and those of modules in the folder in which a command runs: "module:TASK"."""

    def __init__(self, tasks: Registry[Any]) -> None:
        super().__init__(tasks._homes, tasks._group, tasks._by_reference)

    def _is_reference(self, name: str) -> bool:
        if found := super()._is_reference(name):
            # Of a program that is installed, unlike of python -m, Python does not search that folder.
            references.search_in([os.getcwd()])
        return found


def TASKS() -> Registry[Any]:  # noqa: N802  named like the registries of `values`
    """Return the tasks that a command takes."""
    from teamsight.tasks import registry

    return _Tasks(registry.TASKS)


class OfTask(Protocol):
    """Settings of a command that takes a task."""

    given: frozenset[str]
    task: str | None
    set: dict[str, Any]


def task(help: str = "The task in place of CMOMMT with its own options: {names}, or module:TASK.") -> Any:
    """Declare a task by name, or by the module in which it is."""
    return values.choice(None, help, TASKS, shown="CMOMMT")


def scenario(
    help: str = "A parameter of the task, such as one of its scenario. May be given several times.",
    *,
    dotted: bool = False,
) -> Any:
    """Declare parameters of a task, or, with names such as forage.side, of several."""
    return values.assignments(help, dotted=dotted)


def listed(value: Any) -> list[Any]:
    """Return the values of a parameter that were given with commas between them."""
    return [values.number_in(part.strip()) for part in value.split(",")] if isinstance(value, str) else [value]


def treatment(default: str | None, help: str, shown: str = "") -> Any:
    """Declare the team of a task."""
    return values.choice(default, help, values.registry("teamsight.tasks.treatments", "TREATMENTS"), shown=shown)


def check(settings: OfTask, own: Iterable[str], of_task: Iterable[str] = ("set", "treatment")) -> None:
    """Refuse options that do not go together: those of CMOMMT with a task, and those of a task without one.

    Parameters
    ----------
    settings : Settings
        The settings of a command.
    own : iterable of str
        The options of CMOMMT.
    of_task : iterable of str
        Those that need a task.

    Raises
    ------
    ValueError
        If there is one, or the task has no such parameter.
    """
    if settings.task is None:
        for name in of_task:
            if name in settings.given:
                raise ValueError(f"--{_flag(name)}: is for a task; give --task NAME too, or leave it out")
        return
    for name in own:
        if name in settings.given:
            raise ValueError(
                f"--{_flag(name)}={getattr(settings, name)}: is an option of CMOMMT; with --task {settings.task} give "
                "--set NAME=VALUE"
            )
    model_of(settings).parameters_known(settings.set)


def task_of(settings: OfTask) -> Task:
    """Return the task that was given."""
    from teamsight.tasks.named import task_of

    assert settings.task is not None
    return task_of(settings.task)


def model_of(settings: OfTask, treatment: str | None = None, rng: int = 0) -> TaskModel:
    """Return the task that was given as a model."""
    from teamsight.tasks.model import TaskModel

    return TaskModel(task_of(settings), treatment, rng)  # type: ignore[arg-type]


def chosen(settings: OfTask, treatment: str) -> dict[str, Any]:
    """Return the treatment and the scenario that were given, as `choose_delta` takes them.

    Other parameters of the world belong to the team: with them, the treatment is a mapping.
    """
    task = task_of(settings)
    scenario = {name: value for name, value in settings.set.items() if name in task.scenario}
    more = {name: value for name, value in settings.set.items() if name not in scenario}
    if not more:
        return {"treatment": treatment, "scenario": scenario}
    full = model_of(settings, treatment).parameters(settings.set)
    team = {name: value for name, value in full.items() if name not in task.scenario}
    return {"treatment": team, "scenario": scenario}


def size_of(settings: OfTask) -> int:
    """Return N of the task that was given; 1 if that is no number, which its world refuses."""
    found = task_of(settings)
    size = settings.set.get(found.size, found.scenario[found.size])
    return size if isinstance(size, int) and size > 0 else 1


def _flag(name: str) -> str:
    return name.replace("_", "-")
