"""Charging places: queues, exact times, states, and the formula for queues."""

from __future__ import annotations

import heapq
import math
import pickle
from typing import Any

import numpy as np
import pytest

from teamsight import Body, Box, Disc, Robot, Target, Torus, World
from teamsight.agents.components import Batteries, ChargingPlaces, Exponential, Failures
from teamsight.agents.events import EventSource
from teamsight.policies import SeekCharger


def make(*sources: EventSource, robots: int = 6, seed: int = 1, arena: Any = None) -> World:
    world = World(arena or Disc(3.0), rng=seed)
    team = world.add(Robot, robots, policy="a-cmommt", awareness="pairwise")
    world.senses(team, world.add(Target, 6, policy="random-walk", speed=0.075))
    for source in sources:
        world.attach(source, team)
    return world


def log_of(world: World, *whats: str) -> list[tuple[float, str, int]]:
    log = world.events
    rows = log[log["what"].isin(whats)]
    return list(zip(rows["time"].tolist(), rows["what"].tolist(), rows["agent"].tolist(), strict=True))


def test_robots_queue_are_charged_in_turn_and_go_on() -> None:
    # Three robots stand at the place, and are low after 4 steps with a charge of 1.
    world = make(Batteries(2.0, 0.0, per_tick=0.25, low_level=1.0), ChargingPlaces((0, 0), rate=0.5), robots=3)
    robots = world.groups[0]
    for robot in robots:
        robot.position = (0.0, 0.0)
        robot.speed = 0.0 if robot.row else 0.01
    world.run(4)
    places = world.sources[1]
    world.run(1)
    a, b, c = robots.identity.tolist()
    # The first is charged from tick 4 on, for 2 ticks; the others have 0.75 left, and 0.5 when it is done.
    assert [robot.unique_id for robot in places.charging()] == [a]  # type: ignore[attr-defined]
    assert [robot.unique_id for robot in places.queue()] == [b, c]  # type: ignore[attr-defined]
    assert robots.battery.tolist() == [1.5, 0.75, 0.75]  # type: ignore[attr-defined]
    assert robots.speed.tolist() == [0.0, 0.0, 0.0]
    world.run(6)
    assert log_of(world, "queued", "charging", "charged") == [
        (4.0, "queued", a), (4.0, "queued", b), (4.0, "queued", c), (4.0, "charging", a),
        (6.0, "charged", a), (6.0, "charging", b),
        (9.0, "charged", b), (9.0, "charging", c),
        (10.0, "queued", a),
    ]  # fmt: skip
    # By tick 9 the third was empty: it has waited since, inactive, and goes on when it is charged.
    assert log_of(world, "empty") == [(8.0, "empty", c)]
    world.run(3)
    assert log_of(world, "charged")[-1] == (13.0, "charged", c)
    assert robots.active.all()
    assert robots[2].battery == 2.0 - 0.25


def assert_same(one: World, other: World) -> None:
    assert one.events.equals(other.events)
    for group, same in zip(one.groups, other.groups, strict=True):
        assert group.position.tobytes() == same.position.tobytes()
        assert group.speed.tolist() == same.speed.tolist()
    assert one.groups[0].battery.tolist() == other.groups[0].battery.tolist()  # type: ignore[attr-defined]


def crowded(seed: int = 3) -> World:
    # The places are where robots pass by.
    return make(
        Batteries(1.5, 0.5, per_tick=0.01, low_level=1.3),
        ChargingPlaces([(0, 0), (1, 1)], rate=0.02, radius=1.5), Failures(80, 10), robots=12, seed=seed,
    )  # fmt: skip


def test_all_paths_and_states_give_one_result() -> None:
    one = crowded()
    one.run(200)
    assert {"queued", "charging", "charged", "failed"} <= set(one.events["what"])
    stepped, reset, saved_at = crowded(), crowded(), []
    for _ in range(200):
        stepped.step()
    reset.run(77)
    reset.reset()
    reset.run(100)
    places = reset.sources[1]
    assert places.queue(1)  # type: ignore[attr-defined]
    saved_at.append(pickle.loads(pickle.dumps(reset.state())))
    reset.run(60)
    reset.restore(saved_at[0])
    reset.run(100)
    built = crowded()
    built.restore(saved_at[0])
    for count in (1, 2, 30, 67):
        built.run(count)
    for world in (stepped, reset, built):
        assert_same(one, world)


def test_who_leaves_frees_its_place() -> None:
    world = crowded()
    world.run(100)
    places = world.sources[1]
    charged, waiting = places.charging(1)[0], places.queue(1)  # type: ignore[attr-defined]
    first, second = waiting[:2]
    first.remove()
    charged.remove()
    world.run(1)
    assert places.charging(1) == [second]  # type: ignore[attr-defined]
    world.run(200)
    world.detach(places)
    assert (world.groups[0].speed > 0).all()
    world.run(50)


def erlang_wait(rate: float, mean: float, servers: int) -> tuple[float, float]:
    """Return the mean time in the queue of M/M/c, and the probability to wait (Erlang C)."""
    load = rate * mean
    terms = [load**k / math.factorial(k) for k in range(servers)]
    last = load**servers / math.factorial(servers) * servers / (servers - load)
    waits = last / (sum(terms) + last)
    return waits * mean / (servers - load), waits


def test_queues_agree_with_the_formula_of_m_m_c() -> None:
    servers, mean, rate, customers = 2, 1.0, 1.4, 6_000
    world = World(Box(100, 100), rng=5)
    # Enough that none is called who is still there: each visit has a duration of its own.
    team = world.add(Body, 200, policy="stationary", team=None, position=(40, 40))
    world.attach(Batteries(1.0, 1.0), team)
    places = world.attach(ChargingPlaces((0, 0), servers, duration=Exponential(mean), reach=1.0), team)
    gaps = np.random.default_rng(6).exponential(1 / rate, customers)
    arrivals = np.cumsum(gaps)
    for member, time in enumerate(arrivals.tolist()):
        places.plan(time, "come", member % 200, 0)
    world.run(int(arrivals[-1]) + 100)
    log = world.events.assign(visit=lambda events: events.groupby(["what", "agent"]).cumcount())
    log = log.pivot(index=["visit", "agent"], columns="what", values="time").sort_index()
    assert len(log) == customers
    waited = (log["charging"] - log["queued"]).to_numpy()
    served = (log["charged"] - log["charging"]).to_numpy()
    # The slow twin: who comes next gets the charger that is free first.
    free = [0.0] * servers
    for k, time in enumerate(arrivals.tolist()):
        start = max(heapq.heappop(free), time)
        assert waited[k] == pytest.approx(start - time, abs=1e-6)
        heapq.heappush(free, start + served[k])
    # Means over batches are nearly independent; 6 standard errors are exceeded with a probability below 1e-6.
    expected, waits = erlang_wait(rate, mean, servers)
    for values, formula in ((waited, expected), (waited > 1e-9, waits), (served, mean)):
        batches = np.asarray(values, float).reshape(30, -1).mean(axis=1)
        assert abs(batches.mean() - formula) < 6.5 * batches.std(ddof=1) / math.sqrt(30)


def patrol() -> World:
    places = ChargingPlaces([(0, 0), (1, 1)], rate=0.4, policy=SeekCharger())
    return make(Batteries(2.5, 0.5, per_tick=0.01, low_level=1.5), places, robots=12, seed=3)


def test_robots_that_are_low_go_to_a_place_and_return_to_their_policy() -> None:
    one, stepped, other = patrol(), patrol(), patrol()
    robots = one.groups[0]
    one.run(250)
    assert (one.events["what"] == "charged").sum() > 10
    assert one.path == "compiled"
    low = set(one.events[one.events["what"] == "low"]["agent"])
    assert {type(robot.policy).__name__ for robot in robots} <= {"ACmommt", "SeekCharger"}
    assert len(low) > 6
    for _ in range(250):
        stepped.step()
    other.run(120)
    saved = pickle.loads(pickle.dumps(other.state()))
    other.run(10)
    other.reset()
    assert {type(robot.policy).__name__ for robot in other.groups[0]} == {"ACmommt"}
    other.run(250)
    third = patrol()
    third.restore(saved)
    third.run(130)
    for world in (stepped, other, third):
        assert_same(one, world)
    one.detach(one.sources[1])
    assert {type(robot.policy).__name__ for robot in robots} == {"ACmommt"}


def test_a_group_that_is_given_another_policy_goes_on_with_it() -> None:
    world = patrol()
    robots = world.groups[0]
    world.run(40)
    assert any(type(robot.policy).__name__ == "SeekCharger" for robot in robots)
    robots.policy = "random-walk"
    world.run(150)
    places = world.sources[1]
    world.detach(places)
    assert {type(robot.policy).__name__ for robot in robots} == {"RandomWalk"}
    world.attach(ChargingPlaces((0, 0), rate=1.0, policy=SeekCharger()), robots)
    robots.battery = 0.5  # type: ignore[attr-defined]
    world.run(2)
    assert {type(robot.policy).__name__ for robot in robots if robot.active} == {"SeekCharger"}


@pytest.mark.parametrize("arena", [Torus(4, 6), Box(4, 6)])
def test_places_are_sensed_as_far_as_the_arena_allows(arena: Any) -> None:
    world = make(Batteries(20.0), ChargingPlaces((1, 1), rate=1.0), arena=arena)
    world.run(2)
    sensed = [robot.sensed("chargers") for robot in world.groups[0]]
    if isinstance(arena, Box):
        assert sensed == [list(world.groups[2])] * 6
    # The task has not changed: chargers are no targets.
    plain = make(arena=arena)
    plain.run(2)
    assert plain.observed_fraction == world.observed_fraction


def test_wrong_values_are_refused() -> None:
    with pytest.raises(ValueError, match=r"rate=None, duration=None: give one"):
        ChargingPlaces((0, 0))
    with pytest.raises(ValueError, match=r"rate=0\.0: .*above 0"):
        ChargingPlaces((0, 0), rate=0)
    with pytest.raises(ValueError, match=r"chargers=0: must be at least 1"):
        ChargingPlaces((0, 0), 0, rate=1)
    with pytest.raises(ValueError, match=r"position=\(0, 0, 0\): must be \(x, y\)"):
        ChargingPlaces((0, 0, 0), rate=1)
    world = make()
    with pytest.raises(ValueError, match=r"'robots' have no batteries; attach them first, .*Batteries\(20\)"):
        world.attach(ChargingPlaces((0, 0), rate=1), world.groups[0])
    world.attach(Batteries(20), world.groups[0])
    with pytest.raises(ValueError, match=r"position=\(9\.0, 9\.0\): .*inside"):
        world.attach(ChargingPlaces((9, 9), rate=1), world.groups[0])
    assert (len(world.sources), len(world.groups)) == (1, 2)


def test_several_sources_of_places_share_the_agents() -> None:
    policy = SeekCharger()
    places = ChargingPlaces((-2, 0), rate=1, policy=policy), ChargingPlaces((2, 0), rate=0.5)
    world = make(Batteries(8, per_tick=0.05, low_level=4), *places)
    robots, sources = world.groups[0], world.sources[1:]
    used = set()
    for _ in range(300):
        world.run(2)
        for robot in robots:
            there = [agent for source in sources for agent in source.queue() + source.charging()]  # type: ignore[attr-defined]
            assert len(there) == len(set(there))
            # Whoever has enough has its own policy and moves; the level is that of the last event.
            if robot.battery > 4 and robot not in there:  # type: ignore[attr-defined]
                assert robot.policy is not policy
                assert robot.speed > 0
        used |= {k for k, source in enumerate(sources) if source.charging()}  # type: ignore[attr-defined]
    assert used == {0, 1}
    assert (world.events["what"] == "charged").sum() >= 12


def test_a_robot_at_two_places_is_charged_at_one() -> None:
    both = [ChargingPlaces((0, 0), rate=0.5, radius=1.0) for _ in range(2)]
    world = make(Batteries(2.0, 0.0, per_tick=0.25, low_level=1.0), *both, robots=1)
    robot = world.groups[0][0]
    robot.position, speed = (0.0, 0.0), robot.speed
    robot.speed = speed / 1000
    world.run(40)
    log = log_of(world, "queued", "charging", "charged")
    # Low after 4 steps; charged within 2.
    assert [(time, what) for time, what, _ in log[:6]] == [
        (4.0, "queued"), (4.0, "charging"), (6.0, "charged"), (10.0, "queued"), (10.0, "charging"), (12.0, "charged"),
    ]  # fmt: skip
    assert robot.speed in (0.0, speed / 1000)


def test_a_second_policy_for_low_batteries_is_refused() -> None:
    world = make(Batteries(8), ChargingPlaces((-2, 0), rate=1, policy=SeekCharger()))
    with pytest.raises(ValueError, match=r"other places of 'robots' give agents that are low .* leave policy out, since one"):
        world.attach(ChargingPlaces((2, 0), rate=1, policy=SeekCharger()), world.groups[0])
    assert len(world.sources) == 2
    assert len(world.groups) == 3
