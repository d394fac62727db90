"""Interactions that are made for a square arena, in others."""

from __future__ import annotations

from typing import Any

import pytest

from teamsight import Box, Circle, Disc, Robot, Target, Torus, World, check_interaction
from teamsight.tasks.collecting import Collecting
from teamsight.tasks.pushing import Pushing

ROLES = {"Pushing": ("robots", "box"), "Collecting": ("robots", "pucks", "home")}


def _interact(rule: Any, arena: Any) -> World:
    world = World(arena, rng=1)
    robots, *others = ROLES[type(rule).__name__]
    groups: dict[str, Any] = {role: world.add(Target, 1, policy="stationary", name=role) for role in others}
    groups[robots] = world.add(Robot, 2, policy="random-walk")
    world.senses(groups[robots], groups[others[0]])
    world.interact(rule, **groups)
    return world


@pytest.mark.parametrize("rule", [Pushing(40.0), Collecting(40.0)], ids=lambda rule: type(rule).__name__)
@pytest.mark.parametrize("arena", [Box(50, 50), Box(40, 30), Torus(40, 40), Disc(20.0), Disc(30.0)], ids=str)
def test_another_arena_than_its_square_is_refused(rule: Any, arena: Any) -> None:
    name = type(rule).__name__
    text = rf"side=40: {name} is made for Box\(40, 40\), and the arena is {type(arena).__name__}.*give {name} its side"
    with pytest.raises(ValueError, match=text):
        _interact(rule, arena)
    with pytest.raises(ValueError, match=text):
        check_interaction(rule, arena)


@pytest.mark.parametrize("rule", [Pushing(40.0), Collecting(40.0)], ids=lambda rule: type(rule).__name__)
@pytest.mark.parametrize("arena", [Box(40, 40), Box(40, 40).with_obstacles(Circle((15.0, 15.0), 6.0))], ids=str)
def test_its_square_is_taken_with_obstacles_and_without(rule: Any, arena: Any) -> None:
    _interact(rule, arena).run(3)
