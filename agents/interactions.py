"""Declarations of interactions: which groups take part, and in which roles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from teamsight.agents.columns import is_free
from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.interactions import PlacedInteraction
from teamsight.agents.group import Group
from teamsight.agents.recording.history import COLUMNS
from teamsight.agents.world_data import WorldData
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.world.checked_interaction import check_interaction_declarations
from teamsight.world.interaction import Interaction


def interact(data: WorldData, engine: Engine, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Put an interaction into a world; see `World.interact`."""
    data.timeline.check_undecided("interact()", "declare it before the run, or by world.clock.at(world.clock.now, …)")
    check_interaction_declarations(interaction)
    _check_groups(data, interaction, groups)
    _check_new(data, interaction, groups)
    _check_fit(data, interaction, groups)
    for role, name, fill in interaction.columns:
        _check_column(data, type(interaction).__name__, groups[role], name, fill)
    nth = sum(type(one.interaction) is type(interaction) for one in data.interactions)
    placed = PlacedInteraction(interaction, tuple(groups[role] for role in interaction.roles), nth, data.key)
    with deferred():
        for role, name, fill in interaction.columns:
            group = groups[role]
            if name not in group.columns:
                group.add_column(name, fill)
            group.columns.keep(name, type(interaction).__name__, group.members, fill)
        data.interactions.append(placed)
        engine.is_bound = False


def adjust_interaction(data: WorldData, interaction: Interaction, changes: Mapping[str, Any]) -> None:
    """Change the fields of an interaction; see `World.adjust`."""
    data.timeline.check_undecided("adjust()", "plan it with world.clock.at(world.clock.now, …)")
    name = type(interaction).__name__
    found = [one for one in data.interactions if interaction is one.declared or interaction is one.interaction]
    if not found:
        raise ValueError(f"adjust({name}): is not in this world now; give one of world.interactions")
    if not is_dataclass(interaction):
        raise TypeError(f"adjust({name}): has no fields to change; make it a dataclass, whose fields are its constants")
    known = [field.name for field in fields(interaction) if field.init]
    for field, value in changes.items():
        if field not in known:
            cure = f"{checks.suggestion(field, known)}{name} has {', '.join(known) or 'no fields'}"
            raise TypeError(f"adjust({name}): {field}={checks.shown(value)}: unknown; {cure}")
    # All is checked before anything changes.
    for one in found:
        changed = one.with_changes({**one.changes, **changes})
        check_interaction_declarations(changed)
        _check_fit(data, changed, one.roles)
    with deferred():
        for one in found:
            one.take({**one.changes, **changes})


def _check_fit(data: WorldData, interaction: Interaction, groups: Mapping[str, Group]) -> None:
    order = sorted(interaction.roles, key=lambda role: groups[role].number)
    interaction.check_fit(data.arena, tuple(order))


def _check_groups(data: WorldData, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Refuse groups that are not those of the roles, one each, of this world."""
    name, roles = type(interaction).__name__, interaction.roles
    example = f"world.interact({name}(), {', '.join(f'{role}=…' for role in roles)})"
    for role in roles:
        if role not in groups:
            raise TypeError(f"{name}: has no group for the role {role!r}; give one for each role: {example}")
    for role, group in groups.items():
        if role not in roles:
            raise TypeError(f"{name}: has no role {role!r}, but {', '.join(map(repr, roles))}: {example}")
        if not isinstance(group, Group):
            given = checks.shown(group)
            raise TypeError(f"{role}={given}: give a group, not a list or an agent; world.add returns it")
        if group not in data.groups:
            raise ValueError(f"{role}={checks.shown(group)}: must have been added to this world")
        first = next(other for other in groups if groups[other] is group)
        if first != role:
            raise ValueError(
                f"{name}: the group {group.name!r} has the roles {first!r} and {role!r}; give each role a group of its "
                "own, or declare one role"
            )


def _check_new(data: WorldData, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Refuse an interaction that is there already, and scores that are columns of the history."""
    name = type(interaction).__name__
    for placed in data.interactions:
        if type(placed.interaction) is type(interaction) and placed.roles == groups:
            raise ValueError(
                f"{name}: is already between {', '.join(group.name for group in placed.groups)}; it would happen twice "
                "in each step. Leave one out, or give other groups"
            )
    for score in interaction.scores:
        if score in COLUMNS or score in data.score_names:
            raise ValueError(
                f"{name}.scores: {score!r} is already a column of world.recording.history; take another name, in a "
                "subclass if need be"
            )


def _check_column(data: WorldData, name: str, group: Group, column: str, fill: Any) -> None:
    """Refuse a column that the group cannot have, has with another type, or that another interaction keeps."""
    kind = np.asarray(fill).dtype
    if column in group.columns:
        array = group.columns.array(column)
        if array.dtype != kind or array.ndim != 1:
            raise ValueError(
                f"{name}.columns: {group.name} have a column {column!r} of {array.dtype} and shape {array.shape}; it "
                f"must be of {kind}, one for each agent: add_column({column!r}, {fill!r})"
            )
    elif not all(is_free(agent, column) for agent in group._agents):
        raise ValueError(f"{name}.columns: agents of {group.name!r} have the attribute {column!r}; take another name")
    for placed in data.interactions:
        # Each would take what the other has written for its own.
        if any(placed.roles[role] is group and column == other for role, other, _ in placed.interaction.columns):
            raise ValueError(
                f"{name}.columns: {column!r} of {group.name} is kept by {placed.name}; give this interaction another "
                f"group, make one interaction of both, or give the columns of one of them other names"
            )
