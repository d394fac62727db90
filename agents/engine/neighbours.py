"""Neighbours: the relations between the groups of a world."""

from __future__ import annotations

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.failures import check_places
from teamsight.agents.engine.relation import Relation
from teamsight.agents.group import team_of
from teamsight.agents.resolve import check_channels, check_fit
from teamsight.agents.world_data import WorldData


def connect(data: WorldData) -> list[Relation]:
    """Return the relations of a world, and set those of each group.

    Raises
    ------
    ValueError
        If an agent is outside the arena, or a policy needs what its group does not perceive. No group is changed then.
    """
    check_places(data)
    teams = {group.number: team_of(data.groups, group) for group in data.groups}
    for group in data.groups:
        check_fit(group, teams[group.number])
        check_channels(group, group.policy)
    relations: list[Relation] = []
    for group in data.groups:
        if TEAMMATES in group.channels:
            group.channels[TEAMMATES].observed = teams[group.number]
        # First what is sensed, in the order of declarations, and then the team.
        channels = sorted(group.channels.values(), key=lambda channel: channel.name == TEAMMATES)
        group.relations = {channel.name: Relation(channel, group, data) for channel in channels}
        relations += group.relations.values()
    return relations
