"""Event sources: what they plan happens at its time, and again in each run."""

from __future__ import annotations

import pickle
from typing import Any

import pytest

from teamsight import CMOMMT
from teamsight.agents.events import EventSource


class Blinking(EventSource):
    """Each agent blinks at random times."""

    def __init__(self, interval: float = 5.0) -> None:
        self.interval = interval

    def begin(self) -> None:
        self.blinks = 0
        for member in self.members:
            self.joined(self.agent(member), member)

    def joined(self, agent: Any, member: int) -> None:
        self.plan(self.now + 2 * self.interval * self.random(member, 0), "blink", member, 1)

    def blink(self, member: int, index: int) -> None:
        agent = self.agent(member)
        if agent is None:
            return
        self.blinks += 1
        self.log("blinked", agent, index=index)
        self.plan(self.now + 2 * self.interval * self.random(member, index), "blink", member, index + 1)

    def save(self) -> Any:
        return self.blinks

    def load(self, data: Any) -> None:
        self.blinks = data


@pytest.mark.short
@pytest.mark.parametrize("path", ["run", "step"])
def test_a_source_plans_logs_and_begins_again(path: str) -> None:
    world = CMOMMT(robots=4, targets=3, rng=1)
    source = Blinking()
    blinking = world.attach(source, world.robots)
    assert world.sources == (blinking,)
    assert (blinking.number, blinking.interval, source.is_attached) == (1, 5.0, False)
    world.run(60) if path == "run" else [world.step() for _ in range(60)]
    first = world.events
    assert blinking.blinks == len(first) > 30
    assert (first["what"] == "blinked").all()
    assert first["time"].is_monotonic_increasing
    assert ((first["tick"] >= first["time"]) & (first["tick"] < first["time"] + 1)).all()
    world.reset()
    assert len(world.events) == 0
    world.run(60)
    assert world.events.equals(first)
    world.detach(blinking)
    world.run(60)
    assert world.events.equals(first)


def test_an_unattached_source_is_a_value() -> None:
    source = pickle.loads(pickle.dumps(Blinking(3.0)))
    assert repr(source) == "Blinking(interval=3.0)"


@pytest.mark.short
def test_a_state_holds_sources_and_goes_on_with_the_same_bits() -> None:
    def made(seed: int) -> tuple[CMOMMT, Any]:
        world = CMOMMT(robots=4, targets=3, rng=seed)
        return world, world.attach(Blinking(3.0), world.robots)

    straight, _ = made(1)
    straight.run(80)
    world, source = made(1)
    world.run(33)
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(10)
    later = world.attach(Blinking(1.0), world.targets)
    world.detach(source)
    world.run(10)
    other, _ = made(9)
    other.run(5)
    for one in (world, other):
        one.restore(saved)
        assert [source.number for source in one.sources] == [1]
        one.run(47)
        assert one.events.equals(straight.events)
        assert (one.robots.position == straight.robots.position).all()
    assert later not in world.sources


@pytest.mark.short
@pytest.mark.parametrize("how", ["planned", "when"])
def test_a_method_that_yields_is_refused_when_it_is_called(how: str) -> None:
    class Yielding(EventSource):
        needs_group = False

        def begin(self) -> None:
            if how == "planned":
                self.plan(2, "go")
            else:
                self.when(self.clock.timeout(2), "go")

        def go(self) -> Any:
            yield self.clock.timeout(1)

    world = CMOMMT(rng=1)
    world.attach(Yielding())
    with pytest.raises(TypeError, match=r"the planned call go yields, so it does nothing; start a process"):
        world.run(5)
    assert world.tick == 2
