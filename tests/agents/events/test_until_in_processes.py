"""What processes that wait for events of the world meet: departures, interrupts, other events, errors, resets."""

from __future__ import annotations

import gc
import traceback
from collections.abc import Callable, Generator
from typing import Any

import pytest
import simpy

from teamsight import CMOMMT, Box, Robot, Target, World
from teamsight.agents import AgentLeftError
from teamsight.agents.components.batteries import Batteries
from tests.agents.events.test_until import divisions

Process = Generator[Any, Any, Any]


def world_of(robots: list[tuple[float, float]], targets: list[tuple[float, float]]) -> World:
    """Return a world in which nobody moves unless it is moved."""
    world = World(Box(20, 20), rng=1)
    team = world.add(Robot, len(robots), position=robots, policy="stationary")
    if targets:
        world.senses(team, world.add(Target, len(targets), position=targets, policy="stationary"))
    return world


def watching(world: World) -> int:
    """Return how many watchers slow the loop down at the next step."""
    world.run(1)
    return len(world._data.watchers)


@pytest.mark.short
def test_what_is_so_already_happens_at_once() -> None:
    world = world_of([(0, 0), (0.5, 0)], [(0, 0.5), (5, 5)])
    robots, targets = world.groups
    log = []

    def look() -> Process:
        log.append((yield world.until.observed(targets[0])))
        log.append((yield world.until.lost(targets[1])))
        log.append((yield world.until.contact(robots[0])))
        log.append((yield world.until.contact_ended(robots[0], targets[1], "targets")))
        log.append((yield world.until(lambda: 7)))
        log.append(world.clock.now)

    world.clock.process(look())
    world.run(1)
    assert log == [list(robots), targets[1], robots[1], targets[1], 7, 0]
    assert watching(world) == 0


@pytest.mark.short
@divisions
def test_what_events_change_is_seen_at_the_same_tick(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (5, 5)], [(3, 3)])
    robots, targets = world.groups
    log = []

    def wait(event: Any) -> Process:
        yield event
        log.append(world.tick)

    def act() -> Process:
        yield world.clock.timeout(7.5)
        robots[0].position = (3, 3.5)
        yield world.clock.timeout(4)
        robots[1].position = (3, 4)

    world.clock.process(wait(world.until.observed(targets[0])))
    world.clock.process(wait(world.until.contact(robots[1], robots[0])))
    world.clock.process(act())
    advance(world, 20)
    assert log == [8, 12]
    assert watching(world) == 0


@pytest.mark.short
@divisions
def test_changes_between_calls_are_seen_too(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (5, 5)], [])
    (robots,) = world.groups
    contact = world.until.contact(robots[0])
    advance(world, 5)
    assert not contact.triggered
    robots[1].position = (0.5, 0)
    advance(world, 5)
    assert contact.processed
    assert contact.value is robots[1]


@pytest.mark.short
@divisions
def test_an_agent_that_leaves_ends_the_waiting_with_its_name(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (5, 5), (9, 9)], [(3, 3)])
    robots, targets = world.groups
    log: list[Any] = []

    def wait(event: Any) -> Process:
        try:
            value = yield event
        except AgentLeftError as error:
            value = str(error)
        log.append((world.tick, value))

    until = world.until
    shown, gone, third = repr(robots[1]), targets[0], robots[2]
    first, target = repr(robots[0]), repr(gone)
    for event in (
        until.observed(gone), until.contact(robots[0], robots[1]), until.contact(robots[1]),
        # What has been so cannot end otherwise than by leaving.
        until.contact(third),
    ):  # fmt: skip
        world.clock.process(wait(event))
    world.clock.at(6, robots[1].remove)
    world.clock.at(8, gone.remove)
    advance(world, 10)
    assert log == [
        (6, f"until.contact({first}, {shown}): {shown} has left the world, so this cannot come"),
        (6, f"until.contact({shown}): {shown} has left the world, so this cannot come"),
        (8, f"until.observed({target}): {target} has left the world, so this cannot come"),
    ]
    third.position = (0.5, 0)
    advance(world, 5)
    assert log[3] == (10, robots[0])


@divisions
def test_a_contact_and_an_observation_end_when_one_of_them_leaves(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (0.5, 0)], [(0, 0.5)])
    robots, targets = world.groups
    ended, lost = world.until.contact_ended(robots[0], robots[1]), world.until.lost(targets[0])
    second, target = robots[1], targets[0]
    world.clock.at(3, second.remove)
    world.clock.at(4, target.remove)
    advance(world, 10)
    assert ended.value is second
    assert lost.value is target
    assert world.until.contact_ended(robots[0], second).triggered
    assert world.until.lost(target).triggered


@pytest.mark.short
def test_an_agent_that_leaves_stops_no_run_if_nobody_waits() -> None:
    world = world_of([(0, 0), (5, 5)], [])
    (robots,) = world.groups
    kept = world.until.contact(robots[0])
    world.clock.at(3, robots[0].remove)
    world.run(10)
    assert len(robots) == 1
    assert isinstance(kept.value, AgentLeftError)
    gone = robots[0]
    gone.remove()
    with pytest.raises(AgentLeftError, match="has left the world"):
        world.until.contact(gone)


@pytest.mark.short
@divisions
def test_agents_that_come_and_go_do_not_confuse_rows(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (5, 5), (-5, -5)], [(3, 3), (8, 8)])
    robots, targets = world.groups
    log: list[Any] = []
    last, target, robot = robots[2], targets[1], robots[1]

    def wait(event: Any) -> Process:
        value = yield event
        log.append((world.tick, value))

    world.clock.process(wait(world.until.contact(last, robot)))
    world.clock.process(wait(world.until.observed(target)))
    world.clock.at(2, robots[0].remove)
    world.clock.at(3, targets[0].remove)
    world.clock.at(4, lambda: robots.add(2, position=[(0.5, 0), (9, -9)]))
    world.clock.at(6, lambda: setattr(target, "position", (9, -8.5)))
    world.clock.at(7, lambda: setattr(robot, "position", (-5, -4.5)))
    advance(world, 12)
    assert log == [(6, [robots[3]]), (7, robot)]


@pytest.mark.short
@divisions
def test_the_events_combine_with_timeouts_resources_and_each_other(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (5, 5)], [(3, 3)])
    robots, targets = world.groups
    dock, store, log = simpy.Resource(world.clock, 1), simpy.Store(world.clock), []

    def act() -> Process:
        contact, timeout = world.until.contact(robots[0]), world.clock.timeout(5)
        found = yield contact | timeout
        log.append((world.tick, contact in found, timeout in found))
        contact, seen = world.until.contact(robots[0]), world.until.observed(targets[0])
        found = yield contact & seen
        log.append((world.tick, found[contact] is robots[1], found[seen]))
        with dock.request() as place:
            yield place | world.until.lost(targets[0])
            yield store.put(robots[0])

    def move() -> Process:
        yield world.clock.timeout(8)
        robots[1].position = (0.5, 0)
        yield world.clock.timeout(2)
        targets[0].position = (0, 0.5)
        log.append((yield store.get()) is robots[0])

    world.clock.process(act())
    world.clock.process(move())
    advance(world, 30)
    assert log == [(5, False, True), (10, True, list(robots)), True]
    gc.collect()
    assert watching(world) == 0


@pytest.mark.short
@pytest.mark.parametrize("is_combined", [False, True])
def test_a_process_that_was_interrupted_leaves_no_watcher(is_combined: bool) -> None:
    world = world_of([(0, 0), (5, 5)], [])
    (robots,) = world.groups
    log = []

    def wait() -> Process:
        try:
            yield world.until.contact(robots[0]) | world.until.contact(robots[1]) if is_combined else (
                world.until.contact(robots[0])
            )
        except simpy.Interrupt as interrupt:
            log.append((world.tick, interrupt.cause))

    def interrupt(process: Any) -> Process:
        yield world.clock.timeout(4)
        process.interrupt("enough")

    world.clock.process(interrupt(world.clock.process(wait())))
    world.run(2)
    assert len(world._data.watchers) == 1
    world.run(3)
    assert log == [(4, "enough")]
    gc.collect()
    assert watching(world) == 0
    robots[1].position = (0.5, 0)
    world.run(3)


@pytest.mark.short
@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_a_waiting_process_is_not_lost_when_memory_is_collected() -> None:
    world = world_of([(0, 0), (5, 5)], [])
    (robots,) = world.groups
    log = []

    def wait(event: Callable[[], Any]) -> Process:
        yield event()
        log.append(world.tick)

    world.clock.process(wait(lambda: world.until.contact(robots[0])))
    world.clock.process(wait(lambda: world.until.contact(robots[0]) | world.until.contact(robots[1])))
    nested = world.clock.event().succeed()
    world.clock.process(wait(lambda: (world.until.contact(robots[0]) | world.clock.timeout(50)) & nested))
    world.clock.process(wait(lambda: world.until(lambda: len(robots[0].neighbours))))
    for _ in range(3):
        world.run(2)
        gc.collect()
    robots[1].position = (0.5, 0)
    world.run(2)
    assert log == [6, 6, 6, 6]
    assert watching(world) == 0


def test_an_event_that_is_kept_for_later_happens_meanwhile() -> None:
    world = world_of([(0, 0), (5, 5)], [])
    (robots,) = world.groups
    log = []

    def wait() -> Process:
        contact = world.until.contact(robots[0])
        yield world.clock.timeout(10)
        assert contact.processed
        log.append((yield contact))
        log.append(world.tick)

    world.clock.process(wait())
    world.clock.at(3, lambda: setattr(robots[1], "position", (0.5, 0)))
    world.clock.at(5, lambda: setattr(robots[1], "position", (5, 5)))
    world.run(15)
    assert log == [robots[1], 10]


@pytest.mark.short
@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_no_process_waits_across_a_reset_or_a_restored_state() -> None:
    world = world_of([(0, 0), (5, 5)], [])
    (robots,) = world.groups
    saved, log = world.state(), []

    def wait(what: Callable[[], Any]) -> Process:
        yield what()
        log.append(world.tick)

    for begin in (world.reset, lambda: world.restore(saved)):
        world.clock.process(wait(lambda: world.until.contact(robots[0])))
        world.clock.process(wait(lambda: world.until(lambda: len(robots[0].neighbours))))
        world.run(5)
        begin()
        robots[1].position = (0.5, 0)
        world.run(5)
        assert log == []
        assert world.path == "compiled"
        assert watching(world) == 0
        robots[1].position = (5, 5)


@pytest.mark.short
@divisions
def test_an_exception_in_a_process_stops_the_run_at_its_own_line(advance: Callable[[World, int], Any]) -> None:
    model = CMOMMT(rng=1, robots=5, targets=5)
    log = []

    def fail() -> Process:
        yield model.clock.timeout(6.5)
        model.robots[0].speed = 0.05
        raise ZeroDivisionError("my own mistake")

    def work() -> Process:
        while True:
            yield model.clock.timeout(7)
            log.append(model.tick)

    model.clock.process(fail())
    model.clock.process(work())
    with pytest.raises(ZeroDivisionError, match="my own mistake") as caught:
        advance(model, 20)
    assert model.tick == model.steps == model.clock.now == 7
    frame = traceback.extract_tb(caught.tb)[-1]
    assert (frame.name, frame.line) == ("fail", 'raise ZeroDivisionError("my own mistake")')
    model.run(20 - model.tick)
    twin = CMOMMT(rng=1, robots=5, targets=5)
    twin.run(7)
    twin.robots[0].speed = 0.05
    twin.run(13)
    assert (model.robots.position == twin.robots.position).all()
    assert log == [7, 14]
    assert len(model.recording.history) == len(twin.recording.history)


@pytest.mark.short
def test_a_failing_condition_raises_in_its_process() -> None:
    world = world_of([(0, 0), (5, 5)], [])
    log = []

    def careful() -> Process:
        try:
            yield world.until(lambda: world.tick >= 3 and 1 / 0)
        except ZeroDivisionError:
            log.append(world.tick)

    world.clock.process(careful())
    world.run(2)
    with pytest.warns(UserWarning, match="waits for a condition in Python"):
        world.run(10)
    assert log == [3]
    assert world.path == "compiled"

    def careless() -> Process:
        yield world.until(lambda: world.tick >= 20 and 1 / 0)

    world.clock.process(careless())
    with pytest.raises(ZeroDivisionError):
        world.run(30)
    assert world.tick == world.steps == 20
    world.run(10)
    assert world.tick == 30


@pytest.mark.short
def test_a_process_cannot_make_steps() -> None:
    world = world_of([(0, 0)], [])

    def wrong() -> Process:
        yield world.clock.timeout(1)
        world.run(1)

    world.clock.process(wrong())
    with pytest.raises(RuntimeError, match=r"run\(\): called in an event.*yield world.clock.timeout\(1\)"):
        world.run(5)
    with pytest.raises(RuntimeError, match=r"run\(\): called in a condition"):
        world.until(lambda: world.run(1))
    world.until(lambda: False)
    assert world.tick == 1


def waiting() -> Process:
    yield


@pytest.mark.short
def test_wrong_arguments_are_named() -> None:
    world, other = world_of([(0, 0), (5, 5)], [(3, 3)]), world_of([(0, 0)], [])
    robots, targets = world.groups
    until = world.until
    with pytest.raises(TypeError, match=r"until.observed\(3\): must be an agent of this world"):
        until.observed(3)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match=r"until.observed\(<Group.*must be an agent"):
        until.observed(targets)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="is in another world; give an agent of this one"):
        until.contact(other.groups[0][0])
    with pytest.raises(ValueError, match="no group senses robots in a channel that counts.*world.senses"):
        until.observed(robots[0])
    with pytest.raises(ValueError, match="the group 'robots' has no such channel, but 'teammates', 'targets'"):
        until.contact(robots[0], channel="beacons")
    with pytest.raises(ValueError, match="robots sense targets in this channel"):
        until.contact(robots[0], robots[1], "targets")
    with pytest.raises(ValueError, match="robots sense robots in this channel, not targets; give channel='targets'"):
        until.contact(robots[0], targets[0])
    with pytest.raises(ValueError, match=r"the group 'targets' has no such channel, but none"):
        until.contact(targets[0], robots[0])
    with pytest.raises(TypeError, match=r"returned <generator object .*, which counts as true at once"):
        until(waiting)
    with pytest.raises(TypeError, match=r"returned <Event.*which counts as true at once.*by yield event"):
        until(lambda: until.observed(targets[0]))
    with pytest.raises(ValueError, match="no robot senses itself"):
        until.contact(robots[0], robots[0])
    with pytest.raises(TypeError, match=r"until\(True\): must be a function"):
        until(True)  # type: ignore[arg-type]
    with pytest.raises(AttributeError, match="until=3: cannot be set; its methods return"):
        world.until = 3  # type: ignore[misc, assignment]
    assert watching(world) == 0


@pytest.mark.short
@divisions
def test_a_battery_is_empty_when_it_is(advance: Callable[[World, int], Any]) -> None:
    world = World(Box(20, 20), rng=1)
    robots = world.add(Robot, 2, policy="stationary")
    with pytest.raises(ValueError, match=r"robots have no batteries; add them, as in world.attach\(Batteries"):
        world.until.battery_empty(robots[0])
    world.attach(Batteries(10, per_tick=1.5), robots)
    log = []

    def wait() -> Process:
        found = yield world.until.battery_empty(robots[1])
        log.append((world.tick, found))

    world.clock.process(wait())
    advance(world, 12)
    assert log == [(7, robots[1])]


@pytest.mark.short
@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_a_policy_in_python_can_ask_for_events() -> None:
    """It asks in the middle of a step, after the loop was entered."""
    world = World(Box(20, 20), rng=1)
    asked: list[Any] = []

    def ask(percept: Any, rng: Any) -> tuple[float, float]:
        robots = world.groups[0]
        asked.extend(world.until.contact(robots[k % 3], robots[(k + 1) % 3]) for k in range(5))
        return 0.0, 0.1

    # The first two meet, and the third walks away.
    world.add(Robot, 3, policy=ask, position=[(-2, 0), (2, 0), (0, 5)], heading=[(1, 0), (-1, 0), (0, 1)])
    for steps in (1, 5, 1, 20):
        world.run(steps)
    assert {event.value for event in asked if event.triggered} == {world.groups[0][1]}
    assert len(world._data.watchers) == 1


@pytest.mark.short
@divisions
def test_what_is_inactive_is_neither_observed_nor_met(advance: Callable[[World, int], Any]) -> None:
    world = world_of([(0, 0), (0.5, 0)], [(0, 0.5)])
    robots, targets = world.groups
    log: list[Any] = []

    def wait(name: str, event: Any) -> Process:
        yield event
        log.append((world.tick, name))

    def act() -> Process:
        for agent in (*robots, targets[0]):
            yield world.clock.timeout(2)
            agent.active = False
        world.clock.process(wait("observed", world.until.observed(targets[0])))
        world.clock.process(wait("met", world.until.contact(robots[0], robots[1])))
        for agent in (targets[0], *robots):
            yield world.clock.timeout(2)
            agent.active = True

    world.clock.process(wait("apart", world.until.contact_ended(robots[0], robots[1])))
    world.clock.process(wait("lost", world.until.lost(targets[0])))
    world.clock.process(act())
    advance(world, 20)
    # The second robot senses the target until it is inactive, too.
    assert log == [(2, "apart"), (4, "lost"), (10, "observed"), (12, "met")]
