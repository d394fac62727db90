"""Watchers: compiled code that looks at each step and can stop a run, with any division into calls."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from teamsight import CMOMMT, Box, Robot, World
from teamsight.agents.engine.records import Bound, Watcher
from teamsight.core.kernel import Entry, Packed, Record
from teamsight.world.motion import Move, move_at

Floats = npt.NDArray[np.float64]


class Odometer(NamedTuple):
    """The distance that each body of a group has covered, and the length at which it is reported."""

    move: Packed[Move]
    covered: Annotated[Floats, "n"]
    limit: Annotated[Floats, "n"]


ODOMETER = Record(Odometer)
odometer_at = ODOMETER.at


def _measure(address: int) -> int:
    odometer = odometer_at(address)
    moved = move_at(odometer.move).moved
    status = 0
    for i in range(odometer.covered.shape[0]):
        odometer.covered[i] += (moved[i, 0] ** 2 + moved[i, 1] ** 2) ** 0.5
        status += odometer.covered[i] >= odometer.limit[i]
    return status


MEASURE = Entry(_measure)


class Odometers(Watcher):
    """Reports each robot that has covered another unit of length."""

    entry = MEASURE

    def __init__(self, world: World, group: Any) -> None:
        self.world, self.group = world, group
        self.covered, self.limit = np.zeros(len(group)), np.ones(len(group))
        self.log: list[tuple[int, int]] = []
        self.binds = 0

    def bind(self, bound: Bound) -> None:
        self.binds += 1
        record = bound.group_records[bound.groups.index(self.group)]
        self.record = ODOMETER.pack(Odometer(record.value.move, self.covered, self.limit))

    def happened(self) -> None:
        for i in np.flatnonzero(self.covered >= self.limit):
            self.limit[i] += 1.0
            self.world.clock.at(self.world.clock.now, lambda i=int(i): self.log.append((self.world.tick, i)))


def watched(**given: Any) -> tuple[CMOMMT, Odometers]:
    model = CMOMMT(rng=3, **given)
    watcher = Odometers(model, model.robots)
    model._engine.watch(watcher)
    return model, watcher


def naive(model: CMOMMT, steps: int) -> list[tuple[int, int]]:
    """Return the same log from recorded motion."""
    covered, limit, log = np.zeros(len(model.robots)), np.ones(len(model.robots)), []
    for _ in range(steps):
        model.step()
        covered += np.sqrt(model.robots.bodies.moved[:, 0] ** 2 + model.robots.bodies.moved[:, 1] ** 2)
        for i in np.flatnonzero(covered >= limit):
            limit[i] += 1.0
            log.append((model.tick, int(i)))
    return [entry for entry in log if entry[0] < steps]


@pytest.mark.short
@pytest.mark.parametrize("division", [[60], [1] * 60, [7, 20, 1, 32], "step"])
def test_a_watcher_stops_the_run_at_the_same_steps_for_any_division_into_calls(division: Any) -> None:
    model, watcher = watched(robots=4, targets=3)
    if division == "step":
        for _ in range(60):
            model.step()
    else:
        for steps in division:
            model.run(steps)
    plain = CMOMMT(rng=3, robots=4, targets=3)
    assert watcher.log == naive(plain, 60) != []
    assert model.tick == model.steps == 60
    assert np.array_equal(model.robots.position, plain.robots.position)
    assert model.recording.history.equals(plain.recording.history)


@pytest.mark.short
def test_watchers_also_work_with_a_policy_in_python() -> None:
    def ahead(percept: Any, rng: Any) -> tuple[float, float]:
        return rng.uniform(-0.3, 0.3), 0.1

    model, watcher = watched(robots=4, targets=3, policy=ahead)
    with pytest.warns(UserWarning, match="policy of robots is Python"):
        model.run(40)
    assert watcher.log == naive(CMOMMT(rng=3, robots=4, targets=3, policy=ahead), 40) != []


def test_a_run_is_stopped_only_where_something_happens() -> None:
    model, watcher = watched(robots=4, targets=3)
    calls: list[int] = []
    run = model._engine.run
    model._engine.run = lambda steps: (run(steps), calls.append(model.tick))[0]  # type: ignore[method-assign]
    model.run(60)
    assert calls == sorted({tick for tick, _ in watcher.log} | {60})


def test_a_watcher_is_bound_again_when_groups_change_and_ends_when_it_is_taken_off() -> None:
    world = World(Box(4, 4), rng=1)
    robots = world.add(Robot, 3, policy="random-walk")
    watcher = Odometers(world, robots)
    world._engine.watch(watcher)
    world.run(12)
    assert watcher.binds == 1
    world.add(Robot, 2, policy="stationary", name="others")
    world.run(12)
    assert watcher.binds == 2
    covered = watcher.covered.copy()
    assert (covered > 2.0).all()
    world._engine.unwatch(watcher)
    world.run(12)
    assert np.array_equal(watcher.covered, covered)
    assert world.tick == 36


def test_a_reset_in_the_same_arrays_binds_watchers_again() -> None:
    model, watcher = watched(robots=4, targets=3)
    model.run(30)
    before = watcher.log
    watcher.covered, watcher.limit, watcher.log = np.zeros(4), np.ones(4), []
    model.reset()
    model.run(30)
    assert watcher.log == before != []


class Ticker(Watcher):
    """Writes down at which ticks it is called."""

    def __init__(self, moment: npt.NDArray[np.int64], *, sees_changes: bool) -> None:
        self.ticks, self.moment, self.sees_changes = np.zeros(50, np.int64), moment, sees_changes

    def bind(self, bound: Bound) -> None:
        self.record = TICKS.pack(Ticks(bound.moment, self.ticks))

    def happened(self) -> None:
        raise AssertionError("it never stops a run")


class Ticks(NamedTuple):
    """How often it was called at each tick."""

    moment: Annotated[npt.NDArray[np.int64], 1]
    calls: Annotated[npt.NDArray[np.int64], 50]


TICKS = Record(Ticks)
ticks_at = TICKS.at


def _count(address: int) -> int:
    ticks = ticks_at(address)
    ticks.calls[ticks.moment[0]] += 1
    return 0


Ticker.entry = Entry(_count)


@pytest.mark.short
@pytest.mark.parametrize("sees_changes", [False, True])
def test_a_watcher_that_sees_changes_is_called_before_a_step_too_if_something_changed(sees_changes: bool) -> None:
    model = CMOMMT(rng=1, robots=3, targets=3)
    ticker = Ticker(model._data.moment, sees_changes=sees_changes)
    model._engine.watch(ticker)
    model.clock.at(4, lambda: setattr(model.robots[0], "position", (0, 0)))
    model.clock.at(5, lambda: None)
    model.run(6)
    model.step()
    model.run(2)
    # Once after each step; before the first, and once more where a robot was moved.
    extra = [1, 0, 0, 0, 1, 0, 0, 0, 0, 0] if sees_changes else [0] * 10
    assert ticker.ticks[:10].tolist() == (np.array([0] + [1] * 9) + extra).tolist()
