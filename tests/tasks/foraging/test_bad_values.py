"""Values and worlds for which forage, consume and graze are not made: named, with the limit and the cure."""

from __future__ import annotations

from typing import Any

import pytest

from teamsight import TASKS, Box, Disc, Robot, Target, Torus, World, check_interaction
from teamsight.tasks.foraging import Carrying, Consuming, Grazing, Home

BAD = [
    (Grazing, {"side": 1e6}, ValueError, "side=1e.06: has more than 4000 cells of 1; take a smaller side, or larger"),
    (Grazing, {"obstacles": ((0.0, 1.0),)}, TypeError, r"obstacles=.*\(x, y, radius\), such as"),
    (Grazing, {"obstacles": ((0.0, 1.0, 0.0),)}, ValueError, "obstacles: radius=0"),
    (Grazing, {"obstacles": ((0.0, 0.0, 99.0),)}, ValueError, "obstacles=.*leave no ground in a square of side 64"),
]


@pytest.mark.parametrize(("kind", "given", "error", "text"), BAD, ids=lambda value: str(value)[:40])
def test_values_of_interactions(kind: Any, given: dict[str, Any], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        kind(**given)


BAD_SCENARIOS = [
    ("forage", {"robots": 0}, ValueError, "robots=0: must be at least 1"),
    ("forage", {"robots": "many"}, TypeError, "robots='many': must be a whole number"),
    ("consume", {"attractors": 0}, ValueError, "attractors=0: must be at least 1"),
    ("consume", {"mass": 0.0}, ValueError, "mass=0.0: .*above 0"),
    ("forage", {"mass": -2}, ValueError, "mass=-2"),
    ("graze", {"side": "wide"}, TypeError, "side='wide'"),
    ("graze", {"side": 5000.0, "obstacles": 0.0}, ValueError, "side=5000: has more than 4000 cells"),
    ("forage", {"layout": -1}, ValueError, "layout=-1"),
    ("forage", {"layout": [1]}, TypeError, r"layout=\[1\]: must be a whole number"),
    ("forage", {"obstacles": [0.1]}, TypeError, r"obstacles=\[0\.1\]: must be a number"),
    ("forage", {"speed": -1.0}, ValueError, "speed=-1"),
    ("graze", {"sensing_range": 0.0}, ValueError, "sensing_range=0"),
    ("graze", {"communication_range": 0.0}, ValueError, "communication_range=0"),
    ("pursuit", {"hunters": 0}, ValueError, "hunters=0: must be at least 1"),
    ("pursuit", {"hunters": "many"}, TypeError, "hunters='many'"),
    ("pursuit", {"prey": 0}, ValueError, "prey=0"),
]


@pytest.mark.parametrize(("task", "scenario", "error", "text"), BAD_SCENARIOS, ids=str)
def test_values_of_worlds_are_named_as_they_were_given(
    task: str, scenario: dict[str, Any], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text):
        TASKS[task].build("explore", rng=1, **scenario)


def test_communication_is_checked_with_any_policy() -> None:
    with pytest.raises(ValueError, match="communication='shout'.*goal"):
        TASKS["forage"].build({"policy": "random-walk", "communication": "shout"}, rng=1)


def _world(arena: Any) -> tuple[World, Any, Any, Any]:
    world = World(arena, rng=1)
    robots = world.add(Robot, 2, policy="random-walk")
    things = world.add(Target, 2, policy="stationary", name="attractors")
    return world, robots, things, world.add(Home, 2, policy="stationary", name="home")


def test_arenas_that_repeat_are_refused() -> None:
    world, robots, things, home = _world(Torus(20, 20))
    for interaction, groups in (
        (Carrying(), {"robots": robots, "attractors": things, "home": home}),
        (Consuming(), {"robots": robots, "attractors": things}),
        (Grazing(20.0), {"robots": robots}),
    ):
        name = type(interaction).__name__
        with pytest.raises(ValueError, match=rf"{name}: .*Torus.* repeats; take one that does not: Box"):
            world.interact(interaction, **groups)
        with pytest.raises(ValueError, match="repeats"):
            check_interaction(interaction, Torus(20, 20))
    assert not world.interactions
    assert not robots.columns


@pytest.mark.parametrize("arena", [Box(20, 10), Disc(10.0)])
def test_an_area_larger_than_the_raster_is_refused(arena: Any) -> None:
    world, robots, *_ = _world(arena)
    with pytest.raises(ValueError, match=r"side=16: .* reaches 10 from its middle; give Grazing at least the side 20"):
        world.interact(Grazing(16.0), robots=robots)
    world.interact(Grazing(20.0), robots=robots)
    world.run(5)


def test_attractors_are_delivered_at_any_home_that_is_active() -> None:
    found = []
    for closed in ((), (1,), (0, 1)):
        world, robots, things, home = _world(Box(100, 100))
        world.interact(Carrying(), robots=robots, attractors=things, home=home)
        for group, place in ((home, (-20.0, 0.0)), (home, (20.0, 0.0))):
            group[int(place[0] > 0)].position = place
        for row in range(2):
            robots[row].position = things[row].position = (20.0 * (2 * row - 1), 1.0)
        for row in closed:
            home[row].active = False
        world.run(1)
        found.append(world.recording.history["delivered"].iloc[-1])
    assert found == [2, 1, 0]
