"""Declarations of interactions: which groups take part, and in which roles."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.agents.engine.engine import Engine
from teamsight.agents.engine.placed_interaction import PlacedInteraction
from teamsight.agents.group import Group
from teamsight.agents.world_data import WorldData
from teamsight.core.interrupts import deferred
from teamsight.world.interaction import Interaction


def interact(data: WorldData, engine: Engine, interaction: Interaction, groups: dict[str, Group]) -> None:
    """Put an interaction into a world; see `World.interact`."""
    data.timeline.check_undecided("interact()", "declare it before the run, or by world.clock.at(world.clock.now, …)")
    nth = sum(type(one.interaction) is type(interaction) for one in data.interactions)
    placed = PlacedInteraction(interaction, tuple(groups[role] for role in interaction.roles), nth, data.key)
    with deferred():
        for role, name, fill in interaction.columns:
            group = groups[role]
            if name not in group.columns:
                group.add_column(name, fill)
            placed.first[role, name] = _by_member(group, group.columns.array(name), fill)
        placed.state = interaction.start(placed.sizes)
        data.interactions.append(placed)
        engine.is_bound = False


def _by_member(group: Group, column: Any, fill: Any) -> Any:
    """Return the elements of a column by member; those who have left have `fill`."""
    found = np.full(group.members_so_far, fill, column.dtype)
    found[group.bodies.member] = column
    return found
