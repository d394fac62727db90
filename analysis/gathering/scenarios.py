"""Scenarios of several tasks and team sizes: values for all tasks or for one, for all N or one for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from teamsight.core import checks
from teamsight.tasks.task import Task


def check_scenarios(given: Mapping[str, Any], tasks: Sequence[Task], sizes: Sequence[int]) -> None:
    """Refuse values that are for no task, or not one for each team size.

    Parameters
    ----------
    given : mapping
        Values by name, or by ``"task.name"``, each a value or a sequence of one for each size.
    tasks : sequence of Task
        The tasks.
    sizes : sequence of int
        N.

    Raises
    ------
    ValueError
        If there is such a value; the message names it.
    """
    names = [task.name for task in tasks]
    for name, value in given.items():
        prefix, dot, _ = name.rpartition(".")
        if dot and prefix not in names:
            raise ValueError(
                f"scenario: {name!r} is of the task {prefix!r}, which is not compared; "
                f"{checks.suggestion(prefix, names)}the tasks are {', '.join(names)}"
            )
        if isinstance(value, (list, tuple)) and len(value) != len(sizes):
            raise ValueError(
                f"scenario: {name}={checks.shown(value)} has {len(value)} values; give one, or one for each of the "
                f"{len(sizes)} sizes"
            )
    for task in tasks:
        own = _of(given, task)
        task.full_scenario(own)
        if task.size in own:
            raise ValueError(f"scenario: {task.size} is N, the size of the team; give it as sizes")


def scenario_for(given: Mapping[str, Any], task: Task, sizes: Sequence[int], size: int) -> dict[str, Any]:
    """Return the whole scenario of a task with a team of this size; see `check_scenarios`."""
    at = list(sizes).index(size)
    own = {
        name: value[at] if isinstance(value, (list, tuple)) else value for name, value in _of(given, task).items()
    }  # fmt: skip
    return task.full_scenario({**own, task.size: size})


def _of(given: Mapping[str, Any], task: Task) -> dict[str, Any]:
    """Return the values that are for a task; those for it alone go before those for all."""
    common = {name: value for name, value in given.items() if "." not in name}
    prefix = f"{task.name}."
    return common | {name.removeprefix(prefix): value for name, value in given.items() if name.startswith(prefix)}
