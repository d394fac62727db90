"""What can be charted of a world follows from it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mesa import DataCollector

from teamsight import CMOMMT, Disc, Failures, Robot, World
from teamsight.live.measures import Measures


class Counted(World):
    """A world with properties of several kinds."""

    @property
    def cost(self) -> float:
        return 2.5 * self.tick

    @property
    def name(self) -> str:
        return "no number"

    @property
    def is_late(self) -> bool:
        return self.tick > 1


def test_they_follow_from_the_world_its_groups_its_events_and_its_reporters() -> None:
    world = Counted(Disc(3.0), rng=1)
    robots = world.add(Robot, 4, policy="random-walk")
    robots.add_column("battery", 1.0)
    robots.add_column("place", [[0.0, 1.0]] * 4)
    world.datacollector = DataCollector(model_reporters={"twice": lambda one: 2 * one.tick, "also": "tick"})
    measures = Measures(world)
    new = ["cost", "is late", "robots active", "robots battery, mean", "twice", "also"]
    assert [*measures.all()] == ["observed so far", "mean neighbours so far", "max neighbours so far", *new]
    world.run(3)
    robots[0].battery, robots[1].active = 0.0, False
    assert measures.read(new) == [7.5, 1.0, 3.0, 0.75, 6.0, 3.0]
    assert math.isnan(*measures.read(["nothing"]))
    for robot in list(robots):
        robot.remove()
    assert math.isnan(*measures.read(["robots battery, mean"]))


def test_events_are_counted_by_kind_also_after_a_reset() -> None:
    model = CMOMMT(robots=20, events=Failures(20.0, 10.0), seed=1)
    measures = Measures(model)
    assert measures.read(["events failed"]) == [0.0]
    model.run(50)
    for _ in range(2):
        kinds = model.events["what"].value_counts()
        assert len(kinds) == 2
        assert {kind: measures.read([f"events {kind}"])[0] for kind in kinds.index} == kinds.to_dict()
        model.reset(2)
        model.run(30)


def test_what_raises_or_is_no_number_has_no_value() -> None:
    world = Counted(Disc(3.0), rng=1)
    world.add(Robot, 1, policy="random-walk")
    seats = [1]
    world.datacollector = DataCollector(model_reporters={"text": lambda one: "much", "fails": lambda one: 1 / len(seats)})
    measures = Measures(world)
    assert measures.read(["fails"]) == [1.0]
    seats.clear()
    assert np.isnan(measures.read(["text", "fails"])).all()
    with pytest.raises(ZeroDivisionError):
        measures.all()["fails"]()
