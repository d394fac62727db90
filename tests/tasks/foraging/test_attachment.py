"""Who is attached to what, whatever else happens: agents that leave, fail or come, and speeds that are set meanwhile."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from teamsight import Arrivals, Box, Robot, Target, Times, World
from teamsight.tasks.foraging import Attractor, Carrying, Consume, Consuming, Forage, Home
from tests.interactions import fingerprint


def _right(percept: Any, rng: Any) -> tuple[float, float]:
    return 0.0, percept.speed


def carried(*, loads: int = 3, home_at: tuple[float, float] = (300.0, 0.0)) -> Any:
    """Return a world in which robot k is at attractor k, and all robots go to the right; home is far away."""
    world = World(Box(800, 200), rng=1)
    places = [(-100.0, 20.0 * k) for k in range(loads)]
    robots = world.add(Robot, loads, policy=_right, position=places, heading=(1.0, 0.0), speed=2.0, name="robots")
    things = world.add(Attractor, loads, policy="stationary", speed=0.0, position=places, name="attractors")
    home = world.add(Home, 1, policy="stationary", position=home_at, speed=0.0, name="home")
    world.interact(Carrying(reach=3.0), robots=robots, attractors=things, home=home)
    return world


def consumed(robots: int = 1, rate: float = 0.125) -> Any:
    world = World(Box(80, 80), rng=1)
    team = world.add(Robot, robots, policy=_right, position=(1.0, 1.0), heading=(1.0, 0.0), speed=0.5, name="robots")
    meal = world.add(Target, 1, policy="stationary", position=(1.0, 1.0), name="attractors")
    world.interact(Consuming(rate=rate), robots=team, attractors=meal)
    return world


def _steps(world: Any, count: int) -> None:
    for _ in range(count):
        world.step()


def test_an_attractor_that_leaves_lets_its_robot_go_and_no_other() -> None:
    world = carried()
    robots, things, _ = world.groups
    _steps(world, 2)
    kept = [things[1], things[2]]
    things[0].remove()
    _steps(world, 3)
    assert robots.attached.tolist() == [0, 1, 1]
    assert robots[0].speed == 2.0
    for robot, thing in zip(robots[1:], kept, strict=True):
        assert robot.attractor == thing.unique_id
        assert (robot.position == thing.position).all()
    assert things.robots_at_it.tolist() == [1, 1]


def test_a_robot_that_leaves_frees_its_attractor_and_no_other() -> None:
    world = carried()
    robots, things, _ = world.groups
    _steps(world, 2)
    place = things[0].position.copy()
    robots[0].remove()
    _steps(world, 3)
    assert (things[0].position == place).all()
    assert things.robots_at_it.tolist() == [0, 1, 1]
    assert (robots.bodies.position == things.bodies.position[1:]).all()


@pytest.mark.parametrize("who", ["robot", "attractor"])
def test_an_inactive_partner_lets_go(who: str) -> None:
    world = carried()
    robots, things, _ = world.groups
    _steps(world, 2)
    place = things[0].position.copy()
    (robots if who == "robot" else things)[0].active = False
    _steps(world, 3)
    assert robots.attached.tolist() == [0, 1, 1]
    assert robots[0].speed == 2.0
    assert (things[0].position == place).all()
    assert things.robots_at_it.tolist() == [0, 1, 1]


def test_new_attractors_and_robots_change_nobody() -> None:
    world = carried()
    robots, things, _ = world.groups
    _steps(world, 2)
    held = robots.attractor.tolist()
    things.add(1, position=(0.0, -90.0))
    robots.add(1, position=(300.0, -90.0), heading=(1.0, 0.0), speed=1.0)
    _steps(world, 2)
    assert robots.attractor.tolist() == [*held, 0]


def test_a_carried_attractor_survives_a_state_that_is_restored_elsewhere() -> None:
    world, other = carried(), carried()
    for one in (world, other):
        one.groups[1][0].remove()
    _steps(world, 3)
    saved = world.state()
    _steps(world, 5)
    other.restore(saved)
    _steps(other, 5)
    assert other.groups[1].bodies.position.tolist() == world.groups[1].bodies.position.tolist()
    assert other.groups[0].attached.tolist() == [0, 1, 1]


@pytest.mark.parametrize("how", ["one", "all", "adjust"])
def test_a_speed_that_is_set_while_carrying_is_that_without_a_load(how: str) -> None:
    world = carried(home_at=(-60.0, 0.0))
    robots, things, _ = world.groups
    _steps(world, 2)
    if how == "one":
        robots[0].speed = 4.0
    elif how == "all":
        robots.speed = 4.0
    else:
        world.adjust(robots, speed=4.0)
    _steps(world, 1)
    assert robots[0].speed == pytest.approx(4.0 / (1.0 + 5.0 / 5.0))
    while robots[0].attached:
        world.step()
    assert robots[0].speed == 4.0
    assert things.mass[0] == 0.0


def test_a_robot_that_consumes_stays_whatever_speed_it_is_given() -> None:
    world = consumed()
    robots = world.groups[0]
    _steps(world, 2)
    place = robots[0].position.copy()
    robots[0].speed = 3.0
    _steps(world, 3)
    assert (robots[0].position == place).all()
    assert robots[0].speed == 0.0
    while robots[0].attached:
        world.step()
    assert robots[0].speed == 3.0


def test_new_robots_do_not_get_the_speed_of_carriers() -> None:
    world = carried(loads=1)
    robots = world.groups[0]
    _steps(world, 2)
    with pytest.raises(ValueError, match=r"speed: .*'robots'.*an interaction.*add\(…, speed=2\)"):
        robots.add(1)
    assert robots.add(1, speed=2.0)[0].speed == 2.0


def test_robots_that_arrive_while_all_carry_have_the_speed_of_the_others_without_a_load() -> None:
    world = carried(loads=1)
    robots = world.groups[0]
    world.attach(Arrivals(Times([3.0]), position=(0.0, -90.0)), robots)
    _steps(world, 5)
    assert robots.speed.tolist() == [1.0, 2.0]


def test_robots_cannot_carry_and_consume() -> None:
    world = carried()
    robots, things, _ = world.groups
    meals = world.add(Target, 1, policy="stationary", name="meals")
    for others in (things, meals):
        with pytest.raises(ValueError, match=r"Consuming.columns: 'attached' of robots is kept by Carrying; give"):
            world.interact(Consuming(), robots=robots, attractors=others)
    team = world.add(Robot, 1, policy="stationary", name="team")
    with pytest.raises(ValueError, match=r"'mass' of attractors is kept by Carrying"):
        world.interact(Consuming(), robots=team, attractors=things)
    assert len(world.interactions) == 1
    assert "attached" not in team.columns
    world.interact(Consuming(), robots=team, attractors=meals)
    world.run(2)


CALLS = ("run", "lose", "come", "leave", "off", "on", "faster", "save", "restore", "reset")


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 9999), calls=st.lists(st.sampled_from(CALLS), max_size=20), kind=st.sampled_from([0, 1]))
def test_any_order_of_calls_gives_one_result_on_both_paths(seed: int, calls: list[str], kind: int) -> None:
    made = (Forage, Consume)[kind]
    worlds: list[Any] = [made(4, attractors=5, side=22.0, obstacles=0.05, speed=1.0, rng=seed) for _ in range(2)]
    saved = [world.state() for world in worlds]
    for call in ["run", *calls, "run"]:
        for number, world in enumerate(worlds):
            robots, things = world.robots, world.attractors
            if call == "run":
                world.run(15) if number else _steps(world, 15)
            elif call in ("lose", "leave"):
                group = things if call == "lose" else robots
                if len(group) > 1:
                    group[0].remove()
            elif call == "come":
                robots.add(1, speed=1.0)
                things.add(1)
            elif call in ("off", "on"):
                robots[-1].active = things[-1].active = call == "on"
            elif call == "faster":
                robots[0].speed = 2.0
            elif call == "save":
                saved[number] = world.state()
            elif call == "restore":
                world.restore(saved[number])
            else:
                world.reset(seed + 1)
        assert fingerprint(worlds[0]) == fingerprint(worlds[1])
        held = worlds[0].robots.attractor.tolist()
        assert call != "run" or set(held) <= {0, *worlds[0].attractors.bodies.identity.tolist()}
