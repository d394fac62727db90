"""Worlds with sources that are reused for many runs, or reset, begin them as new worlds do."""

from __future__ import annotations

from typing import Any

import pytest

from teamsight import CMOMMT
from teamsight.agents.components import Arrivals, Batteries, Failures, SensorDropouts
from teamsight.agents.reused_worlds import ReusedWorlds

SOURCES: dict[str, Any] = {
    "failures": Failures(30, 10),
    "dropouts": SensorDropouts(30, 10),
    "batteries": Batteries(2.0),
    "arrivals": Arrivals(10, stay=20),
    "several": [Failures(20, 5), Arrivals(15), Batteries(3.0)],
}


def result(world: CMOMMT) -> tuple[Any, ...]:
    world.run(60)
    return world.events.to_json(), world.robots.position.tobytes(), repr(world.observed_fraction), len(world.robots)


@pytest.mark.short
@pytest.mark.parametrize("name", SOURCES)
def test_each_run_in_reused_worlds_is_that_of_a_new_one(name: str) -> None:
    reused = ReusedWorlds()
    plan = [{"events": SOURCES[name], "robot_speed": speed} for speed in (0.1, 0.1, 0.2)]
    for seed, parameters in enumerate(plan):
        world = reused.begin(CMOMMT, parameters, seed)
        assert isinstance(world, CMOMMT)
        new = CMOMMT(**parameters, rng=seed)
        assert result(world) == result(new)
        assert len(new.events) > 0
    reused.close()


@pytest.mark.parametrize("name", SOURCES)
def test_a_reset_world_is_a_new_one(name: str) -> None:
    world = CMOMMT(events=SOURCES[name], rng=1)
    result(world)
    world.reset(5)
    assert result(world) == result(CMOMMT(events=SOURCES[name], rng=5))
