"""What an event adds in mid-run takes effect at the same tick in `run` and in `step`, also if it needs Python."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import mesa
import numpy as np
import pytest

from teamsight import CMOMMT, Batteries, Cycle, Robot, World

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one", "ignore:.*DataCollector")

STEPS, WHEN = 24, 5


def half(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return 0.3, 0.5


class Stepping(Robot):
    def step(self) -> None:
        self.model.log("stepped", self)


class Deciding(Robot):
    def decide(self, percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        return 0.1, 0.7


def wait_for(event: Callable[[], Any]) -> Callable[[World], Any]:
    def add(world: World) -> None:
        def wait() -> Generator[Any, Any, None]:
            yield event_of(world)
            world.log("waited")

        event_of: Any = event
        world.clock.process(wait())

    return add


def add_collector(world: Any) -> None:
    world.recording.collector = mesa.DataCollector(model_reporters={"at": lambda model: model.tick})


#: What an event may add; each must show in what `seen` returns.
CHANGES: dict[str, Callable[[Any], Any]] = {
    "condition": wait_for(lambda world: world.until(lambda: world.tick >= 12)),  # type: ignore[misc]
    "condition on robots": wait_for(lambda world: world.until(lambda: world.robots[0].position[0] > 0)),  # type: ignore[misc]
    "observation": wait_for(lambda world: world.until.observed(world.targets[0])),  # type: ignore[misc]
    "policy in Python": lambda world: setattr(world.robots, "policy", half),
    "policy of one in Python": lambda world: setattr(world.robots[1], "policy", half),
    "compiled policy": lambda world: setattr(world.robots, "policy", "random-walk"),
    "recorder": lambda world: world.recording.callbacks.append(lambda world: world.log("recorded")),
    "collector": add_collector,
    "agents with step": lambda world: world.add(Stepping, 2, policy="random-walk", name="others"),
    "agents with decide": lambda world: world.add(Deciding, 2, name="others"),
    "cycle": lambda world: setattr(world.robots, "cycle", Cycle(3)),
    "inactive": lambda world: setattr(world.robots[0], "active", False),
    "agents": lambda world: world.robots.add(1),
    "batteries": lambda world: world.attach(Batteries(6.0, per_tick=1.0), world.robots),
    "mesa event": lambda world: world.schedule_event(lambda: world.log("later"), after=3.5),
}

#: How the event comes.
WAYS: dict[str, Callable[[Any, Callable[[], Any]], Any]] = {
    "clock": lambda world, act: world.clock.at(WHEN, act),
    "between ticks": lambda world, act: world.clock.at(WHEN - 0.5, act),
    "mesa": lambda world, act: world.schedule_event(act, at=WHEN),
    "before the first step": lambda world, act: world.schedule_event(act, at=0),
    "after an event of mesa": lambda world, act: (
        world.schedule_event(lambda: None, at=2), world.clock.at(WHEN, act)
    ),
    "recurring": lambda world, act: (
        world.schedule_recurring(lambda: world.tick == WHEN and act(), 1)
    ),
}  # fmt: skip


def seen(world: Any) -> tuple[Any, ...]:
    table = world.datacollector.get_model_vars_dataframe() if hasattr(world, "datacollector") else None
    return (
        world.tick, world.steps, world.events.to_json(), [group.position.tobytes() for group in world.groups],
        repr(world.observed_fraction), None if table is None else table.to_json(), world.path,
    )  # fmt: skip


def played(change: str, way: str, parts: list[int]) -> tuple[Any, ...]:
    """Return what is seen of a run in parts, in which 0 stands for a single step."""
    world = CMOMMT(robots=4, targets=4, radius=3.0, rng=1)
    WAYS[way](world, lambda: CHANGES[change](world))
    for part in parts:
        if part:
            world.run(part)
        else:
            world.step()
    return seen(world)


@pytest.mark.short
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("change", CHANGES)
def test_what_an_event_adds_is_the_same_in_run_and_step(change: str, way: str) -> None:
    stepped = played(change, way, [0] * STEPS)
    assert played(change, way, [STEPS]) == stepped
    assert played(change, way, [WHEN - 1, 0, STEPS - WHEN]) == stepped


def test_each_change_shows() -> None:
    """A change without effect would prove nothing."""
    plain = CMOMMT(robots=4, targets=4, radius=3.0, rng=1)
    plain.run(STEPS)
    for change in CHANGES:
        assert seen(plain) != played(change, "clock", [STEPS]), change
