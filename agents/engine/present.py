"""Look-ups in the relations of a world between its steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from teamsight.agents.engine.neighbours import Relation

if TYPE_CHECKING:
    from teamsight.agents.body import Body


def observers_of(relations: list[Relation], agent: Body) -> list[Any]:
    """Return the agents that have this one in sensing range."""
    found = []
    for relation in relations:
        if relation.kind == "targets" and agent.group.number in relation.first:
            index = relation.first[agent.group.number] + agent.row
            edges = np.flatnonzero(relation.graph.identity == index)
            rows = np.searchsorted(relation.graph.start, edges, side="right") - 1
            found += [relation.observers.agents[row] for row in rows]
    return found
