"""The tasks that have a name; each is imported when it is first used."""

from __future__ import annotations

from typing import TYPE_CHECKING

from teamsight.core.registry import Registry

if TYPE_CHECKING:
    from teamsight.tasks.task import Task

#: The tasks by name, in the order of tables; "package.module:TASK" is one of any module.
TASKS: Registry[Task] = Registry(
    {
        "cmommt": "teamsight.tasks.cmommt:TASK",
        "pursuit": "teamsight.tasks.pursuit.task:TASK",
        "surround": "teamsight.tasks.pursuit.surround_task:TASK",
        "forage": "teamsight.tasks.foraging.forage:TASK",
        "consume": "teamsight.tasks.foraging.consume:TASK",
        "graze": "teamsight.tasks.foraging.graze:TASK",
        "push": "teamsight.tasks.pushing.task:TASK",
        "collect": "teamsight.tasks.collecting.task:TASK",
    },
    group="teamsight.tasks",
    by_reference="task",
)
