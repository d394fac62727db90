"""``teamsight tasks``: list the tasks, or show one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.cli import task_options, values
from teamsight.cli.options import Settings

if TYPE_CHECKING:
    from teamsight.tasks.task import Task


class TasksSettings(Settings):
    """Settings of ``teamsight tasks``."""

    names: tuple[str, ...] = values.argument("TASK", task_options.TASKS, many=True)
    verify: bool = values.flag("Run both teams of each task, and check that it keeps its contract.")


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
    from rich.table import Table
    from rich.text import Text

    from teamsight.cli.errors import printable
    from teamsight.cli.show import wide_console

    table = Table(box=None, pad_edge=False)
    for heading in ("task", "what it is", "objective", "gathers", "T", "scenario"):
        table.add_column(heading, overflow="fold")
    for task in listed:
        table.add_row(*(Text(printable(text)) for text in _row(task)))
    wide_console().print(table, highlight=False)


def _row(task: Task) -> tuple[str, ...]:
    gathers = {True: "yes", False: "no", None: "unknown"}[task.gathers]
    scenario = ", ".join(f"{name}={value}" for name, value in task.scenario.items())
    objective = f"{task.objective.better} {task.objective.metric}"
    return task.name, task.title, objective, gathers, f"{task.steps}", scenario
