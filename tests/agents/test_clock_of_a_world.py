"""The clock of a world is a SimPy environment in step with its tick: SimPy's own classes work on it."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import pytest
import simpy

from teamsight import CMOMMT, World

ROADS: list[Callable[[World, int], Any]] = [
    lambda model, steps: model.run(steps),
    lambda model, steps: [model.step() for _ in range(steps)],
]
roads = pytest.mark.parametrize("advance", ROADS, ids=["run", "step"])


@pytest.mark.short
@roads
def test_a_resource_of_simpy_serves_processes_of_the_world(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []
    charger = simpy.Resource(model.clock, capacity=1)
    store = simpy.Store(model.clock)
    tank = simpy.Container(model.clock, capacity=10, init=4)

    def charge(name: str) -> Generator[Any, Any, None]:
        with charger.request() as place:
            yield place
            log.append((name, "begins", model.now))
            yield model.clock.timeout(2.5)
        log.append((name, "ends", model.now))
        yield store.put(name)
        yield tank.get(2)

    def boss() -> Generator[Any, Any, None]:
        for _ in range(2):
            log.append(((yield store.get()), "reports", model.now))
        yield simpy.AllOf(model.clock, [model.clock.timeout(1), simpy.Timeout(model.clock, 3)])
        log.append(("boss", "leaves", model.clock.now))

    advance(model, 3)
    for name in "ab":
        model.process(charge(name))
    model.clock.process(boss())
    advance(model, 20)
    assert log == [
        ("a", "begins", 3), ("a", "ends", 5.5), ("b", "begins", 5.5), ("a", "reports", 5.5), ("b", "ends", 8.0),
        ("b", "reports", 8.0), ("boss", "leaves", 11.0),
    ]  # fmt: skip
    assert tank.level == 0


@pytest.mark.short
@roads
def test_the_clock_is_in_step_with_the_tick(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []
    assert isinstance(model.clock, simpy.Environment)
    for steps in (1, 4, 30):
        advance(model, steps)
        assert model.clock.now == model.now == model.tick
    # A delay counts from now, not from the last event.
    simpy.Timeout(model.clock, 2).callbacks.append(lambda event: log.append(model.now))
    advance(model, 2)
    assert log == []
    advance(model, 1)
    assert log == [37]
    saved = model.state()
    model.reset()
    assert model.clock.now == 0
    model.restore(saved)
    assert model.clock.now == 38


def test_what_python_plans_within_a_step_happens_before_the_next() -> None:
    log: list[tuple[float, int]] = []

    def plan(percept: Any, rng: Any) -> tuple[float, float]:
        if model.tick == 3 and not log:
            model.at(3, lambda: log.append((model.now, model.tick)))
        return 0.0, 0.0

    model = CMOMMT(robots=1, policy=plan, rng=1)
    with pytest.warns(UserWarning, match="one by one"):
        model.run(6)
    assert log == [(3.0, 4)]
    assert model.now == 6.0


def test_the_clock_cannot_be_run_without_the_world() -> None:
    model = CMOMMT(rng=1)
    with pytest.raises(TypeError, match=r"the world drives its clock; call world\.run\(steps\)"):
        model.clock.run(until=5)
    assert model.now == 0


def test_an_interrupted_process_goes_on_where_it_says() -> None:
    model, log = CMOMMT(rng=1), []

    def patrol() -> Generator[Any, Any, None]:
        try:
            yield model.timeout(50)
        except simpy.Interrupt as interrupt:
            log.append((interrupt.cause, model.now))

    process = model.process(patrol())
    model.at(7.25, lambda: process.interrupt("fog"))
    model.run(20)
    assert log == [("fog", 7.25)]
