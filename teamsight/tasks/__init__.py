"""Tasks: what a team is to achieve in which world, how it is measured, and how it explores and acts with skill."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from teamsight.tasks.check import check_task
    from teamsight.tasks.named import task_of
    from teamsight.tasks.registry import TASKS
    from teamsight.tasks.task import Objective, Task

_HOMES = {
    "Objective": "teamsight.tasks.task",
    "TASKS": "teamsight.tasks.registry",
    "Task": "teamsight.tasks.task",
    "check_task": "teamsight.tasks.check",
    "task_of": "teamsight.tasks.named",
}

__all__ = ["TASKS", "Objective", "Task", "check_task", "task_of"]

__getattr__ = lazy_names(__name__, _HOMES, globals())
