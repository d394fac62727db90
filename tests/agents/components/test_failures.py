"""Failures and sensor dropouts: who is affected when, on both paths."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from teamsight import Disc, Robot, Target, World
from teamsight.agents.components import Arrivals, Constant, Departures, Failures, SensorDropouts, Times, Weibull
from teamsight.agents.events import EventSource


def make(*sources: EventSource, robots: int = 8, seed: int = 1, policy: str = "a-cmommt") -> World:
    world = World(Disc(3.0), rng=seed)
    team = world.add(Robot, robots, policy=policy, awareness="pairwise")
    world.senses(team, world.add(Target, 6, policy="random-walk", speed=0.075))
    for source in sources:
        world.attach(source, team)
    return world


def times(world: World, what: str, agent: int | None = None) -> list[float]:
    log = world.events
    rows = log["what"] == what
    return log[rows if agent is None else rows & (log["agent"] == agent)]["time"].tolist()


def test_robots_fail_at_listed_times_and_are_repaired() -> None:
    world = make(Failures(Times({0: [3, 10.5], 2: [0]}), Times([2, 4])))
    robots = world.groups[0]
    active = []
    for _ in range(17):
        world.step()
        active.append(robots.active.tolist())
    # Inactive in steps 4 and 5, and, from the first tick after 10.5, in 11 to 14.
    assert [tick for tick in range(17) if not active[tick][0]] == [3, 4, 11, 12, 13, 14]
    assert [tick for tick in range(17) if not active[tick][2]] == [0, 1]
    assert all(row[1] for row in active)
    assert times(world, "failed", robots[0].unique_id) == [3.0, 10.5]
    assert times(world, "repaired", robots[0].unique_id) == [5.0, 14.5]
    assert world.events["source"].tolist() == ["Failures"] * 6


def test_a_listed_time_in_a_failure_is_passed_over() -> None:
    world = make(Failures(Times([2, 3, 9]), Constant(4)), robots=1)
    world.run(20)
    assert (times(world, "failed"), times(world, "repaired")) == ([2, 9], [6, 13])


def test_without_a_repair_robots_stay_failed() -> None:
    world = make(Failures(Constant(5)))
    world.run(50)
    assert not world.groups[0].active.any()
    assert len(world.events) == 8
    (failures,) = world.sources
    assert [robot.unique_id for robot in failures.failed] == world.groups[0].identity.tolist()  # type: ignore[attr-defined]


def test_step_and_run_give_one_result() -> None:
    def made() -> World:
        return make(Failures(20, 8), Failures(Weibull(30, 2), 5), SensorDropouts(15, 6), SensorDropouts(9, 4, "targets"))

    one, other, third = made(), made(), made()
    one.run(120)
    for _ in range(120):
        other.step()
    third.run(50)
    third.reset()
    third.run(7)
    third.run(113)
    for world in (other, third):
        assert one.events.equals(world.events)
        for group, same in zip(one.groups, world.groups, strict=True):
            assert group.position.tobytes() == same.position.tobytes()
            assert group.active.tolist() == same.active.tolist()
        assert one.recording.history.equals(world.recording.history)
    assert len(one.events) > 100


@pytest.mark.parametrize("end", [Constant(30), 30, Weibull(40, 1.5)])
def test_exponential_failures_have_the_availability_of_the_formula(end: object) -> None:
    repair = end
    robots, steps, mttf = 250, 1_500, 100.0
    world = World(Disc(100.0), rng=2)
    team = world.add(Robot, robots, policy="stationary")
    failures = world.attach(Failures(mttf, repair), team)  # type: ignore[arg-type]
    mttr = failures.time_to_repair.mean  # type: ignore[union-attr]
    world.run(steps)
    log = world.events
    down = (log["what"] == "repaired").map({True: 1.0, False: -1.0}) * log["time"]
    # Those that are failed at the end are so until then.
    total = down.sum() + steps * len(failures.failed)
    availability = 1 - total / (robots * steps)
    # A robot makes about 11 cycles; the variance of the share of an alternating renewal process, plus its bias from the
    # start, at which all work; 5.5 standard errors are exceeded with a probability below 1e-7.
    cycle, share = mttf + mttr, mttf / (mttf + mttr)
    variance_down = {True: 0.0, False: mttr**2}[isinstance(end, Constant)]
    variance = (mttf**2 * mttr**2 + variance_down * mttf**2) / cycle**3 / steps / robots
    bias = (1 - share) * mttr / steps
    assert abs(availability - share) < 5.5 * math.sqrt(variance) + bias


def test_what_others_do_does_not_change_the_times_of_a_failure() -> None:
    plain, other = make(Failures(40, 10)), make(Failures(40, 10))
    plain.run(150)
    other.run(20)
    other.groups[0].policy = "random-walk"
    other.groups[0].add(2)
    other.run(30)
    other.groups[0][5].remove()
    other.run(100)
    mine, theirs = plain.events, other.events
    stayed = [*plain.groups[0].identity[:5].tolist(), *plain.groups[0].identity[6:].tolist()]
    for identity in stayed:
        assert times(plain, "failed", identity) == times(other, "failed", identity)
        assert times(plain, "repaired", identity) == times(other, "repaired", identity)
    late = theirs["agent"] > max(mine["agent"].max(), theirs["agent"].min())
    assert (theirs[late]["what"] == "failed").any()


def test_a_robot_that_two_sources_stop_goes_on_when_both_let_it() -> None:
    world = make(Failures(Times([2]), Times([6])), Failures(Times([4]), Times([8])), robots=2)
    robots = world.groups[0]
    active = []
    for _ in range(16):
        world.step()
        active.append(bool(robots[0].active))
    assert active == [tick < 2 or tick >= 12 for tick in range(16)]


def test_a_robot_that_a_user_has_stopped_stays_so() -> None:
    world = make(Failures(Times([2]), Times([2])), robots=2)
    robots = world.groups[0]
    robots[0].active = False
    world.run(10)
    assert robots.active.tolist() == [False, True]


def test_a_sensor_drops_out_and_comes_back() -> None:
    world = make(SensorDropouts(Times([3]), Times([4]), "targets"), robots=3)
    robots = world.groups[0]
    works = []
    for _ in range(10):
        world.step()
        works.append([robots[0].sensor_works(name) for name in ("targets", "teammates")])
    assert works == [[not 3 <= tick < 7, True] for tick in range(10)]
    assert times(world, "sensor dropped out") == [3.0] * 3
    world = make(SensorDropouts(Times([3])), robots=3)
    world.run(5)
    assert not any(world.groups[0][1].sensor_works(name) for name in ("targets", "teammates"))


def test_a_sensor_that_two_sources_break_works_when_both_are_over() -> None:
    world = make(SensorDropouts(Times([2]), Times([6]), "targets"), SensorDropouts(Times([4]), Times([8])), robots=1)
    works = []
    for _ in range(16):
        world.step()
        works.append([world.groups[0][0].sensor_works(name) for name in ("targets", "teammates")])
    assert works == [[tick < 2 or tick >= 12, tick < 4 or tick >= 12] for tick in range(16)]


def test_detaching_repairs() -> None:
    world = make(Failures(Times([2])), SensorDropouts(Times([2])))
    world.run(5)
    for source in world.sources:
        world.detach(source)
    robots = world.groups[0]
    assert robots.active.all()
    assert all(robot.sensor_works("targets") and robot.sensor_works("teammates") for robot in robots)
    world.run(50)
    assert len(world.events) == 16


def test_failures_are_swept_as_objects() -> None:
    failures = Failures(50, 10)
    first, second = make(failures), make(failures)
    for world in (first, second):
        world.run(60)
    assert first.events.equals(second.events)
    assert repr(failures) == "Failures(time_to_failure=Exponential(mean=50.0), time_to_repair=Exponential(mean=10.0))"
    assert not failures.is_attached


def test_wrong_values_are_refused() -> None:
    with pytest.raises(ValueError, match=r"time_to_failure=-3\.0: .* at least"):
        Failures(-3)
    with pytest.raises(TypeError, match=r"time_to_repair='x': must be a number.*Times\(\[20, 35\]\)"):
        Failures(3, "x")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"channel='prey': the group 'robots' has no such channel, but 'teammates'.*senses"):
        make(SensorDropouts(3, 4, "prey"))
    world = make()
    world.run(20)
    with pytest.raises(ValueError, match=r"time_to_failure: the time 7 has passed; the present tick is 20"):
        world.attach(Failures(Times([7, 40])), world.groups[0])
    assert world.sources == ()
    world.attach(Failures(Times([20, 40])), world.groups[0])
    world.run(1)
    assert np.count_nonzero(~world.groups[0].active) == 8


@pytest.mark.short
@pytest.mark.parametrize(
    ("first", "then", "expected"),
    [(0, None, False), (15, None, False), (15, 17, True), (20, None, False), (25, None, False), (None, 15, True), (None, 25, True)],
)
def test_what_the_user_sets_wins_over_failures_and_dropouts(
    first: int | None, then: int | None, expected: bool
) -> None:
    # Two overlapping failures and dropouts, from 10 to 30 and from 20 to 40.
    sources = [
        kind(Times({0: [time]}), Constant(20), **more)
        for kind, more in ((Failures, {}), (SensorDropouts, {"channel": "targets"}))
        for time in (10, 20)
    ]
    world = make(*sources)
    robot = world.groups[0][0]

    def put(on: bool) -> None:
        robot.active = on
        (robot.repair_sensor if on else robot.break_sensor)("targets")

    for time, on in ((first, False), (then, True)):
        if time is not None:
            world.clock.at(time, partial(put, on))
    world.run(26)
    failed = [robot in source.failed for source in world.sources[:2]]  # type: ignore[attr-defined]
    # Whom the user has made active since has not failed.
    assert failed == [then is None, then != 25]
    saved = world.state()
    world.run(25)
    world.restore(saved)
    world.run(25)
    assert (robot.active, robot.sensor_works("targets")) == (expected, expected)
    world.reset()
    assert robot.active
    assert robot.sensor_works("targets")


@pytest.mark.short
def test_times_for_members_that_cannot_be_there_are_refused() -> None:
    for source in (Failures(Times({0: [5], 99: [5]})), Failures(5, Times({99: [5]})), Departures(Times({99: [5]}))):
        world = make(robots=4)
        with pytest.raises(ValueError, match=r"lists times for the members 99, which 'robots' does not have; .* or Arrivals"):
            world.attach(source, world.groups[0])
        assert world.sources == ()
        world.run(2)
        # Members that arrive are numbered on.
        world.attach(Arrivals(Times([3])), world.groups[0])
        world.attach(source, world.groups[0])
    with pytest.raises(ValueError, match=r"interval=.*arrivals have one list, .*Times\(\[100, 250\]\)"):
        Arrivals(Times({3: [5]}))
    world = make(Failures(Times({2: [5]})), robots=4)
    world.groups[0][2].remove()
    # One that has left since it was attached stops no reset.
    world.reset()
    world.run(10)
    assert world.events.empty
