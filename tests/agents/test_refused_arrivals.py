"""Arrivals that are refused or fail: nobody has come, and nothing else has changed."""

from __future__ import annotations

from typing import Any

import pytest

from teamsight import Disc, Robot, Target, World

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one", "ignore:no group senses another")


def bits(world: World) -> list[Any]:
    """Return all that must be equal to the last bit."""
    return [(group.position.tobytes(), group.heading.tobytes(), group.identity.tolist()) for group in world.groups]


class Late(Robot):
    """Adds one more when it decides."""

    def decide(self, percept: Any, rng: Any) -> tuple[float, float]:
        self.group.add()
        return 0.0, 0.0


def test_nobody_comes_while_a_group_decides() -> None:
    world = World(Disc(2.0), rng=1)
    robots = world.add(Late, 2)
    with pytest.raises(RuntimeError, match=r"add\(\): called in decide.*world.clock.at\(world.clock.now"):
        world.step()
    assert (len(robots), world.tick) == (2, 0)


class Selfish(Robot):
    """Changes its own group while it is made."""

    def __init__(self, model: World, deed: str) -> None:
        super().__init__(model)
        if deed == "add":
            self.group.add(1, deed="none")
        elif deed == "remove":
            self.remove()
        elif deed == "run":
            model.run(1)


@pytest.mark.parametrize("deed", ["add", "remove", "run"])
def test_a_group_is_not_changed_while_its_agents_are_made(deed: str) -> None:
    world = World(Disc(2.0), rng=1)
    robots = world.add(Selfish, 2, policy="random-walk", deed="none")
    world.run(1)
    for add in (lambda: robots.add(2, deed=deed), lambda: world.add(Selfish, 2, policy="random-walk", deed=deed)):
        with pytest.raises(RuntimeError, match=rf"{deed}\(\): called in Selfish.__init__"):
            add()
        assert (len(robots), len(world.agents), len(world.groups)) == (2, 2, 1)
    world.run(1)


class Meddling(Robot):
    """Changes other groups while it is made, and then fails."""

    def __init__(self, model: World, others: Any) -> None:
        super().__init__(model)
        others.add(2)
        others[0].remove()
        others.add_column("mark", 1)
        model.add(Target, 2, policy="random-walk")
        raise RuntimeError("no")


def test_what_init_did_to_other_groups_is_undone_if_it_fails() -> None:
    worlds = [World(Disc(2.0), rng=1) for _ in range(2)]
    for world in worlds:
        robots = world.add(Robot, 3, policy="a-cmommt")
        world.run(3)
    tried = worlds[0]
    first = tried.groups[0][0]
    for _ in range(2):
        with pytest.raises(RuntimeError, match="no"):
            tried.add(Meddling, 2, policy="random-walk", others=tried.groups[0])
    assert [robot.row for robot in tried.groups[0]] == [0, 1, 2]
    assert first in tried.agents
    assert not tried.groups[0].columns
    for world in worlds:
        world.run(3)
        world.groups[0].add()
        world.run(3)
    assert bits(worlds[0]) == bits(worlds[1])
    assert worlds[0].groups[0].identity.tolist() == worlds[1].groups[0].identity.tolist()
    assert len(robots) == 4


@pytest.mark.parametrize(("limits", "least"), [([0.5, 1.0], "0.5"), ([1.0, 6.0], "1")])
def test_different_turning_limits_are_named_as_they_were_given(limits: list[float], least: str) -> None:
    robots = World(Disc(2.0), rng=1).add(Robot, 2, policy="random-walk", turn_limit=limits)
    with pytest.raises(ValueError, match=rf"turn_limit: .* from {least} to .*add\(…, turn_limit={least}\)") as error:
        robots.add(1)
    # The cure is one.
    robots.add(1, turn_limit=float(str(error.value).split("=")[-1].rstrip(")")))
    assert robots.turn_limit[2] == limits[0]
