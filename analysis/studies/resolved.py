"""Resolves what the runs of a shard name: the model, the measure and components."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from teamsight.analysis.studies.definition.components import Components
from teamsight.core import checks, plugins, references

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
        sys.path[:0] = [folder for folder in path if folder not in sys.path]
        self.model: Callable[..., World] = model_of(model)
        self.measure: Callable[[World, int], Any] = measure_of(measure)
        self._components = Components()

    def parameters(self, given: Mapping[str, object]) -> dict[str, Any]:
        """Return the keyword arguments of the model for parameters as a study has them."""
        return self._components.resolved(given)


def model_of(name: str) -> Callable[..., Any]:
    """Return the model of a name: ``"cmommt"``, a reference, or the name of a plug-in."""
    if name == "cmommt":
        from teamsight.agents.cmommt import CMOMMT

        return CMOMMT
    return _found("model", name, "teamsight.models")


def measure_of(name: str) -> Callable[..., Any]:
    """Return the measure of a name: ``"summary"``, a reference, or the name of a plug-in."""
    if name == "summary":
        from teamsight.analysis.runs.run_many import summary

        return summary
    return _found("measure", name, "teamsight.measures")


def _found(what: str, name: str, group: str) -> Callable[..., Any]:
    found = references.load(name, what) if references.is_reference(name) else plugins.find(group, name, what)
    if not callable(found):
        raise ValueError(f"{what}={checks.shown(name)}: names a {type(found).__name__}; give a function or a class")
    return found


def modules_of(value: object) -> set[str]:
    """Return the names of the modules to which a study's values refer."""
    if isinstance(value, str):
        return {value.partition(":")[0]} if references.is_reference(value) else set()
    if isinstance(value, Mapping):
        return set().union(*map(modules_of, value.values()))
    return set().union(*map(modules_of, value)) if isinstance(value, (list, tuple)) else set()
