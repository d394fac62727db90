"""A task that is given as an object or by name."""

from __future__ import annotations

from teamsight.core import checks
from teamsight.tasks.registry import TASKS
from teamsight.tasks.task import Task


def task_of(task: Task | str) -> Task:
    """Return a task, or the one of a name.

    Parameters
    ----------
    task : Task or str
        A task, a key of `TASKS`, the name of a plug-in, or a reference, "package.module:TASK".

    Raises
    ------
    TypeError
        If it is neither a task nor a name, or what has this name is no task.
    ValueError
        If the name is unknown, or that of a plug-in or a reference that does not load.
    """
    if isinstance(task, Task):
        return task
    if not isinstance(task, str):
        raise TypeError(f"task={checks.shown(task)}: must be a Task, or the name of one: {', '.join(TASKS)}")
    found: object = TASKS[checks.choice("task", task, TASKS)]
    if not isinstance(found, Task):
        raise TypeError(f"task={task!r}: this is {checks.shown(found)}; give a teamsight.Task")
    return found
