"""The model of a study: a class or function, found by name, and its parameters."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from teamsight.core import checks, references

if TYPE_CHECKING:
    from teamsight.agents.model import World

#: The name of `CMOMMT` in a study.
CMOMMT_NAME = "cmommt"


def model_of(model: str) -> Callable[..., World]:
    """Return the class or function of a model; its module is imported.

    Raises
    ------
    TypeError, ValueError
        If there is none of this name, or it cannot be called.
    """
    if model == CMOMMT_NAME:
        from teamsight.agents.cmommt import CMOMMT

        return CMOMMT
    found = references.load(model, "model") if references.is_reference(model) else _plug_in(model)
    if not callable(found):
        raise TypeError(f"model={checks.shown(model)}: is not a class or function; give model(**setting, rng=seed)")
    return found


def signature_of(model: str) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of a model by name; none if its signature cannot be read."""
    try:
        return inspect.signature(model_of(model)).parameters
    except ValueError:  # a class of C
        return {}


def integers_of(model: str) -> frozenset[str]:
    """Return the parameters that the signature of a model declares as integers."""
    return frozenset(name for name, one in signature_of(model).items() if one.annotation in (int, "int"))


def _plug_in(name: str) -> object:
    from teamsight.core import plugins

    return plugins.find("teamsight.models", name)
