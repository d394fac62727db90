"""mesa's event methods on the clock, whichever mesa is installed: recurring events, states, compiled stretches."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import mesa
import pytest

from teamsight import CMOMMT

has_schedule = hasattr(mesa.Model, "schedule_event")


def schedule(interval: Any = 1.0, start: float | None = None, end: float | None = None, count: int | None = None) -> Any:
    """Return mesa's own schedule, or what has its attributes."""
    if has_schedule:
        from mesa.time import Schedule

        return Schedule(interval, start, end, count)
    return SimpleNamespace(interval=interval, start=start, end=end, count=count)


class Weather(CMOMMT):
    """A model whose rain is planned with mesa's methods."""

    def __init__(self, *, every: Any = 7.5, **parameters: Any) -> None:
        super().__init__(robots=3, targets=3, **parameters)
        self.rains = self.schedule_recurring(self.rain, every)
        self.schedule_event(self.rain, at=3)

    def rain(self) -> None:
        self.log("rain", count=self.rains.execution_count if hasattr(self, "rains") else 0)


ADVANCES: list[Callable[[CMOMMT, int], Any]] = [
    lambda world, steps: world.run(steps),
    lambda world, steps: [world.step() for _ in range(steps)],
    lambda world, steps: world.run_for(steps),
    lambda world, steps: world.run_until(world.tick + steps),
]


def yielding() -> Any:
    yield


@pytest.mark.short
@pytest.mark.parametrize("advance", ADVANCES)
def test_recurring_events_happen_at_exact_times_and_at_the_end_of_their_steps(advance: Any) -> None:
    world = Weather(rng=1)
    advance(world, 30)
    assert world.events.time.tolist() == [3, 7.5, 15, 22.5, 30]
    assert world.events.tick.tolist() == [3, 8, 15, 23, 30]
    assert world.path == "compiled"
    assert world.rains.next_scheduled_time == 37.5


@pytest.mark.parametrize(
    ("given", "times"),
    [
        (schedule(4), [4, 8, 12, 16, 20]),
        (schedule(4.0, start=2), [2, 6, 10, 14, 18]),
        (schedule(4, start=0), [0, 4, 8, 12, 16, 20]),
        (schedule(4, count=2), [4, 8]),
        (schedule(4, end=12), [4, 8, 12]),
        (schedule(lambda world: world.tick + 1), [1, 3, 7, 15]),
        (6.5, [6.5, 13, 19.5]),
    ],
)
def test_schedules_are_those_of_mesa(given: Any, times: list[float]) -> None:
    world = CMOMMT(rng=1)
    recurring = world.schedule_recurring(lambda: world.log("x"), given)
    world.run(20)
    assert world.events.time.tolist() == times
    assert recurring.execution_count == len(times)
    assert recurring.is_active == (recurring.next_scheduled_time is not None)
    world.reset()
    world.run(20)
    assert world.events.time.tolist() == times


def test_recurring_events_can_be_stopped_paused_and_resumed() -> None:
    world = CMOMMT(rng=1)
    recurring = world.schedule_recurring(lambda: world.log("x"), 4)
    world.clock.at(5, recurring.pause)
    world.clock.at(15, recurring.resume)
    world.clock.at(16, recurring.resume)
    world.clock.at(24, recurring.stop)
    world.clock.at(25, recurring.resume)
    world.run(40)
    assert world.events.time.tolist() == [4, 19, 23]
    assert not recurring.is_active


def test_a_recurring_event_may_stop_itself_begin_the_run_again_and_fail() -> None:
    world = CMOMMT(rng=1)
    calls: list[float] = []

    def act() -> None:
        calls.append(world.clock.now)
        if len(calls) == 1:
            world.reset()
        elif len(calls) == 2:
            raise OSError("no signal")
        elif len(calls) == 4:
            recurring.stop()

    recurring = world.schedule_recurring(act, 3)
    with pytest.raises(OSError, match="no signal"):
        world.run(30)
    assert world.tick == 3
    world.run(20)
    assert calls == [3, 3, 6, 9]


@pytest.mark.short
def test_a_state_holds_mesas_events_of_methods_and_all_recurring_ones() -> None:
    straight, world, other = Weather(rng=1), Weather(rng=1), Weather(rng=4)
    straight.run(50)
    world.run(2)
    first = pickle.loads(pickle.dumps(world.state()))
    world.run(20)
    second = pickle.loads(pickle.dumps(world.state()))
    world.rains.stop()
    other.run(9)
    for saved in (first, second):
        for one in (world, other):
            one.restore(saved)
            one.run(50 - one.tick)
            assert one.events.equals(straight.events)


def test_a_state_is_refused_by_a_world_with_another_recurring_event() -> None:
    with pytest.raises(ValueError, match=r"source 1 is Recurring\(Weather.rain, interval=7.5\), and here it is Recurring\(Weather.rain, interval=6.0\)"):
        Weather(rng=1, every=6.0).restore(Weather(rng=1).state())


def test_events_of_one_time_come_in_the_order_of_priority_and_then_of_planning() -> None:
    world, log = CMOMMT(rng=1), []
    for name, priority in (("low", 10), ("a", 5), ("high", 1), ("b", 5), ("lowest", 10**9), ("highest", -(10**9))):
        world.schedule_event(lambda name=name: log.append(name), at=4, priority=priority)
    world.clock.at(4, lambda: log.append("clock"))
    world.run(4)
    assert log == ["highest", "high", "a", "b", "clock", "low", "lowest"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w: w.schedule_event(print), r"schedule_event\(at=None, after=None\): give one of at and after, as in after=10"),
        (lambda w: w.schedule_event(print, at=5, after=2), r"schedule_event\(at=5, after=2\): give one of"),
        (lambda w: w.schedule_event(print, at=1), r"time=1: has passed; it must be at least the present time, 2"),
        (lambda w: w.schedule_event(print, after=-1), r"after=-1.*at least 0"),
        (lambda w: w.schedule_event(print, after=float("nan")), r"after=nan: must be a finite number"),
        (lambda w: w.schedule_event(None, at=5), r"schedule_event\(None\): must be callable"),
        (lambda w: w.schedule_event(print, at=5, priority="high"), r"priority='high': must be a number"),
        (lambda w: w.schedule_recurring(5, 2), r"schedule_recurring\(5\): must be callable"),
        (lambda w: w.schedule_recurring(print, 1e-14), r"interval=1e-14.*at least 1e-06"),
        (lambda w: w.schedule_recurring(yielding, 2), r"planned call yielding yields, so it does nothing; start a process"),
        (lambda w: w.schedule_event(yielding, at=5), r"clock.process\(yielding\(\)\)"),
        (lambda w: w.schedule_recurring(print, 0), r"interval=0.*at least 1e-06"),
        (lambda w: w.schedule_recurring(print, -2.5), r"interval=-2.5.*at least 1e-06"),
        (lambda w: w.schedule_recurring(print, SimpleNamespace(interval=lambda model: 0)), r"interval=0.*at least 1e-06"),
        (lambda w: w.schedule_recurring(print, SimpleNamespace(interval=1, start=1)), r"time=1: has passed"),
        (lambda w: w.run_until(1), r"end_time=1: must be at least 2; reset\(\) goes back"),
        (lambda w: w.run_until(2.5), r"end_time=2.5: must be a whole number"),
        (lambda w: w.run_for(-1), r"steps=-1: must be at least 0"),
    ],
)
def test_wrong_calls_are_refused_and_plan_nothing(call: Any, message: str) -> None:
    world = CMOMMT(rng=1)
    world.run(2)
    with pytest.raises((TypeError, ValueError), match=message):
        call(world)
    assert (world.clock.pending, world.sources, world.tick) == ([], (), 2)


def test_mesas_simulator_advances_a_world_with_its_events() -> None:
    """Simulators are deprecated; they step the world, and their events are theirs: see docs/time.md."""
    from mesa.experimental.devs import ABMSimulator

    world, reference, log = CMOMMT(rng=1), CMOMMT(rng=1), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        simulator = ABMSimulator()
        simulator.setup(world)

        def note() -> None:
            log.append(world.tick)

        simulator.schedule_event_absolute(note, 4)
        world.schedule_event(lambda: log.append(("clock", world.tick)), at=6)
        simulator.run_until(10)
    reference.run(10)
    assert log == [4, ("clock", 6)]
    assert world.tick == 10
    assert (world.robots.position == reference.robots.position).all()
