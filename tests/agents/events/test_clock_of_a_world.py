"""The clock of a world is a SimPy environment in step with its tick: SimPy's own classes work on it."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import pytest
import simpy

from teamsight import CMOMMT, Robot, World

PATHS: list[Callable[[World, int], Any]] = [
    lambda model, steps: model.run(steps),
    lambda model, steps: [model.step() for _ in range(steps)],
]
paths = pytest.mark.parametrize("advance", PATHS, ids=["run", "step"])


@pytest.mark.short
@paths
def test_a_resource_of_simpy_serves_processes_of_the_world(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []
    charger = simpy.Resource(model.clock, capacity=1)
    store = simpy.Store(model.clock)
    tank = simpy.Container(model.clock, capacity=10, init=4)

    def charge(name: str) -> Generator[Any, Any, None]:
        with charger.request() as place:
            yield place
            log.append((name, "begins", model.clock.now))
            yield model.clock.timeout(2.5)
        log.append((name, "ends", model.clock.now))
        yield store.put(name)
        yield tank.get(2)

    def boss() -> Generator[Any, Any, None]:
        for _ in range(2):
            log.append(((yield store.get()), "relayed", model.clock.now))
        yield simpy.AllOf(model.clock, [model.clock.timeout(1), simpy.Timeout(model.clock, 3)])
        log.append(("boss", "leaves", model.clock.now))

    advance(model, 3)
    for name in "ab":
        model.clock.process(charge(name))
    model.clock.process(boss())
    advance(model, 20)
    assert log == [
        ("a", "begins", 3), ("a", "ends", 5.5), ("b", "begins", 5.5), ("a", "relayed", 5.5), ("b", "ends", 8.0),
        ("b", "relayed", 8.0), ("boss", "leaves", 11.0),
    ]  # fmt: skip
    assert tank.level == 0


@pytest.mark.short
@paths
def test_the_clock_is_in_step_with_the_tick(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []
    assert isinstance(model.clock, simpy.Environment)
    for steps in (1, 4, 30):
        advance(model, steps)
        assert model.clock.now == model.clock.now == model.tick
    # A delay counts from now, not from the last event.
    simpy.Timeout(model.clock, 2).callbacks.append(lambda event: log.append(model.clock.now))
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
            model.clock.at(3, lambda: log.append((model.clock.now, model.tick)))
        return 0.0, 0.0

    model = CMOMMT(robots=1, policy=plan, rng=1)
    with pytest.warns(UserWarning, match="one by one"):
        model.run(6)
    assert log == [(3.0, 4)]
    assert model.clock.now == 6.0


def test_the_clock_cannot_be_run_without_the_world() -> None:
    model = CMOMMT(rng=1)
    with pytest.raises(TypeError, match=r"the clock advances with its world; call world\.run\(steps\)"):
        model.clock.run(until=5)
    assert model.clock.now == 0


def test_an_interrupted_process_goes_on_where_it_says() -> None:
    model, log = CMOMMT(rng=1), []

    def patrol() -> Generator[Any, Any, None]:
        try:
            yield model.clock.timeout(50)
        except simpy.Interrupt as interrupt:
            log.append((interrupt.cause, model.clock.now))

    process = model.clock.process(patrol())
    model.clock.at(7.25, lambda: process.interrupt("fog"))
    model.run(20)
    assert log == [("fog", 7.25)]


@pytest.mark.parametrize("again", ["reset", "restore"])
def test_a_resource_outlives_a_reset(again: str) -> None:
    model, log = CMOMMT(rng=1), []
    clock, charger = model.clock, simpy.Resource(model.clock)
    saved = model.state()
    model.clock.at(9, lambda: log.append("planned before"))
    model.run(5)
    model.reset() if again == "reset" else model.restore(saved)

    def charge() -> Generator[Any, Any, None]:
        with charger.request() as place:
            yield place
            log.append(model.clock.now)

    model.clock.process(charge())
    model.run(20)
    assert model.clock is clock
    assert log == [0]


@paths
def test_a_reset_in_an_event_keeps_the_counters_together(advance: Callable[[World, int], Any]) -> None:
    model = CMOMMT(rng=1)
    model.clock.at(2, model.reset)
    advance(model, 2)
    advance(model, 1)
    assert (model.tick, model.steps, model.clock.now, len(model.recording.history)) == (1, 1, 1, 1)
    other = CMOMMT(rng=1)
    other.run(1)
    assert model.recording.history.equals(other.recording.history)


@paths
@pytest.mark.parametrize("deed", ["run", "step"])
@pytest.mark.parametrize("where", ["event", "decide", "own step", "recorder"])
@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_the_world_does_not_advance_within_a_step(where: str, deed: str, advance: Callable[[World, int], Any]) -> None:
    def again(*anything: Any) -> tuple[float, float]:
        if model.tick == (3 if where == "recorder" else 2) and armed:
            model.run(1) if deed == "run" else model.step()
        return 0.0, 0.0

    class Impatient(Robot):
        def step(self) -> None:
            again()

    armed = [True]
    model = World(CMOMMT(rng=1).arena, rng=1)
    policy: Any = again if where == "decide" else "random-walk"
    model.add(Impatient if where == "own step" else Robot, 2, policy=policy)
    if where == "event":
        model.clock.at(2, again)
    if where == "recorder":
        model.recording.callbacks.append(again)
    with pytest.raises(RuntimeError, match=rf"{deed}\(\): called in .*{where}.*; call it between steps"):
        advance(model, 5)
    armed.clear()
    advance(model, 2)
    assert model.tick == model.steps == len(model.recording.history)


@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
@pytest.mark.parametrize(
    "deed",
    [
        lambda robot: robot.remove(), lambda robot: setattr(robot.group, "policy", "centroid"),
        lambda robot: robot.model.reset(), lambda robot: robot.model.restore(robot.model.state()),
    ],
)  # fmt: skip
def test_groups_do_not_change_while_they_decide(deed: Callable[[Any], Any]) -> None:
    class Fickle(Robot):
        def decide(self, percept: Any, rng: Any) -> tuple[float, float]:
            if self.model.tick == 2 and self.row == 1 and armed:
                deed(self)
            return super().decide(percept, rng)

    armed = [True]
    model = World(CMOMMT(rng=1).arena, rng=1)
    model.add(Fickle, 4, policy="a-cmommt", awareness="pairwise")
    with pytest.raises(RuntimeError, match=r"called in decide, before all agents have decided; plan it with world\.clock\.at"):
        model.run(5)
    armed.clear()
    model.run(3)
    assert model.tick == 5


@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_an_agent_that_another_has_removed_in_this_step_makes_none() -> None:
    made: list[int] = []

    class Ruthless(Robot):
        def step(self) -> None:
            made.append(self.unique_id)
            if self.row == 0 and len(self.group) > 1:
                self.group[1].remove()

    model = World(CMOMMT(rng=1).arena, rng=1)
    model.add(Ruthless, 3, policy="random-walk")
    model.run(1)
    assert made == [1, 3]


def test_what_only_the_world_may_do_to_its_clock() -> None:
    model = CMOMMT(rng=1)
    model.clock.timeout(5)
    with pytest.raises(TypeError, match=r"the clock advances with its world; call world\.step\(\)"):
        model.clock.step()
    with pytest.raises(ValueError, match="delay=nan: must be a finite number"):
        model.clock.schedule(model.clock.event(), delay=float("nan"))
    with pytest.raises(AttributeError):
        model.tick = 3  # type: ignore[misc]
    model.run(7)
    assert (model.tick, model.steps) == (7, 7)
