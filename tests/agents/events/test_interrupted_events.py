"""Ctrl-C at any point of an event of a component: nothing is lost, and the run that goes on has the same events."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import pytest

from teamsight import CMOMMT, Arrivals, Batteries, ChargingPlaces, EventSource, Failures

STEPS = 60
#: The files in whose lines Ctrl-C comes.
PLACES = ("/components/", "/events/source", "/world/clock.py", "/engine/records.py")


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt, also where the tests were started in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def failing(world: Any) -> None:
    world.attach(Failures(8, 3), world.robots)


def arriving(world: Any) -> None:
    world.attach(Arrivals(3, stay=20), world.targets)


def charging(world: Any) -> None:
    world.attach(Batteries(20.0, per_tick=1.0), world.robots)
    world.attach(ChargingPlaces((0, 0), 2, rate=8.0, radius=1.0), world.robots)


def bits(world: CMOMMT) -> tuple[Any, ...]:
    return (
        world.tick, world.steps, world.events.to_json(), world.robots.position.tobytes(), world.targets.position.tobytes(),
        repr(world.observed_fraction),
    )  # fmt: skip


def interrupt_every(number: int, calls: list[int]) -> Callable[[FrameType, str, Any], Any]:
    """Return a trace function that sends Ctrl-C after so many lines of code that concern events."""

    def trace(frame: FrameType, kind: str, argument: Any) -> Any:
        name = frame.f_code.co_filename
        if not any(part in name for part in PLACES):
            return None
        calls[0] += 1
        if calls[0] % number == 0:
            signal.raise_signal(signal.SIGINT)
        return trace

    return trace


@pytest.mark.parametrize(("path", "number"), [("run", 211), ("run", 499), ("step", 307)])
@pytest.mark.parametrize("kind", [failing, arriving, charging])
def test_no_event_of_a_component_is_lost(kind: Callable[[Any], None], path: str, number: int) -> None:
    world, other = (CMOMMT(robots=6, targets=5, radius=3.0, rng=4) for _ in range(2))
    kind(world)
    kind(other)
    other.run(STEPS)
    interrupts, calls, before = 0, [0], sys.gettrace()
    while world.tick < STEPS:
        # Primes, so that all lines have their turn.
        sys.settrace(interrupt_every(number, calls))
        try:
            world.run(STEPS - world.tick) if path == "run" else world.step()
        except KeyboardInterrupt:
            interrupts += 1
        finally:
            sys.settrace(before)
    assert interrupts >= 3
    assert bits(world) == bits(other)


@pytest.mark.short
def test_an_endless_chain_of_calls_stops_between_two() -> None:
    class Endless(EventSource):
        needs_group = False
        calls = 0

        def begin(self) -> None:
            self.plan(2, "go")

        def go(self) -> None:
            self.calls += 1
            self.plan(self.now, "go")
            if self.calls == 50:
                signal.raise_signal(signal.SIGINT)
                self.calls += 1000

    world = CMOMMT(rng=1)
    source = world.attach(Endless())
    with pytest.raises(KeyboardInterrupt):
        world.run(5)
    assert source.calls == 1050
    assert len(source.pending("go")) == 1
    assert world.tick == world.steps == 2


@pytest.mark.short
def test_a_function_of_the_user_is_interrupted() -> None:
    """It may never return."""
    world, log = CMOMMT(rng=1), []

    def endless() -> None:
        while len(log) < 100_000:
            log.append(world.tick)
            if len(log) == 10:
                signal.raise_signal(signal.SIGINT)

    for plan in (lambda: world.clock.at(world.tick + 1, endless), lambda: world.schedule_recurring(endless, 1)):
        log.clear()
        plan()
        with pytest.raises(KeyboardInterrupt):
            world.run(5)
        assert len(log) == 10
