"""Neighbours: the relations between the groups of a world."""

from __future__ import annotations

from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.engine.failures import check_places
from teamsight.agents.engine.relation import Relation
from teamsight.agents.group import Group, team_of
from teamsight.agents.resolve import check_fit
from teamsight.agents.world_data import WorldData
from teamsight.policies.interface import Policy
from teamsight.policies.registry import label


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
        _check_channels(group)
    relations = []
    for group in data.groups:
        if TEAMMATES in group.channels:
            group.channels[TEAMMATES].observed = teams[group.number]
        # First what is sensed, in the order of declarations, and then the team.
        channels = sorted(group.channels.values(), key=lambda channel: channel.name == TEAMMATES)
        group.relations = {channel.name: Relation(channel, group, data) for channel in channels}
        relations += group.relations.values()
    return relations


def _check_channels(group: Group) -> None:
    """Refuse a policy that reads a channel in which its group senses nothing."""
    policy = group.policy
    if not isinstance(policy, Policy):
        return
    needed = [name for name in policy.needs if name == TARGETS]
    for name in (*needed, *policy.channels):
        if name not in group.channels:
            declared = "" if name == TARGETS else f", as_={name!r}"
            raise ValueError(
                f"policy={label(policy)}: reads {name!r}, and the group {group.name!r} senses nothing under this name; "
                f"declare it: world.senses({group.name}, others{declared})"
            )
