"""Resolves what the runs of a shard name: the model, the measure and components."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teamsight.agents.model import World


class Resolved:
    """The model and the measure of a study, and components by name.

    Parameters
    ----------
    model, measure : str
        Names as a study has them.
    path : tuple of str
        Folders in which modules are found, besides those that Python searches.
    """

    def __init__(self, model: str, measure: str, path: tuple[str, ...]) -> None:
        sys.path[:0] = [folder for folder in path if folder not in sys.path]
        self.model: Callable[..., World] = _model(model)
        self.measure: Callable[[World, int], Any] = _measure(measure)

    def parameters(self, given: Mapping[str, object]) -> dict[str, Any]:
        """Return the keyword arguments of the model for parameters as a study has them."""
        return dict(given)


def _model(name: str) -> Callable[..., Any]:
    from teamsight.agents.cmommt import CMOMMT

    return CMOMMT


def _measure(name: str) -> Callable[..., Any]:
    from teamsight.analysis.runs.run_many import summary

    return summary
