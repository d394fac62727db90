"""Columns: they stay valid whatever happens to their group, and are attributes of its agents."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight import CMOMMT, Disc, Robot, World
from teamsight.agents.attributes import Column


def five() -> tuple[CMOMMT, Column]:
    model = CMOMMT(robots=5, targets=2, rng=1)
    return model, model.robots.add_column("battery", [1.0, 2.0, 3.0, 4.0, 5.0])


@pytest.mark.short
def test_a_column_stays_valid_when_a_state_is_restored() -> None:
    model, battery = five()
    saved = model.state()
    battery[:] = 0.0
    model.restore(saved)
    assert battery.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    battery[2] = 9.0
    assert model.robots.columns["battery"].tolist() == [1.0, 2.0, 9.0, 4.0, 5.0]
    assert model.robots[2].battery == 9.0


@pytest.mark.short
def test_a_column_stays_valid_when_agents_leave() -> None:
    model, battery = five()
    model.robots[1].remove()
    assert battery.tolist() == [1.0, 3.0, 4.0, 5.0]
    battery[1] = 30.0
    battery += 1
    assert model.robots.columns["battery"].tolist() == [2.0, 31.0, 5.0, 6.0]
    assert [robot.battery for robot in model.robots] == [2.0, 31.0, 5.0, 6.0]
    model.reset(5)
    assert battery.tolist() == [2.0, 31.0, 5.0, 6.0]


@given(st.lists(st.sampled_from(["remove", "save", "restore", "write", "attribute", "run", "add"]), max_size=25), st.randoms())
def test_a_column_is_that_of_its_agents_whatever_happens(deeds: list[str], random: Any) -> None:
    model, battery = five()
    expected = {robot.unique_id: value for robot, value in zip(model.robots, [1.0, 2.0, 3.0, 4.0, 5.0], strict=True)}
    saved, then = model.state(), dict(expected)
    for number, deed in enumerate(deeds):
        robots = list(model.robots)
        if deed == "remove" and len(robots) > 1:
            gone = random.choice(robots)
            expected.pop(gone.unique_id)
            gone.remove()
            saved, then = model.state(), dict(expected)
        elif deed == "save":
            saved, then = model.state(), dict(expected)
        elif deed == "restore":
            model.restore(saved)
            expected = dict(then)
        elif deed == "write":
            row = random.randrange(len(robots))
            battery[row] = expected[robots[row].unique_id] = float(number)
        elif deed == "attribute":
            robot = random.choice(robots)
            robot.battery += 0.5
            expected[robot.unique_id] += 0.5
        elif deed == "run":
            model.run(2)
        elif deed == "add":
            model.add(Robot, 1, policy="random-walk")
            saved, then = model.state(), dict(expected)
        assert battery.tolist() == [robot.battery for robot in model.robots] == list(expected.values())


def test_it_is_used_like_an_array() -> None:
    model, battery = five()
    assert battery.shape == (5,)
    assert battery.dtype == float
    assert len(battery) == 5
    assert (battery > 2.5).tolist() == [False, False, True, True, True]
    assert (2 * battery - battery).tolist() == battery.tolist()
    assert np.mean(battery) == battery.mean() == 3.0
    assert np.asarray(battery).sum() == sum(battery) == 15.0
    assert np.where(battery > 4, 1, 0).tolist() == [0, 0, 0, 0, 1]
    battery[battery > 4] = 0.0
    model.robots.columns["battery"] *= 2
    model.robots.columns["battery"] = battery + 1
    assert battery.tolist() == [3.0, 5.0, 7.0, 9.0, 1.0]
    assert "battery" in repr(battery)
    assert pickle.loads(pickle.dumps(battery)).tolist() == copy.deepcopy(battery).tolist() == battery.tolist()
    with pytest.raises(ValueError, match="ambiguous"):
        bool(battery)
    with pytest.raises(AttributeError):
        _ = battery.no_such_thing


def test_columns_of_several_numbers() -> None:
    model, _ = five()
    goal = model.robots.add_column("goal", np.zeros((5, 2)))
    model.robots[1].goal = (1.0, 2.0)
    model.robots[1].goal += 1.0
    assert goal[1].tolist() == [2.0, 3.0]
    with pytest.raises(ValueError, match="read-only"):
        model.robots[1].goal[0] = 5.0


def test_names_that_agents_have_are_refused() -> None:
    model, _ = five()
    model.robots[0].mood = "well"
    for name in ("battery", "speed", "position", "decide", "unique_id", "mood", "group"):
        with pytest.raises(ValueError, match=f"name='{name}'.*take another name"):
            model.robots.add_column(name)
    for name in ("", 3, None):
        with pytest.raises(TypeError, match="must be a string"):
            model.robots.add_column(name)  # type: ignore[arg-type]


def test_names_that_agents_have_are_refused_in_an_empty_group_too() -> None:
    class Ours(Robot):
        pass

    robots = World(Disc(2.0), rng=1).add(Ours, 1, policy="random-walk", speed=0.1)
    robots[0].remove()
    # It would take the place of the property of all robots of the class.
    with pytest.raises(ValueError, match="name='speed'.*take another name"):
        robots.add_column("speed")


def test_an_element_that_would_be_rounded_or_cut_off_is_refused() -> None:
    model, _ = five()
    model.robots.add_column("count", 0)
    name = model.robots.add_column("nickname", "a")
    with pytest.raises(TypeError, match=r"count=0\.5: the column has the type int64.*add_column\('count', 0\.0\)"):
        model.robots[0].count = 0.5
    model.robots[0].count = 7
    model.robots[1].nickname = "a long name"
    assert name.tolist() == ["a", "a long name", "a", "a", "a"]
    assert model.robots.columns["count"].tolist() == [7, 0, 0, 0, 0]


def test_a_column_that_is_not_there_is_named() -> None:
    model, _ = five()
    with pytest.raises(KeyError, match="no such column; it has battery"):
        model.robots.columns["charge"]
    with pytest.raises(KeyError, match=r"add_column\('charge'\)"):
        model.robots.columns["charge"] = 1.0
    with pytest.raises(AttributeError, match="battery"):
        _ = CMOMMT(rng=1).robots[0].battery
    with pytest.raises(AttributeError, match="battery"):
        _ = model.targets[0].battery


def test_columns_of_one_world_are_not_those_of_another() -> None:
    model, battery = five()
    other = CMOMMT(robots=5, rng=1)
    other.robots[0].battery = "mine"
    assert other.robots[0].battery == "mine"
    assert battery.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    del other.robots[0].battery
    assert not hasattr(other.robots[0], "battery")
    assert model.agents_by_type[Robot].get("battery") == [1.0, 2.0, 3.0, 4.0, 5.0]
    model.agents_by_type[Robot].set("battery", 0.25)
    assert battery.tolist() == [0.25] * 5


def test_a_column_that_is_newer_than_a_state_survives_its_restoring() -> None:
    model, _ = five()
    saved = model.state()
    charge = model.robots.add_column("charge", 3.0)
    model.restore(saved)
    assert charge.tolist() == [3.0] * 5


def test_a_column_is_an_attribute_of_its_group() -> None:
    model, battery = five()
    model.robots.battery = 0.5
    assert battery.tolist() == model.robots.battery.tolist() == [0.5] * 5
    model.robots.battery -= 0.25
    assert battery.tolist() == [0.25] * 5
    with pytest.raises(AttributeError, match=r"add_column\('battery'\)"):
        model.targets.battery = 1.0
    assert not hasattr(model.targets, "battery")
    # What groups have for themselves stays theirs.
    model.robots.add_column("memory", 1.0)
    assert type(model.robots.policy_state).__name__ == "PolicyState"
    assert model.robots.columns["memory"].tolist() == [1.0] * 5
    model.run(2)


def test_policies_read_columns_that_come_and_go_in_a_run() -> None:
    read: list[float | None] = []

    def walk(percept: Any, rng: Any) -> tuple[float, float]:
        column = getattr(percept.columns, "charge", None)
        read.append(None if column is None else float(column[percept.identity]))
        return 0.0, 0.1

    world = World(Disc(5.0), rng=1)
    robots = world.add(Robot, 1, policy=walk)
    for change in (lambda: None, lambda: robots.add_column("charge", 1.0), lambda: robots.columns.pop("charge"), lambda: robots.add_column("charge", 5.0)):
        change()
        world.run(1)
    assert read == [None, 1.0, None, 5.0]
