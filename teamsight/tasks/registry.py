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
        "pursuit": "teamsight.tasks.pursuit:PURSUIT",
        "surround": "teamsight.tasks.pursuit:SURROUND",
        "forage": "teamsight.tasks.foraging:FORAGE",
        "consume": "teamsight.tasks.foraging:CONSUME",
        "graze": "teamsight.tasks.foraging:GRAZE",
        "push": "teamsight.tasks.pushing:PUSH",
        "collect": "teamsight.tasks.collecting:COLLECT",
    },
    group="teamsight.tasks",
    by_reference="task",
)
