"""Box pushing as a task, and its world."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from teamsight.policies.braitenberg import FixedPriority
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.tasks import TASKS
from teamsight.tasks.model import TaskModel
from teamsight.tasks.pushing import BoxPushing, completion_time


def test_a_team_moves_the_box_and_is_measured() -> None:
    task = TASKS["push"]
    # The distance is short, so that any six robots that find the box cover it.
    world: Any = task.build("skilled", rng=3, robots=6, side=20.0, distance=0.5)
    world.run(1500, progress=False)
    history, found = world.recording.history, task.measure(world)
    moved = history["box_moved"].cumsum()
    time = int(found["completion_time"])
    assert moved.iloc[time - 1] >= 0.5 > (moved.iloc[time - 2] if time > 1 else 0.0)
    assert found["box_moved"] == pytest.approx(moved.iloc[-1])
    assert found["together"] == (history["pushing"] >= 2).mean()
    assert found["stagnation"] == ((history["pushing"] >= 2) & (history["box_moved"] == 0)).mean()


def test_a_box_that_is_not_moved_takes_for_ever() -> None:
    world = BoxPushing(1, rng=1)
    world.run(400, progress=False)
    assert world.recording.history["pushing"].sum() > 0
    assert TASKS["push"].measure(world) == {
        "completion_time": math.inf, "box_moved": 0.0, "together": 0.0, "stagnation": 0.0,
    }  # fmt: skip
    assert completion_time(world) == math.inf


def test_rng_and_seed_are_two_names_of_the_seed() -> None:
    one, other = BoxPushing(3, seed=5), BoxPushing(3, rng=5)
    assert np.array_equal(one.robots.bodies.position, other.robots.bodies.position)


def test_the_world_fits_its_robots_to_their_size() -> None:
    world = BoxPushing(2, robot_radius=1.0, box_radius=3.0, recovery=False, rng=1)
    policy: Any = world.robots.policy
    assert isinstance(policy, FixedPriority)
    assert (policy.obstacle_range, policy.contact, policy.recovery) == (3.0, pytest.approx(4.1), False)
    assert world.interactions[0].robot_radius == 1.0
    assert np.array_equal(world.box.bodies.position, [[0.0, 0.0]])


def test_recovery_is_for_fixed_priority_which_recovers_unless_it_is_refused() -> None:
    given = [BoxPushing(2, rng=1, **options) for options in ({}, {"recovery": True}, {"recovery": False})]
    assert [world.robots.policy.recovery for world in given] == [True, True, False]
    # A setting may replace the policy of the skilled team, and its recovery.
    model = TaskModel(TASKS["push"])
    assert isinstance(model(policy="random-walk", rng=1).robots.policy, RandomWalk)
    assert [model(recovery=recovers, rng=1).robots.policy.recovery for recovers in (True, False)] == [True, False]


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"distance": 0.0}, ValueError, r"distance=0.*above 0"),
        ({"recovery": "yes"}, TypeError, r"recovery='yes': must be True or False"),
        ({"threshold": 2.5}, ValueError, r"threshold=2\.5: must be below 2"),
        ({"side": 5.0}, ValueError, r"side=5: must be above 6"),
        ({"robots": 0}, ValueError, r"robots=0: must be at least 1"),
        ({"robots": "many"}, TypeError, r"robots='many': must be a whole number"),
        ({"robots": 10**8}, ValueError, r"robots=100000000: must be at most 10000000"),
        ({"robots": 200, "side": 10.0}, ValueError, r"robots=200: .*side=10; take at most 46, or a larger side"),
        ({"policy": "fixed-priorty"}, ValueError, r"policy='fixed-priorty': .*'fixed-priority'.*random-walk"),
        ({"policy": "random-walk", "recovery": True}, ValueError, r"recovery=True: is an option of policy='fixed-pri"),
        ({"policy": FixedPriority(), "recovery": False}, ValueError, r"=False: .*FixedPriority\(recovery=False\)"),
    ],
)
def test_bad_values_are_named(options: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        BoxPushing(**options)
