"""Sources that plan and cancel at random: however a run is divided, saved and restored, its events are the same."""

from __future__ import annotations

import pickle
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, EventSource

STEPS = 24


class Restless(EventSource):
    """Plans calls of two kinds, some of whole times, cancels some, and changes the world."""

    def begin(self) -> None:
        self.planned: dict[int, Any] = {}
        self.plan(0, "act", 0)

    def act(self, index: int) -> None:
        self.log("acts", self.world.robots[index % len(self.world.robots)], index=index)
        draws = [self.random(index, channel) for channel in range(4)]
        number = int(4 * draws[0])
        if number in self.planned:
            self.cancel(self.planned.pop(number))
        later = self.now + 5 * draws[1]
        self.planned[number] = self.plan(round(later) if draws[2] < 0.5 and round(later) >= self.now else later, "move", number)
        self.plan(self.now + 0.1 + 1.5 * draws[3], "act", index + 1)

    def move(self, number: int) -> None:
        self.planned.pop(number, None)
        robot = self.world.robots[number % len(self.world.robots)]
        self.log("moves", robot, number=number)
        robot.speed = 0.02 * (number + 1)
        robot.active = not robot.active

    def load(self, data: Any) -> None:
        self.planned = {one.arguments[0]: one for one in self.pending("move")}


def bits(world: CMOMMT) -> tuple[Any, ...]:
    return world.tick, world.events.to_json(), world.robots.position.tobytes(), repr(world.observed_fraction)


def made(seed: int) -> CMOMMT:
    world = CMOMMT(robots=4, targets=3, rng=seed)
    world.attach(Restless(), world.robots)
    return world


EXPECTED: dict[int, Any] = {}


@pytest.mark.short
@settings(deadline=None, max_examples=15)
@given(
    st.integers(0, 3),
    st.lists(st.tuples(st.sampled_from(["run", "step", "save", "other", "reset"]), st.integers(1, 9)), max_size=8),
)
def test_however_a_run_is_divided_its_events_are_the_same(seed: int, parts: list[tuple[str, int]]) -> None:
    if seed not in EXPECTED:
        straight = made(seed)
        straight.run(STEPS)
        EXPECTED[seed] = bits(straight)
    world = made(seed)
    for kind, number in parts:
        number = min(number, STEPS - world.tick)
        if kind == "run":
            world.run(number)
        elif kind == "step":
            for _ in range(number):
                world.step()
        elif kind == "reset":
            world.reset()
        else:
            saved = pickle.dumps(world.state())
            if kind == "other":
                world = made(seed + 10)
            world.run(number)
            world.restore(pickle.loads(saved))
    world.run(STEPS - world.tick)
    assert bits(world) == EXPECTED[seed]
