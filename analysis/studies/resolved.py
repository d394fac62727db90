"""Resolves what the runs of a shard name: the model, the measure and components."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from teamsight.analysis.studies.definition.components import Components
from teamsight.analysis.studies.definition.model import model_of
from teamsight.core import checks, references

if TYPE_CHECKING:
    from teamsight.agents.model import World


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
    ValueError
        If a name does not lead to a function or class.
    """

    def __init__(self, model: str, measure: str, path: tuple[str, ...]) -> None:
        find_modules_in(path)
        self.model: Callable[..., World] = model_of(model)
        self.measure: Callable[[World, int], Any] = measure_of(measure)
        self._components = Components()

    def parameters(self, given: Mapping[str, object]) -> dict[str, Any]:
        """Return the keyword arguments of the model for parameters as a study has them."""
        return self._components.resolved(given)


def find_modules_in(path: Iterable[str]) -> None:
    """Let Python find modules in folders, besides those that it searches."""
    sys.path[:0] = [folder for folder in path if folder not in sys.path]


def measure_of(name: str) -> Callable[..., Any]:
    """Return the measure of a name: ``"summary"``, a reference, or the name of a plug-in."""
    if name == "summary":
        from teamsight.analysis.runs.run_many import summary

        return summary
    found = references.load(name, "measure") if references.is_reference(name) else _plug_in(name)
    if not callable(found):
        raise TypeError(f"measure={checks.shown(name)}: is not a function; give measure(world, steps)")
    return found


def _plug_in(name: str) -> object:
    from teamsight.core import plugins

    return plugins.find("teamsight.measures", name)


def modules_of(value: object) -> set[str]:
    """Return the names of the modules to which a study's values refer."""
    if isinstance(value, str):
        return {value.partition(":")[0]} if references.is_reference(value) else set()
    if isinstance(value, Mapping):
        return set().union(*map(modules_of, value.values()))
    return set().union(*map(modules_of, value)) if isinstance(value, (list, tuple)) else set()
