"""What a degree of awareness need not say, and the kernels from which one is made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from teamsight import Disc, Robot, World, check_awareness
from teamsight.agents.awareness import OWN_SECTORS, Awareness, Width, show, teammate_heading
from teamsight.core.kernel import kernel
from teamsight.policies import CompiledPolicy, go


@kernel
def _near(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    shown = 0
    for i in range(len(scene.heading)):
        teammates.start[i] = shown
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            if scene.teammates.distance[k] < parameters[0]:
                shown = show(scene.teammates, k, teammates, shown)
    teammates.start[len(scene.heading)] = shown
    return shown


@dataclass(frozen=True)
class Near(Awareness):
    reach: float = 0.5
    perceive = _near


@kernel
def _headings(scene: Any, parameters: Any, situation: Any) -> None:
    for i in range(len(situation)):
        situation[i, :] = 1.0
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            x, y = teammate_heading(scene, k)
            situation[i, 2 * scene.place[k]], situation[i, 2 * scene.place[k] + 1] = x, y


class Headings(Awareness):
    situate = _headings

    def width(self, team_size: int) -> Width:
        return Width(0, 2 * team_size)


class Nothing(Awareness):
    pass


class Everything(Awareness):
    shows_teammates = True


def test_a_degree_without_declarations_shows_no_teammate() -> None:
    check_awareness(Nothing())
    assert (Nothing.name, Nothing.delivers, Nothing().width(10)) == ("Nothing", ("targets",), (OWN_SECTORS, 0))
    assert len(Nothing().parameters) == 0


def test_what_is_delivered_follows_from_what_is_shown() -> None:
    assert Everything.delivers == Near.delivers == ("targets", "teammates")
    check_awareness(Everything())


def test_fields_of_a_dataclass_are_read_by_the_kernel() -> None:
    check_awareness(Near())
    world = World(Disc(1.0), rng=1)
    robots = world.add(Robot, 20, policy="stationary", awareness=Near(0.3), awareness_range=1.0)
    world.run(1)
    distance = [robot.percept.teammates.distance for robot in robots]
    assert 0 < max(map(max, filter(len, distance))) < 0.3
    for robot, seen in zip(robots, distance, strict=True):
        true = [np.hypot(*(other.position - robot.position)) for other in robots if other is not robot]
        assert sorted(seen) == pytest.approx(sorted(d for d in true if d < 0.3))


def test_headings_of_teammates_in_other_groups_are_known() -> None:
    check_awareness(Headings())
    world = World(Disc(1.0), rng=1)
    groups = [world.add(Robot, n, policy="random-walk", awareness=Headings(), awareness_range=3.0) for n in (2, 3, 1)]
    world.run(3)
    team = [robot for group in groups for robot in group]
    heading = np.concatenate([group.heading for group in groups])
    for own, robot in enumerate(team):
        expected = heading.copy()
        expected[own] = 1.0
        assert robot.situation.tolist() == expected.astype(np.float32).ravel().tolist()


def test_a_situation_of_unknown_width_is_refused_where_it_is_defined() -> None:
    with pytest.raises(TypeError, match=r"Wide: has a kernel situate.*define added.*16, or width\(team_size\)"):

        class Wide(Awareness):
            situate = _headings


@kernel
def _go(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(len(percept.heading)):
        go(action, i, arrays.parameters[0], arrays.parameters[1], 0.5)


@dataclass(frozen=True)
class Go(CompiledPolicy):
    x: float
    y: float
    kernel = _go


@pytest.mark.parametrize("scale", [1.0, 1e-90, 1e90])
def test_directions_of_any_length_become_headings(scale: float) -> None:
    world = World(Disc(5.0), rng=1)
    robots = world.add(Robot, 3, policy=Go(3.0 * scale, 4.0 * scale), speed=1.0, position=(0, 0))
    world.run(2)
    assert robots.heading.ravel() == pytest.approx([0.6, 0.8] * 3)
    assert robots.position.ravel() == pytest.approx([0.6, 0.8] * 3)


@pytest.mark.parametrize("scale", [0.0, 1e-170])
def test_without_a_direction_robots_keep_their_heading(scale: float) -> None:
    world = World(Disc(5.0), rng=1)
    robots = world.add(Robot, 3, policy=Go(scale, 0.0), heading=(0, 1))
    world.run(2)
    assert robots.heading.tolist() == [[0.0, 1.0]] * 3


def test_a_direction_that_is_not_a_number_is_refused() -> None:
    world = World(Disc(5.0), rng=1)
    world.add(Robot, 3, policy=Go(float("nan"), 0.0))
    with pytest.raises(ValueError, match="heading"):
        world.run(2)
