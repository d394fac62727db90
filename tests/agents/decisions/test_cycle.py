"""The values of cycles: their checks, their times, and runs that are too short for them."""

from __future__ import annotations

import math
import pickle
import warnings
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Box, Cycle, Robot, World, run_many
from teamsight.agents.decisions import EVERY_STEP, check_run, cycle_of
from teamsight.world.noise import Stream, key_of, stream_number, uniforms


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"period": 0}, r"period=0: must be at least 1 and at most 1e\+12 ticks; a robot decides at most once"),
        ({"period": -2}, r"period=-2: must be at least 1"),
        ({"period": [3, 0.5]}, r"period=0\.5: must be at least 1"),
        ({"period": math.nan}, r"period=nan: must be a finite number"),
        ({"period": "5"}, r"period='5': must be a number"),
        ({"period": [[1, 2]]}, r"period: has the shape \(1, 2\); give one number"),
        ({"phase": -1}, r"phase=-1: must be at least 0"),
        ({"phase": "late"}, r"phase='late': unknown"),
        ({"period": 5, "jitter": 5}, r"jitter=5: must be below the period, 5.*smaller jitter or a longer period"),
        ({"period": [9, 2], "jitter": 3}, r"jitter=3: must be below the period, 2"),
        ({"jitter": -0.1}, r"jitter=-0\.1: must be at least 0"),
        ({"delay": 1.5}, r"delay=1\.5: must be a whole number"),
        ({"delay": -1}, r"delay=-1: must be at least 0"),
        ({"period": [1, 2], "delay": [1, 2, 3]}, r"has values for 2 and 3 robots; give one value, or one for each"),
    ],
)
def test_bad_values_are_refused_with_the_cure(values: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Cycle(**values)


@pytest.mark.parametrize("value", ["5", [5, 6], None, Cycle, b"5", True])
def test_what_is_no_cycle_is_refused(value: Any) -> None:
    with pytest.raises(TypeError, match=r"cycle="):
        cycle_of(value)


def test_equal_cycles_are_equal_and_can_be_pickled() -> None:
    one, other = Cycle(np.array([2, 3]), jitter=1), Cycle([2.0, 3.0], jitter=1.0)
    assert one == other == pickle.loads(pickle.dumps(one))
    assert hash(one) == hash(other)
    assert repr(one) == "Cycle(period=(2.0, 3.0), jitter=1.0)"
    assert repr(Cycle(7, phase="random", delay=2)) == "Cycle(period=7.0, phase='random', delay=2)"
    assert len({repr(Cycle(np.arange(1, 200) + extra)) for extra in (0, 1)}) == 2
    assert cycle_of(1) == EVERY_STEP == Cycle()


def test_times_are_those_of_the_formula() -> None:
    cycle = Cycle([4, 6.5], phase="random", jitter=[2, 0])
    key, stream = key_of(7), stream_number(Stream.CYCLE, 3)
    found = cycle.times(50, 2, seed=7, group=3, origin=10)
    for member, (period, jitter) in enumerate(((4.0, 2.0), (6.5, 0.0))):
        own = np.array([member])
        phase = period * uniforms(key, stream, 0, own, 2)[1, 0]
        expected = [10 + phase + k * period + jitter * uniforms(key, stream, k, own, 1)[0, 0] for k in range(14)]
        assert found[member] == pytest.approx([time for time in expected if time < 60])
    with pytest.raises(ValueError, match=r"has values for 2 robots; give one value, or 3, one for each agent"):
        cycle.times(5, 3)


def test_a_group_takes_a_value_for_each_of_its_agents() -> None:
    world = World(Box(5, 5), rng=1)
    with pytest.raises(ValueError, match=r"has values for 2 robots; give one value, or 3"):
        world.add(Robot, 3, policy="random-walk", cycle=Cycle([1, 2]))
    assert not world.groups
    robots = world.add(Robot, 3, policy="random-walk", cycle=Cycle([1, 2, 3]))
    assert robots.cycle == Cycle([1, 2, 3])
    with pytest.raises(ValueError, match=r"has values for 2 robots"):
        robots.cycle = Cycle([1, 2])
    with pytest.raises(ValueError, match=r"has values for 3 robots; give one value, or 1"):
        robots[0].cycle = Cycle([1, 2, 3])
    assert robots.cycle == Cycle([1, 2, 3])
    assert robots[2].cycle == Cycle(3)


def test_a_period_longer_than_the_run_is_refused() -> None:
    with pytest.raises(ValueError, match=r"cycle=100: is a period longer than the run of 50 steps.*at most 50 ticks"):
        run_many({"robots": [3], "cycle": [5, 100]}, steps=50, rng=1)
    with pytest.raises(ValueError, match=r"phase=60: is after the last step of the run of 50 steps"):
        check_run(Cycle(5, phase=60), 50)
    check_run(Cycle(50, phase=49), 50)
    table = run_many({"robots": [3], "cycle": [5, Cycle(7, phase="random")]}, steps=50, rng=1, replicates=2)
    alone = CMOMMT(robots=3, cycle=5, rng=int(table.seed[1]))
    alone.run(50)
    assert table.observed_fraction[1] == alone.observed_fraction


def test_a_group_that_does_not_decide_is_warned_of_once() -> None:
    world = CMOMMT(robots=3, cycle=Cycle(5, phase=30), rng=1)
    with pytest.warns(UserWarning, match=r"none of robots decides before tick 10.*at tick 30.*robots\.cycle = Cycle\(5\)"):
        world.run(10)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        world.run(10)
        world.run(10)
        world.run(10)
    assert (world.robots.decided_at == 35).all()
