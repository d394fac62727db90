"""Present values: what the relations of a world show between its steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.neighbours import Relation

if TYPE_CHECKING:
    from teamsight.agents.body import Body


def observed_share(relations: list[Relation]) -> float:
    """Return the share of targets that at least one robot of a team sees, 0..1; NaN without targets."""
    seen: dict[int, npt.NDArray[np.bool_]] = {}
    for relation in relations:
        if relation.kind == "targets" and relation.observers.team is not None:
            met = np.zeros(len(relation.everyone), bool)
            met[relation.graph.identity] = True
            for group in relation.observed:
                first = relation.first[group.number]
                part = met[first : first + len(group)]
                seen[group.number] = seen.get(group.number, False) | part
    total = sum(map(len, seen.values()))
    return sum(int(part.sum()) for part in seen.values()) / total if total else float("nan")


def mean_neighbours(relations: list[Relation]) -> float:
    """Return the mean number of robots within a robot's awareness range; NaN without robots."""
    teams = [relation for relation in relations if relation.kind == "teammates"]
    robots = sum(len(relation.observers) for relation in teams)
    return sum(len(relation.graph.identity) for relation in teams) / robots if robots else float("nan")


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
