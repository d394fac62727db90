"""The check of what an interaction declares."""

from __future__ import annotations

import keyword
from typing import Any

import numpy as np

from teamsight.core import checks
from teamsight.world.interaction import InteractingBodies, Interaction

# What the kernels can read.
_TYPES = (np.dtype(np.float64), np.dtype(np.int64), np.dtype(np.bool_))


def check_interaction_declarations(interaction: Interaction) -> None:
    """Refuse what is no interaction, or declares something of a wrong type; see `Interaction`.

    Raises
    ------
    TypeError, ValueError
        Naming the attribute.
    """
    if isinstance(interaction, type):
        raise TypeError(f"{interaction.__name__}: is a class; give an object, {interaction.__name__}()")
    name = type(interaction).__name__
    if not isinstance(interaction, Interaction):
        raise TypeError(f"interaction={checks.shown(interaction)}: must be an object of a subclass of Interaction")
    if not hasattr(type(interaction), "kernel"):
        raise TypeError(f"{name}: has no 'kernel'; give kernel(bodies, state, parameters, noise, scores, turn)")
    _check_names(f"{name}.roles", interaction.roles, "('hunters', 'prey')")
    if not interaction.roles:
        raise ValueError(f"{name}.roles=(): must name at least one role, such as ('robots',)")
    _check_names(f"{name}.scores", interaction.scores, "('captures',)")
    checks.count(f"{name}.draws", interaction.draws, least=0)
    checks.flag(f"{name}.in_turn", interaction.in_turn)
    _check_columns(name, interaction)
    _check_parameters(name, interaction)


def _check_names(what: str, names: Any, example: str) -> None:
    if not isinstance(names, tuple) or not all(isinstance(name, str) for name in names):
        example = f"({names!r},)" if isinstance(names, str) else example
        raise TypeError(f"{what}={checks.shown(names)}: must be a tuple of names, such as {example}")
    for name in names:
        if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_") or hasattr(tuple, name):
            raise ValueError(f"{what}: {name!r} cannot be the name of a field; take a name such as {example}")
        if names.count(name) > 1:
            raise ValueError(f"{what}: {name!r} is there twice; take two names")


def _check_columns(name: str, interaction: Interaction) -> None:
    what, example = f"{name}.columns", "(('robots', 'load', 0.0),)"
    columns = interaction.columns
    if not isinstance(columns, tuple) or not all(isinstance(one, tuple) and len(one) == 3 for one in columns):
        raise TypeError(f"{what}={checks.shown(columns)}: must be tuples of role, name and value, such as {example}")
    for role, column, value in columns:
        checks.choice(f"{what}: the role", role, interaction.roles)
        _check_names(what, (column,), example)
        if column in InteractingBodies._fields:
            raise ValueError(f"{what}: {column!r} is a field of all bodies, bodies.{role}.{column}; take another name")
        _check_first(f"{what}: {column}={checks.shown(value)}", value, example)
    declared = [(role, column) for role, column, _ in columns]
    for pair in declared:
        if declared.count(pair) > 1:
            raise ValueError(f"{what}: {pair[1]!r} of {pair[0]} is there twice; take two names")


def _check_first(what: str, value: Any, example: str) -> None:
    """Refuse what a column cannot begin with."""
    if not isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating)):
        raise TypeError(f"{what}: must begin as a finite number, as in {example}")
    kind = np.asarray(value).dtype
    if kind not in _TYPES:
        cure = value.item() if isinstance(value, np.generic) else 0.0
        raise TypeError(f"{what}: has the type {kind}; columns are float64, int64 or bool: begin with {cure!r}")
    if not np.isfinite(value):
        raise TypeError(f"{what}: must begin as a finite number, as in {example}")


def _check_parameters(name: str, interaction: Interaction) -> None:
    try:
        parameters = np.asarray(interaction.parameters, float)
    except (TypeError, ValueError) as error:
        if name in str(error):
            raise
        kind = type(interaction.parameters).__name__
        raise TypeError(f"{name}.parameters: has the type {kind}; it must be a tuple of numbers") from None
    if parameters.ndim != 1 or not np.isfinite(parameters).all():
        raise ValueError(f"{name}.parameters: must be finite numbers in one dimension; they are {parameters.tolist()}")
