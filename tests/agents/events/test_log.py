"""The event log: who did what when, in order, with the same rows on both paths."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, EventSource, Robot


def made() -> CMOMMT:
    """Return a world in which agents come, leave, stop and are painted."""
    world = CMOMMT(robots=5, targets=4, rng=1)
    world.clock.at(2.5, lambda: world.log("painted", world.robots[1], colour="red", coats=2))
    world.clock.at(2.75, lambda: world.log("fog"))
    world.clock.at(4, world.targets[0].remove)
    world.clock.at(6, lambda: world.robots.add(2))
    world.clock.at(7, lambda: setattr(world.robots[2], "active", False))
    world.clock.at(8.25, lambda: setattr(world.robots[2], "active", True))
    world.clock.at(9, lambda: world.add(Robot, 1, policy="stationary", name="late"))
    return world


@pytest.mark.short
@pytest.mark.parametrize("path", ["run", "step", "mixed"])
def test_the_log_says_who_did_what_when(path: str) -> None:
    world = made()
    world.step() if path == "mixed" else None
    world.run(12 - world.tick) if path != "step" else [world.step() for _ in range(12)]
    log = world.events
    assert log.columns.tolist() == ["time", "tick", "what", "group", "agent", "source", "colour", "coats"]
    numbers = log.agent
    rows = [*zip(log.time, log.tick, log.what, log.group.fillna(""), strict=True)]
    assert rows == [
        (2.5, 3, "painted", "robots"), (2.75, 3, "fog", ""), (4.0, 4, "left", "targets"), (6.0, 6, "joined", "robots"),
        (6.0, 6, "joined", "robots"), (7.0, 7, "inactive", "robots"), (8.25, 9, "active", "robots"),
        (9.0, 9, "joined", "late"),
    ]  # fmt: skip
    assert numbers[0] == world.robots[1].unique_id
    assert numbers[[3, 4]].tolist() == [robot.unique_id for robot in world.robots[5:]]
    assert pd.isna(numbers[1])
    assert (log.colour[0], log.coats[0]) == ("red", 2)
    assert log.colour[1:].isna().all()
    assert log.source.isna().all()


def test_a_log_survives_parquet(tmp_path: Path) -> None:
    world = made()
    world.log("measured", value=0.25, good=True, count=3, nothing=None)
    world.log("measured", value=1, good=False)
    world.run(12)
    world.events.to_parquet(tmp_path / "events.parquet")
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "events.parquet"), world.events)
    assert world.events.dtypes.astype(str)[["time", "tick", "agent", "value", "good", "count"]].tolist() == [
        "float64", "int64", "Int64", "float64", "boolean", "Int64",
    ]  # fmt: skip


def test_an_empty_log_has_its_columns(tmp_path: Path) -> None:
    log = CMOMMT(rng=1).events
    assert log.columns.tolist() == ["time", "tick", "what", "group", "agent", "source"]
    log.to_parquet(tmp_path / "events.parquet")
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "events.parquet"), log)


def test_how_a_world_is_made_is_not_logged_and_a_reset_empties_the_log() -> None:
    world = CMOMMT(robots=5, rng=1)
    world.robots.add(2)
    world.robots[0].remove()
    world.robots[0].active = False
    assert len(world.events) == 0
    world.log("set up")
    assert len(world.events) == 1
    world.step()
    world.robots[1].remove()
    assert world.events.what.tolist() == ["set up", "left"]
    world.reset()
    assert len(world.events) == 0


def test_a_robot_that_switches_its_policy_is_logged() -> None:
    world = CMOMMT(rng=1)
    world.clock.at(3.5, lambda: setattr(world.robots[2], "policy", "random-walk"))
    world.run(5)
    assert world.events[["time", "what", "policy"]].to_dict("records") == [
        {"time": 3.5, "what": "switched policy", "policy": "'random-walk'"}
    ]


def test_what_a_source_changes_is_logged_by_the_source_alone_and_its_arrivals_bear_its_name() -> None:
    class Shift(EventSource):
        def begin(self) -> None:
            self.plan(2, "change")

        def change(self) -> None:
            self.log("off duty", self.agent(0))
            self.agent(0).active = False
            self.agent(1).policy = "random-walk"
            self.group.add(1)  # type: ignore[union-attr]

        def end(self) -> None:
            self.agent(0).active = True

    world = CMOMMT(rng=1)
    shift = world.attach(Shift(), world.robots)
    world.run(5)
    world.detach(shift)
    world.robots[0].active = False
    log = world.events
    assert [*zip(log.what, log.source.fillna(""), strict=True)] == [
        ("off duty", "Shift"), ("joined", "Shift"), ("inactive", ""),
    ]  # fmt: skip


def test_setting_the_condition_that_it_has_is_no_event() -> None:
    world = CMOMMT(rng=1)
    world.run(2)
    world.robots[0].active = True
    assert len(world.events) == 0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.log(""), r"log\(''\): must be a text that says what happened"),
        (lambda w: w.log(3), r"log\(3\): must be a text"),
        (lambda w: w.log("seen", 3), r"log\('seen', 3\): must be an agent of the world, or None"),
        (lambda w: w.log("seen", time=3), r"log\('seen', time=…\): the log has a column of this name"),
        (lambda w: w.log("seen", at=[1, 2]), r"log\('seen', at=\[1, 2\]\): must be a number, a text, True, False or None; give"),
        (lambda w: setattr(w, "events", None), r"events=None|events"),
        (lambda w: setattr(w, "sources", ()), r"sources"),
    ],
)
def test_what_is_no_event_is_refused_and_changes_nothing(call: Any, message: str) -> None:
    world = CMOMMT(rng=1)
    with pytest.raises((TypeError, ValueError, AttributeError), match=message):
        call(world)
    assert len(world.events) == 0


def test_a_source_logs_under_its_name() -> None:
    class Fog(EventSource):
        needs_group = False

        def begin(self) -> None:
            self.plan(3.5, "come", 0.5)

        def come(self, density: float) -> None:
            self.log("fog", density=density)

    world = CMOMMT(rng=1)
    world.attach(Fog())
    world.run(5)
    assert world.events[["time", "what", "source", "density"]].to_dict("records") == [
        {"time": 3.5, "what": "fog", "source": "Fog", "density": 0.5}
    ]
    assert np.array_equal(world.events.index, [0])
