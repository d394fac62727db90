"""Refused assignments and selections: the error names the cure, and nothing is changed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, World


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("spede", 3, r"spede=3: a group has no such attribute; did you mean 'speed'\? .*add_column\('spede'"),
        ("team", "rivals", r"team='rivals': cannot be set; give the team when a group is added"),
        ("sensors", {}, r"sensors=\{\}: cannot be set; .*robots\.sensors\['targets'\] = Sensor"),
        ("position", (0, 0), r"cannot be set; to move an agent, set its own position"),
        ("heading", (0, 1), r"cannot be set; to turn an agent"),
        ("identity", 3, r"identity=3: cannot be set"),
        ("agents", [], r"cannot be set; robots\.add\(1\) adds one"),
        ("rules", (), r"cannot be set; set the policy or the degree, as in robots\.policy"),
        ("others", [], r"cannot be set; set that of one robot, as in robots\[0\]\.policy"),
        ("timetable", None, r"cannot be set; set the cycle, as in robots\.cycle"),
    ],
)
def test_a_group_refuses_with_the_cure(name: str, value: Any, message: str) -> None:
    robots = CMOMMT(rng=1).robots
    before = vars(robots).copy()
    with pytest.raises(AttributeError, match=message):
        setattr(robots, name, value)
    assert vars(robots) == before


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("seed_used", r"reset\(rng\)"), ("robots", r"model\.robots\.add\(5\)"), ("groups", r"add\(\) adds one"),
        ("interactions", r"interact\(\) adds one"),
    ],
)  # fmt: skip
def test_a_world_refuses_with_the_cure(name: str, message: str) -> None:
    model = CMOMMT(rng=1)
    with pytest.raises(AttributeError, match=f"{name}=3: cannot be set; .*{message}"):
        setattr(model, name, 3)


def test_what_a_world_holds_cannot_be_changed_through_what_it_shows() -> None:
    world = World(Disc(5.0), rng=1)
    hunters, prey = (world.add(Robot, 2, policy="centroid", name=name) for name in ("hunters", "prey"))
    for shown in (world.groups, world.interactions, hunters.agents, hunters.others):
        assert isinstance(shown, tuple)
    assert (world.groups, hunters.agents) == ((hunters, prey), (hunters[0], hunters[1]))


@pytest.mark.parametrize(("name", "message"), [("identity", "another name"), ("group", "add an agent to the other group")])
def test_an_agent_keeps_its_identity_and_its_group(name: str, message: str) -> None:
    model = CMOMMT(rng=1)
    robot = model.robots[3]
    with pytest.raises(AttributeError, match=f"{name}=None: cannot be set; .*{message}"):
        setattr(robot, name, None)
    assert robot.group is model.robots
    assert robot.identity == robot.unique_id == model.robots.identity[3]


class Named(Robot):
    """A robot with an attribute that would hide a method."""

    def __init__(self, model: Any, sensed: int) -> None:
        super().__init__(model)
        self.sensed = sensed  # type: ignore[assignment, method-assign]


def test_an_attribute_that_hides_a_method_is_refused() -> None:
    world = World(Disc(5.0), rng=1)
    with pytest.raises(TypeError, match=r"Named\.__init__ sets sensed, a method of all agents; take another name"):
        world.add(Named, 2, policy="centroid", sensed=3)
    assert world.groups == ()
    assert len(world.agents) == 0


def test_a_turning_limit_in_degrees_is_refused() -> None:
    robots = CMOMMT(rng=1).robots
    for holder in (robots, robots[0]):
        with pytest.raises(ValueError, match=r"turn_limit=90: .* 2π \[rad\]; for degrees use math\.radians\(90\)"):
            holder.turn_limit = 90
    robots.turn_limit = math.tau
    assert robots.turn_limit.tolist() == pytest.approx([math.pi] * 10)


def test_a_column_says_what_it_takes() -> None:
    robots = CMOMMT(rng=1).robots
    robots.add_column("battery", 1.0)
    robots.add_column("goal", np.zeros((10, 2)))
    with pytest.raises(ValueError, match=r"battery=\[1, 2\]: must be one value, or of the shape \(10,\); .*'robots' has 10"):
        robots.battery = [1, 2]  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match=r"goal=\[1, 2, 3\]: must be one value, or of the shape \(2,\)"):
        robots[0].goal = [1, 2, 3]  # type: ignore[attr-defined]
    assert set(robots.columns["battery"]) == {1.0}


def test_agents_are_selected_by_rows_and_by_masks() -> None:
    robots = CMOMMT(robots=4, rng=1).robots
    robots.add_column("battery", [1.0, 0.0, 2.0, 0.0])
    one, two, three, four = robots
    assert robots[[3, 0, -1]] == [four, one, four]
    assert robots[np.array([1])] == [two]
    assert robots[np.int64(2)] is three
    assert robots[robots.columns["battery"] > 0] == [one, three]
    assert robots[[]] == []
    for wrong, message in (([4], r"robots\[4\]: the group has 4 agents"), ([True], r"the mask has 1 elements; give 4")):
        with pytest.raises(IndexError, match=message):
            robots[wrong]
    for other in ("a", 1.5, [0.5], [[0, 1]]):
        with pytest.raises(TypeError, match="give a row, a slice, a list of rows, or a mask"):
            robots[other]  # type: ignore[call-overload]
