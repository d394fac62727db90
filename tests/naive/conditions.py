"""Who senses whom, found by comparing all pairs of active agents: the slow twin of the search in worlds."""

from __future__ import annotations

from typing import Any

import numpy as np

# Rounding decides whether an agent at exactly the range is in range.
NEAR = 1e-9


def lists_by_hand(world: Any, group: Any, channel: str) -> list[tuple[set[int], set[int]]]:
    """Return for each agent of a group the identities that are in range for certain, and those that may be."""
    observed = [agent for other in group.relations[channel].observed for agent in other.agents if agent.active]
    places = np.array([agent.position for agent in observed]).reshape(-1, 2)
    sensor = group.channels[channel].sensor
    reach = group.awareness_range if channel == "teammates" else group.sensing_range
    found = []
    for row, agent in enumerate(group.agents):
        far = reach[row] if sensor is None or sensor.range is None else sensor.range
        certain, possible = set(), set()
        if group.active[row] and group.channels[channel].works[row] and observed:
            distances = np.hypot(*world.arena.displacement(agent.position, places).T)
            for other, distance in zip(observed, distances.tolist(), strict=True):
                if other is not agent and distance <= far + NEAR:
                    possible.add(other.unique_id)
                    if distance <= far - NEAR:
                        certain.add(other.unique_id)
        found.append((certain, possible))
    return found


def shares_by_hand(world: Any) -> tuple[float, float]:
    """Return the fraction of active targets that are sensed, and the mean number of neighbours of active robots."""
    counted = [relation for group in world.groups for relation in group.relations.values() if relation.counts]
    targets = {agent for relation in counted for other in relation.observed for agent in other if agent.active}
    sensed = {
        one for relation in counted for row in range(len(relation.observers)) for one in relation.agents(*relation.true_lists, row)
    }  # fmt: skip
    robots = [agent for group in world.groups if group.team is not None for agent in group if agent.active]
    degrees = sum(len(agent.neighbours) for agent in robots)
    return (
        len(sensed & targets) / len(targets) if targets else float("nan"),
        degrees / len(robots) if robots else float("nan"),
    )
