"""Resolves what the runs of a shard name: the model, the measure and components."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from teamsight.analysis.studies.definition.model import TASK_PREFIX, measure_of, model_of, task_named
from teamsight.analysis.studies.definition.values import Components
from teamsight.core import plugins, references
from teamsight.tasks.model import TaskModel

if TYPE_CHECKING:
    from teamsight.agents.world import World


class Resolved:
    """The model and the measure of a study, and the components of its parameters.

    Parameters
    ----------
    model, measure : str
        Names as a study has them.
    path : tuple of str
        Folders in which modules are found, besides those that Python searches.

    Raises
    ------
    TypeError, ValueError
        If a name does not lead to a function or class.
    """

    def __init__(self, model: str, measure: str, path: tuple[str, ...]) -> None:
        references.search_in(path)
        task = task_named(model)
        self._task = None if task is None else TaskModel(task)
        # The world of a task itself, so that runs of CMOMMT share one.
        self.model: Callable[..., World] = model_of(model) if task is None else task.world
        self.measure: Callable[[World, int], Any] = measure_of(measure, model)
        self._components = Components()

    def parameters(self, given: Mapping[str, object]) -> dict[str, Any]:
        """Return the keyword arguments of the model for parameters as a study has them."""
        found = self._components.resolved(given)
        return found if self._task is None else self._task.parameters(found)


def modules_of(values: Mapping[str, object]) -> set[str]:
    """Return the names of the modules of all objects that the values of a study name, plug-ins included."""
    texts = {text.removeprefix(TASK_PREFIX) for text in _texts_in(values)}
    named = {text for text in texts if references.is_reference(text)}
    named |= {plug_in.reference for plug_in in plugins.plug_ins() if plug_in.name in texts}
    return {reference.partition(":")[0] for reference in named}


def _texts_in(value: object) -> list[str]:
    """Return all texts in lists and tables."""
    if isinstance(value, str):
        return [value]
    inner = value.values() if isinstance(value, Mapping) else value if isinstance(value, (list, tuple)) else ()
    return [text for one in inner for text in _texts_in(one)]
