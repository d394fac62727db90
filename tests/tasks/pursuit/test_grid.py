"""Rules of pursuit in worlds for which they are not made."""

from __future__ import annotations

from typing import Any

import pytest

from teamsight import Box, Circle, Robot, Target, Torus, World, check_interaction
from teamsight.tasks.pursuit import Capture, Surround

BAD = [
    (Capture(10, 8), Box(10, 10), r"Capture: is made for Box\(10, 8\), .*the width and the height of the arena"),
    (Capture(10, 10, torus=True), Torus(10, 8), r"is made for Torus\(10, 10\)"),
    (Capture(10, 10), Torus(10, 10), r"has torus=False.*give it torus=True"),
    (Capture(10, 10, torus=True, rule="pair"), Box(10, 10), r"has torus=True.*give it torus=False"),
    (Surround(10, 10), Box(10, 10), r"Surround: has torus=True"),
    (Surround(9, 10), Torus(10, 10), r"Surround: is made for Torus\(9, 10\)"),
]


@pytest.mark.parametrize(("rule", "arena", "text"), BAD, ids=str)
def test_another_arena_is_refused(rule: Any, arena: Any, text: str) -> None:
    world = World(arena, rng=1)
    hunters, prey = world.add(Robot, 2, policy="random-walk"), world.add(Target, 1, policy="random-walk")
    with pytest.raises(ValueError, match=text):
        world.interact(rule, hunters=hunters, prey=prey)
    with pytest.raises(ValueError, match=text):
        check_interaction(rule, arena)
    assert not world.interactions


def test_prey_that_move_first_are_refused_where_hunters_must() -> None:
    world = World(Box(10, 10), rng=1)
    prey, hunters = world.add(Target, 1, policy="random-walk"), world.add(Robot, 2, policy="random-walk")
    with pytest.raises(ValueError, match="prey would move before hunters; add the hunters to the world before the prey"):
        world.interact(Capture(10, 10), hunters=hunters, prey=prey)
    world.interact(Capture(10, 10, rule="pair"), hunters=hunters, prey=prey)


def test_obstacles_in_the_arena_are_no_other_sides() -> None:
    world = World(Box(10, 10).with_obstacles(Circle((2.0, 2.0), 0.4)), rng=1)
    hunters, prey = world.add(Robot, 2, policy="random-walk"), world.add(Target, 1, policy="random-walk")
    world.interact(Capture(10, 10), hunters=hunters, prey=prey)
