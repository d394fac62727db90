"""Arrivals and departures, unreliable awareness, and sources as a parameter of CMOMMT."""

from __future__ import annotations

import pickle
from typing import Any

import mesa
import numpy as np
import pytest

from teamsight import CMOMMT, Box, Disc, Robot, Sensor, Target, World, run_many
from teamsight.agents.components import (
    Arrivals,
    Batteries,
    Constant,
    Departures,
    Failures,
    Times,
    UnreliableAwareness,
)
from teamsight.agents.events import EventSource
from tests.sensed_worlds import percept_of, shown


def make(*sources: EventSource, robots: int = 6, seed: int = 1, awareness: str = "pairwise") -> World:
    world = World(Disc(3.0), rng=seed)
    team = world.add(Robot, robots, policy="a-cmommt", awareness=awareness)
    world.senses(team, world.add(Target, 6, policy="random-walk", speed=0.075))
    for source in sources:
        world.attach(source, team)
    return world


def times(world: World, what: str) -> list[float]:
    log = world.events
    return log[log["what"] == what]["time"].tolist()


def test_agents_arrive_stay_and_leave() -> None:
    world = make(Arrivals(Times([3, 5, 10.5]), Times([4, 100, 2]), position=(1, 0), speed=0.05))
    robots = world.groups[0]
    world.run(3)
    assert len(robots) == 6
    world.run(1)
    assert len(robots) == 7
    assert np.linalg.norm(robots[6].position - (1, 0)) <= 0.05 + 1e-12
    world.run(16)
    assert (times(world, "joined"), times(world, "left")) == ([3, 5, 10.5], [7, 12.5])
    assert robots.bodies.member.tolist() == [0, 1, 2, 3, 4, 5, 7]


def test_a_full_group_turns_away() -> None:
    world = make(Arrivals(Constant(2), most=8))
    world.run(12)
    assert len(world.groups[0]) == 8
    assert times(world, "turned away") == [6, 8, 10]


def test_arrivals_are_as_many_as_their_rate_says() -> None:
    world = World(Box(50, 50), rng=3)
    team = world.add(Robot, 1, policy="stationary")
    world.attach(Arrivals(2.0, 6.0), team)
    world.run(1_200)
    joined = len(times(world, "joined"))
    # A Poisson number of mean 600, and Little's law: three are there on average.
    assert abs(joined - 600) < 5.5 * 600**0.5
    stays = sum(times(world, "left")) - sum(times(world, "joined")) + 1_200 * (len(team) - 1)
    assert abs(stays / 1_200 - 3) < 5.5 * (2 * 3 * 6 / 1_200) ** 0.5 + 3 * 6 / 1_200


def test_agents_depart() -> None:
    world = make(Departures(Times({0: [4], 2: [0, 7]})), Departures(30.0))
    world.run(1)
    assert world.groups[0].bodies.member.tolist()[:3] == [0, 1, 3]
    world.run(400)
    assert len(world.groups[0]) == 0
    assert len(times(world, "left")) == 6


def test_paths_and_resets_give_one_result() -> None:
    def made() -> World:
        return make(Arrivals(7.0, 40.0), Failures(30, 5), Batteries(4.0, 0.5, per_tick=0.02), UnreliableAwareness(2, 0.1))

    one, stepped = made(), made()
    one.run(100)
    for _ in range(100):
        stepped.step()
    assert one.events.equals(stepped.events)
    assert one.groups[0].position.tobytes() == stepped.groups[0].position.tobytes()
    stepped.reset()
    assert len(stepped.groups[0]) == 6
    stepped.run(100)
    assert one.events.equals(stepped.events)
    assert one.groups[0].position.tobytes() == stepped.groups[0].position.tobytes()


def test_a_world_with_arrivals_is_restored() -> None:
    world = make(Arrivals(5.0))
    world.run(30)
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(40)
    log, position = world.events, world.groups[0].position.tobytes()
    world.restore(saved)
    world.run(40)
    assert log.equals(world.events)
    assert position == world.groups[0].position.tobytes()


def test_awareness_is_unreliable_for_a_time() -> None:
    exact, late = make(awareness="shared"), make(UnreliableAwareness(2, begins=4, ends=9.5), awareness="shared")
    robots = late.groups[0]
    # The same motion, so that percepts can be compared.
    for world in (exact, late):
        world.groups[0].policy = "random-walk"
    seen = []
    for tick in range(15):
        for world in (exact, late):
            world.step()
        percept = percept_of(exact.groups[0])
        seen.append((shown(percept.teammates), shown(percept.relayed)))
        percept = percept_of(robots)
        found = shown(percept.teammates), shown(percept.relayed)
        # Until the first arrives, nothing is known. seen[k] is that of tick k + 1.
        now = tick + 1
        if 5 <= now <= 9 and now - 2 >= 5:
            assert found == seen[tick - 2]
        elif not 5 <= now <= 10:
            assert found == seen[tick]
    log = late.events
    assert log[["time", "what"]].to_numpy().tolist() == [[4.0, "awareness unreliable"], [9.5, "awareness reliable"]]
    assert robots.sensors["teammates"] == Sensor()


def test_unreliable_awareness_adds_to_the_sensor_and_is_undone() -> None:
    world = make()
    robots = world.groups[0]
    before = robots.sensors["teammates"] = Sensor(delay=1, missed=0.5)
    source = world.attach(UnreliableAwareness(3, 0.5), robots)
    assert robots.sensors["teammates"] == Sensor(delay=4, missed=0.75)
    saved = world.state()
    world.run(5)
    world.reset()
    assert robots.sensors["teammates"] == Sensor(delay=4, missed=0.75)
    world.restore(saved)
    world.detach(source)
    assert robots.sensors["teammates"] == before


def test_overlapping_sources_of_unreliable_awareness_add_up_and_leave_the_users_sensor() -> None:
    def seen(world: World) -> list[tuple[int, float]]:
        found = []
        for tick in (10, 30, 60, 150):
            world.run(tick - world.tick)
            sensor = world.groups[0].sensors["teammates"]
            found.append((sensor.delay, sensor.missed))
        return found

    for order in (0, 1):
        world = make()
        robots = world.groups[0]
        both = [UnreliableAwareness(delay=2, ends=50), UnreliableAwareness(missing=0.5, begins=20, ends=100)]
        for one in both[::-1] if order else both:
            world.attach(one, robots)
        expected = [(2, 0.0), (2, 0.5), (0, 0.5), (0, 0.0)]
        assert seen(world) == expected
        said = ["awareness unreliable"] * 3 + ["awareness reliable"]
        assert world.events[world.events["source"] == "UnreliableAwareness"]["what"].tolist() == said
        # In the middle of both, a reset and a state are no end of the sensor of the user.
        world.reset()
        world.run(30)
        saved = world.state()
        world.reset()
        assert seen(world) == expected
        world.restore(saved)
        world.run(30)
        assert robots.sensors["teammates"] == Sensor(missed=0.5)
        world.detach(world.sources[1 - order])
        assert robots.sensors["teammates"] == Sensor()


def test_a_sensor_that_the_user_sets_meanwhile_stays() -> None:
    world = make()
    robots = world.groups[0]
    world.attach(UnreliableAwareness(delay=2, ends=50), robots)
    world.attach(UnreliableAwareness(delay=1, begins=20, ends=30), robots)
    world.run(10)
    robots.sensors["teammates"] = Sensor(missed=0.3)
    world.run(5)
    assert robots.sensors["teammates"] == Sensor(missed=0.3)
    world.run(10)
    assert (robots.sensors["teammates"].delay, robots.sensors["teammates"].missed) == (3, pytest.approx(0.3))
    world.run(50)
    assert robots.sensors["teammates"] == Sensor(missed=0.3)


def test_sources_are_a_parameter_of_the_model() -> None:
    failures, batteries = Failures(20, 10), Batteries(30)
    for events in (failures, [failures, batteries]):
        model, other = CMOMMT(events=events, rng=1), CMOMMT(rng=1)
        for source in events if isinstance(events, list) else [events]:
            other.attach(source, other.robots)
        for each in (model, other):
            each.run(60)
        assert model.events.equals(other.events)
        assert len(model.events)
    with pytest.raises(TypeError, match=r"attach\(3\): must be an event source, such as Failures\(500, 50\)"):
        CMOMMT(events=3)  # type: ignore[arg-type]


def test_sources_are_swept() -> None:
    sources = [None, Failures(40, 40), [Failures(10), Batteries(2)]]
    table = run_many({"events": sources, "robots": 5}, steps=40, replicates=2, rng=1)
    assert len(table) == 6
    fraction = table["observed_fraction"].to_numpy()
    for k, (_, row) in enumerate(table.iterrows()):
        model = CMOMMT(robots=5, events=sources[k // 2], rng=int(row["seed"]))
        model.run(40)
        assert fraction[k] == model.observed_fraction
    rows = mesa.batch_run(CMOMMT, {"events": sources, "robots": 5}, rng=[1], max_steps=20, display_progress=False) \
        if "rng" in mesa.batch_run.__code__.co_varnames else \
        mesa.batch_run(CMOMMT, {"events": sources, "robots": 5, "rng": 1}, max_steps=20, display_progress=False)
    assert len(rows) == 3


def test_wrong_values_are_refused() -> None:
    with pytest.raises(ValueError, match=r"interval=0\.0: .*at least"):
        Arrivals(0)
    with pytest.raises(ValueError, match=r"position=3: must be \(x, y\)"):
        Arrivals(3, position=3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"delay=-1: must be at least 0; it is a number of ticks"):
        UnreliableAwareness(-1)
    with pytest.raises(ValueError, match=r"missing=1\.5: .*at most 1"):
        UnreliableAwareness(missing=1.5)
    with pytest.raises(ValueError, match=r"ends=3\.0: .*above 5"):
        UnreliableAwareness(1, begins=5, ends=3)
    world = make()
    with pytest.raises(ValueError, match=r"'targets' is on no team .*world\.add\(…, team='robots'\)"):
        world.attach(UnreliableAwareness(1), world.groups[1])
    assert world.sources == ()


@pytest.mark.short
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"spede": 3}, r"spede=3: unknown; .*; Arrivals itself takes placement"),
        ({"position": (99, 0)}, r"position"),
        ({"speed": -1}, r"speed=-1"),
        ({"fuel": "much"}, r"fuel='much': the column has the type float64"),
        ({"turn_limit": None}, r"turn_limit: the agents of 'robots' have different ones, from 0\.5 to 1; .*Arrivals\(…, turn_limit=0\.5\)"),
        ({"cycle": None}, r"cycle: the agents of 'robots' have different ones; .* as in Arrivals\(…, cycle=5\)"),
    ],
)
def test_arrivals_that_cannot_come_are_refused_when_attached(given: dict[str, Any], message: str) -> None:
    world = make()
    robots = world.groups[0]
    robots.add_column("fuel", 1.0)
    if "turn_limit" in given:
        robots.turn_limit = [0.5, 1.0] * 3
    if "cycle" in given:
        robots[0].cycle = 3
    with pytest.raises((TypeError, ValueError), match=message):
        world.attach(Arrivals(Constant(2), **given), robots)
    assert (len(robots), world.sources) == (6, ())
    world.run(5)
    assert len(robots) == 6
    sound = Arrivals(Constant(2), position=(1, 0), cycle=4, turn_limit=0.5, fuel=3.0)
    attached = world.attach(sound, robots)
    assert len(robots) == 6
    # What makes an arrival impossible later shows when it comes.
    world.detach(attached)
    world.attach(Arrivals(Constant(2), turn_limit=1.0, cycle=2), robots)
    robots[1].sensing_range = 2.0
    with pytest.raises(ValueError, match=r"sensing_range: .*Arrivals\(…, sensing_range="):
        world.run(5)
