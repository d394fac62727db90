"""All agents that are on a team, and who is whose neighbour, against a count by hand."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.policies import RandomWalk, Stationary


class Rival(Robot):
    team: ClassVar[str | None] = "rivals"


def worlds(seed: int) -> World:
    """A world of some groups, on one team, on another and on none, some of which have lost agents."""
    rng = np.random.default_rng(seed)
    arena = [Disc(1.5), Box(3.0, 2.0), Torus(4.0, 4.0)][rng.integers(3)]
    world = World(arena, rng=seed)
    for kind in rng.choice([Robot, Rival, Target], rng.integers(1, 6)):
        size = int(rng.integers(1, 7))
        reach = rng.uniform(0.2, 1.5, size) if rng.random() < 0.5 else 1.0
        world.add(kind, size, policy=[RandomWalk(), Stationary()][rng.integers(2)], awareness_range=reach)
    world.run(int(rng.integers(0, 4)))
    for group in world.groups:
        for agent in list(group)[: int(rng.choice([0, 1, 99], p=[0.6, 0.2, 0.2]))]:
            agent.remove()
    return world


@pytest.mark.parametrize("_", range(25))
def test_neighbours_are_those_counted_by_hand(_: int) -> None:
    seed = fresh_seed()
    world = worlds(seed)
    graph, members = world.neighbours, world.teammates
    agents = [agent for group in world.groups if group.team is not None for agent in group]
    assert members.identity.tolist() == [agent.unique_id for agent in agents], seed
    assert members.position.tolist() == [agent.position.tolist() for agent in agents], seed
    assert members.heading.tolist() == [agent.heading.tolist() for agent in agents], seed
    reaches = [agent.group.awareness_range[agent.row] for agent in agents]
    assert members.awareness_range.tolist() == reaches, seed
    assert members.speed.tolist() == [0.1] * len(agents), seed
    assert len(graph.start) == len(agents) + 1, seed
    for row, (agent, reach) in enumerate(zip(agents, reaches, strict=True)):
        edges = slice(graph.start[row], graph.start[row + 1])
        expected = []
        for other, teammate in enumerate(agents):
            way = world.arena.displacement(agent.position, teammate.position)
            near = teammate is not agent and teammate.group.team == agent.group.team and np.hypot(*way) <= reach
            expected += [other] if near else []
        assert graph.identity[edges].tolist() == expected, seed
        assert graph.distance[edges] == pytest.approx(np.hypot(*graph.offset[edges].T)), seed
    same = [np.array([agent.group.team == other.group.team for other in agents]).sum() for agent in agents]
    assert members.largest_team == max(same, default=0), seed


def test_graphs_do_not_change_with_the_world() -> None:
    model = CMOMMT(robots=12, radius=2.0, policy="random-walk", rng=1)
    graph, members = model.neighbours, model.teammates
    before = [array.copy() for array in (*graph, *members)]
    model.run(20)
    for array, old in zip((*graph, *members), before, strict=True):
        assert array.tolist() == old.tolist()
    assert model.neighbours.identity.tolist() != graph.identity.tolist()


def test_nobody_on_a_team() -> None:
    world = World(Disc(2.0), rng=1)
    for _ in range(2):
        assert world.neighbours.start.tolist() == [0]
        assert len(world.neighbours.identity) == len(world.teammates.identity) == world.teammates.largest_team == 0
        world.add(Target, 3, policy=Stationary())
