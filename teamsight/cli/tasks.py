"""``teamsight tasks``: list the tasks, or show one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Annotated

from teamsight.cli.options import Options
from teamsight.cli.world_settings import TaskName
from teamsight.core.component import Allowed, Flag

if TYPE_CHECKING:
    from teamsight.tasks.task import Task


# Longest line, as that of the help.
_WIDEST = 80


@dataclass(frozen=True, kw_only=True)
class TasksSettings(Options):
    """Options of ``teamsight tasks``.

    Parameters
    ----------
    names : sequence of str
        Which tasks.
    verify : bool
        Run both teams of each task, and check that it keeps its contract.
    """

    names: Annotated[tuple[TaskName, ...], Allowed(metavar="[TASK]...", is_argument=True, is_repeated=True)] = ()
    verify: Flag = False


def tasks(settings: TasksSettings) -> None:
    """List the tasks: what each is, its objective and its scenario.

    TASK is the name of a task; by default all are listed, plug-ins too. Other commands take a task by --task, and its
    parameters by --set NAME=VALUE; see docs/tasks.

    \b
    Examples:
      teamsight tasks
      teamsight tasks cmommt --verify
    """
    from teamsight.cli.show import say
    from teamsight.tasks.check import check_task
    from teamsight.tasks.named import task_of
    from teamsight.tasks.registry import TASKS

    listed = [task_of(name) for name in settings.names or (*TASKS, *TASKS.plug_ins())]
    if settings.verify:
        for task in listed:
            check_task(task)
    _print(listed)
    if settings.verify:
        say("all keep their contracts")


def _print(listed: list[Task]) -> None:
    """Print the name of each task and, beside it, lines that are broken between words only."""
    from textwrap import wrap

    from teamsight.cli.errors import printable
    from teamsight.cli.show import say, wide_console

    column = max(len(task.name) for task in listed) + 2
    width = max(min(wide_console().width, _WIDEST) - column, 1)
    for task in listed:
        shown = [
            line
            for text in _texts(task)
            for line in wrap(printable(text), width, break_long_words=False, break_on_hyphens=False)
        ]
        for name, line in zip_longest((task.name,), shown, fillvalue=""):
            say(f"{name:<{column}}{line}")


def _texts(task: Task) -> tuple[str, ...]:
    gathers = {True: "gathers", False: "does not gather", None: "not known whether it gathers"}[task.gathers]
    scenario = ", ".join(f"{name}={value}" for name, value in task.scenario.items())
    return task.title, f"{task.objective.better} {task.objective.metric}; {task.steps} steps; {gathers}", scenario
