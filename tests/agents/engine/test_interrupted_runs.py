"""Ctrl-C and other exceptions in a run: the world is where its last completed step left it, and the run goes on."""

from __future__ import annotations

import _thread
import itertools
import signal
import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from chance import generator

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.agents.engine.engine import Engine
from teamsight.core.kernel import Entry
from teamsight.policies import Action, Policy
from teamsight.world import search

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


@pytest.fixture(autouse=True)
def heard() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt, also where the tests were started in the background, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def same(one: CMOMMT, other: CMOMMT) -> bool:
    """Whether two models are alike, to the last bit."""
    return bool(
        np.array_equal(one.robots.position, other.robots.position)
        and np.array_equal(one.targets.position, other.targets.position)
        and one.recording.history.equals(other.recording.history)
        and (one.tick, one.steps, one.clock.now) == (other.tick, other.steps, other.clock.now)
        and one.observed_fraction == other.observed_fraction
        and one.datacollector.get_model_vars_dataframe().equals(other.datacollector.get_model_vars_dataframe())
    )


@pytest.mark.short
def test_ctrl_c_in_a_compiled_run_leaves_whole_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    call, calls = Entry.__call__, []

    def interrupted(self: Entry, record: int) -> int:
        status = call(self, record)
        calls.append(self)
        if len(calls) % 3 == 0:
            # As Ctrl-C in the middle of the compiled loop: Python hears of it when the loop has returned.
            _thread.interrupt_main()
        return status

    model, other = CMOMMT(radius=2.0, rng=3), CMOMMT(radius=2.0, rng=3)
    other.run(400)
    monkeypatch.setattr(Entry, "__call__", interrupted)
    monkeypatch.setattr(Engine, "longest_call", 7)
    interrupts = 0
    while model.tick < 400:
        before = model.tick
        try:
            model.run(400 - model.tick)
        except KeyboardInterrupt:
            interrupts += 1
            assert model.tick > before or len(calls) < 4
            assert model.tick == model.steps == model.clock.now == len(model.recording.history)
            assert model.running
    monkeypatch.undo()
    assert interrupts > 10
    assert same(model, other)


def test_ctrl_c_at_any_call() -> None:
    model = CMOMMT(robots=40, targets=40, radius=6.0, rng=3)
    other = CMOMMT(robots=40, targets=40, radius=6.0, rng=3)
    random, interrupts = generator(), 0

    def interrupt_after(calls: int) -> Callable[[Any, str, Any], None]:
        left = itertools.count(calls, -1)

        def count(frame: object, event: str, argument: object) -> None:
            if next(left) == 0:
                signal.raise_signal(signal.SIGINT)

        return count

    for _ in range(60):
        try:
            # Python calls this at each call and return of a function.
            sys.setprofile(interrupt_after(int(random.integers(0, 150))))
            model.run(50)
        except KeyboardInterrupt:
            interrupts += 1
        finally:
            sys.setprofile(None)
    assert interrupts > 10
    other.run(model.tick)
    assert same(model, other)


@pytest.mark.parametrize("where", ["first", "second", "recorder", "own step"])
@pytest.mark.parametrize("path", ["run", "step"])
def test_an_exception_in_python_leaves_whole_steps(where: str, path: str) -> None:
    """Groups with kernels and without decide in one step; nobody may be one decision ahead."""
    fail = [False]

    class Counting(Policy):
        """Walks straight on, remembers how often, and fails when it is to."""

        draws = 0

        def __init__(self, name: str) -> None:
            self.name = name

        def start(self, size: int) -> Any:
            return np.zeros(size)

        def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
            if fail[0] and self.name == where:
                raise RuntimeError(where)
            return Action(percept.heading, percept.speed), memory + 1

    class Own(Robot):
        def step(self) -> None:
            if fail[0] and where == "own step" and self.row == 1:
                raise RuntimeError(where)

    def make() -> World:
        world = World(Disc(2.0), rng=2)
        robots = world.add(Own, 4, policy="a-cmommt", awareness="pairwise")
        first = world.add(Target, 3, policy=Counting("first"), speed=0.05, name="first")
        world.add(Target, 3, policy=Counting("second"), speed=0.05, name="second")
        world.senses(robots, first)
        return world

    def watch(world: World) -> None:
        if fail[0] and where == "recorder":
            raise RuntimeError(where)

    def advance(world: World, steps: int) -> None:
        world.run(steps) if path == "run" else [world.step() for _ in range(steps)]

    world, other = make(), make()
    world.recording.callbacks.append(watch)
    advance(world, 5)
    fail[0] = True
    for _ in range(3):
        with pytest.raises(RuntimeError, match=where):
            advance(world, 5)
    fail[0] = False
    # A recorder is called when the step has been made.
    made = 8 if where == "recorder" else 5
    assert (world.tick, world.steps, world.clock.now, len(world.recording.history)) == (made, made, made, made)
    advance(world, 12 - made)
    advance(other, 12)
    for mine, theirs in zip(world.groups, other.groups, strict=True):
        assert np.array_equal(mine.position, theirs.position)
    assert world.groups[1].policy_state.tolist() == other.groups[1].policy_state.tolist() == [12.0] * 3
    assert world.recording.history.equals(other.recording.history)


class Straight(Policy):
    """A NumPy policy that goes to the middle of what it senses and remembers how often it has decided."""

    draws = 0

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        counts = np.diff(percept.targets.start)
        owner = np.repeat(np.arange(len(counts)), counts)
        ways = np.stack([np.bincount(owner, percept.targets.offset[:, axis], len(counts)) for axis in (0, 1)], axis=-1)
        length = np.maximum(np.hypot(*ways.T), 1e-9)[:, None]
        return Action(ways / length, percept.speed * (1 + 0 * memory)), memory + 1


@pytest.mark.parametrize("policy", ["centroid", Straight()], ids=["kernel", "numpy"])
@pytest.mark.parametrize("awareness", ["pairwise", "shared"])
def test_when_memory_ends_in_the_middle_of_a_step(awareness: str, policy: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    settings: dict[str, Any] = {
        "robots": 60, "targets": 20, "radius": 8.0, "policy": policy, "awareness": awareness, "sensing_range": 20.0,
        "awareness_range": 1.5, "robot_speed": 0.4, "target_speed": 0.02, "rng": 3,
    }  # fmt: skip
    other = CMOMMT(**settings)
    monkeypatch.setattr(search, "first_room", lambda observers, observed: 1)
    model = CMOMMT(**settings)
    grow, failures = Engine._grow, [0]

    def no_memory(self: Engine, *arguments: int) -> None:
        failures[0] += 1
        if failures[0] % 2:
            raise MemoryError
        grow(self, *arguments)

    monkeypatch.setattr(Engine, "_grow", no_memory)
    while model.tick < 40:
        try:
            model.run(40 - model.tick)
        except MemoryError:
            assert len(model.recording.history) == model.tick == model.steps
    monkeypatch.undo()
    assert failures[0] >= 2
    other.run(40)
    assert same(model, other)
    if not isinstance(policy, str):
        assert model.robots.policy_state.tolist() == [40.0] * 60


def test_a_run_says_nothing_of_an_exception_that_is_over() -> None:
    model = CMOMMT(rng=1)
    model.clock.at(2, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        model.run(10)
    assert model.running
    model.run(10)
    assert model.tick == 12


def test_whoever_stops_a_model_stops_it() -> None:
    advances: list[Callable[[CMOMMT], Any]] = [
        lambda model: model.run(10), lambda model: [model.step() for _ in range(10) if model.running]
    ]  # fmt: skip
    for advance in advances:
        model = CMOMMT(rng=1)
        model.clock.at(4.5, lambda model=model: setattr(model, "running", False))
        advance(model)
        assert (model.tick, model.steps, model.clock.now, len(model.recording.history)) == (5, 5, 5.0, 5)
        assert len(model.datacollector.get_model_vars_dataframe()) == 6
        model.step()
        assert model.tick == 6
