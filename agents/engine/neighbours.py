"""Neighbours: the relations between the groups of a world."""

from __future__ import annotations

from teamsight.agents.engine.failures import check_places
from teamsight.agents.engine.relation import Relation
from teamsight.agents.group import Group, team_of
from teamsight.agents.resolve import check_fit
from teamsight.agents.world_data import WorldData


def connect(data: WorldData, sensed: list[tuple[Group, Group]]) -> list[Relation]:
    """Return the relations of a world, given pairs (observers, observed), and set those of each group.

    Raises
    ------
    ValueError
        If an agent is outside the arena, or a policy does not fit its degree of awareness. No group is changed then.
    """
    check_places(data)
    teams = {group.number: team_of(data.groups, group) for group in data.groups}
    for group in data.groups:
        check_fit(group, teams[group.number])
    relations = []
    for group in data.groups:
        group.relations = {}
        targets = [observed for observers, observed in sensed if observers is group]
        for kind, others, reach in (
            ("targets", targets, group.sensing_range),
            ("teammates", teams[group.number], group.awareness_range),
        ):
            if others:
                group.relations[kind] = Relation(kind, group, others, reach, data.arena)
                relations.append(group.relations[kind])
    return relations
