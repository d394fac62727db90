"""A state holds what is planned, and all worlds that it is restored in have the same future."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import simpy

from teamsight import CMOMMT, EventSource
from tests.agents.events.charging_source import Charging, Rainy, rainy

ROOT = Path(__file__).resolve().parents[3]


def future(world: CMOMMT, steps: int) -> tuple[Any, ...]:
    """Return all that the next steps lead to."""
    world.run(steps)
    return (
        world.tick, world.events.to_json(), world.robots.position.tobytes(), world.observed_fraction,
        [(time, priority, repr(event)) for time, priority, _, event in world.clock.pending],
    )  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize("tick", [0, 3, 10, 24, 42])
def test_the_same_future_in_the_same_world_and_in_one_built_in_the_same_way(tick: int) -> None:
    straight, world, other = rainy(1), rainy(1), rainy(5)
    expected = future(straight, 60)
    world.run(tick)
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(9)
    other.run(17)
    for one in (world, other):
        one.restore(saved)
        again = one.state().events
        assert (again.calls, again.sources) == (saved.events.calls, saved.events.sources)
        assert future(one, 60 - tick) == expected
    world.restore(saved)
    assert future(world, 60 - tick) == expected


def test_a_state_within_an_event_is_that_of_the_moment_after_it() -> None:
    """Several events of one tick: what has not happened yet is saved with its place."""
    straight, world = rainy(1), rainy(1)
    saved: list[Any] = []
    for one in (straight, world):
        one.run(20)
    times = sorted({time for time, *_ in world.clock.pending if time <= 24})
    # Before the others of its time.
    world.clock.plan(times[0], lambda: saved.append(world.state()), priority=0.5)
    world.run(10)
    world.restore(saved[0])
    assert future(world, 60 - world.tick) == future(straight, 40)


def test_the_same_future_in_another_process(tmp_path: Path) -> None:
    world = rainy(1)
    world.run(23)
    (tmp_path / "state").write_bytes(pickle.dumps(world.state()))
    code = (
        "import pickle, sys; from tests.agents.events.charging_source import rainy; world = rainy(8);"
        "world.restore(pickle.load(open(sys.argv[1], 'rb'))); world.run(30); world.events.to_parquet(sys.argv[2])"
    )
    arguments = [sys.executable, "-c", code, str(tmp_path / "state"), str(tmp_path / "log")]
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    world.run(30)
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "log"), world.events)


def waiting(world: CMOMMT) -> Generator[Any, Any, None]:
    yield simpy.Event(world.clock)


@pytest.mark.short
@pytest.mark.parametrize(
    ("plan", "message"),
    [
        (lambda w: w.clock.at(5, lambda: None), r"state\(\): the call of .*<lambda> is planned at 5, and a function cannot be saved; plan a method of the world or of an agent, or use an EventSource; state\(pending='drop'\)"),
        (lambda w: w.clock.process(waiting(w)), r"state\(\): the process waiting has not ended, and a running generator cannot be saved; state\(pending='drop'\)"),
        (lambda w: w.schedule_event(print, at=5), r"the call of print is planned at 5"),
        (lambda w: simpy.Timeout(w.clock, 3).callbacks.append(print), r"the call of print is planned at 3"),
        (lambda w: w.clock.at(3, CMOMMT(rng=3).robots[0].remove), r"the call of Body.remove is planned at 3"),
    ],
)
def test_what_cannot_be_saved_is_refused_or_dropped(plan: Any, message: str) -> None:
    world, reference = rainy(1), rainy(1)
    holder = plan(world)
    with pytest.raises(TypeError, match=message):
        world.state()
    world.restore(world.state(pending="drop"))
    assert future(world, 30) == future(reference, 30)
    del holder


def test_what_has_no_effect_is_no_reason_to_refuse() -> None:
    world = CMOMMT(rng=1)
    world.clock.timeout(50)
    world.clock.at(5, lambda: None).cancel()
    process = world.clock.process(iter_once(world))
    world.run(3)
    assert not process.is_alive
    world.restore(world.state())


def iter_once(world: CMOMMT) -> Generator[Any, Any, None]:
    yield world.clock.timeout(1)


def test_other_words_for_pending_are_refused() -> None:
    with pytest.raises(ValueError, match=r"pending='save': unknown; known are drop, keep"):
        CMOMMT(rng=1).state(pending="save")  # type: ignore[arg-type]


class Slow(Charging):
    """A source of another class."""


@pytest.mark.parametrize(
    ("attach", "message"),
    [
        (lambda w: None, r"restore\(…\): the state is of a world whose source 1 is Charging\(\), and here it is none; restore it in a world to which the same sources are attached in the same order"),
        (lambda w: w.attach(Slow(), w.robots), r"source 1 is Charging\(\), and here it is Slow\(\)"),
        (lambda w: w.attach(Charging(), w.targets), r"source 1 is Charging\(\), and here it is Charging\(\)"),
    ],
)
def test_a_state_is_refused_by_a_world_with_other_sources(attach: Any, message: str) -> None:
    world, other = CMOMMT(rng=1), CMOMMT(rng=2)
    world.attach(Charging(), world.robots)
    attach(other)
    other.run(3)
    before = other.robots.position.copy()
    with pytest.raises(ValueError, match=message):
        other.restore(world.state())
    assert (other.tick, before.tolist()) == (3, other.robots.position.tolist())


def test_a_reset_world_with_sources_is_a_new_one() -> None:
    world = rainy(1)
    world.run(33)
    world.reset(4)
    new = rainy(4)
    for one in (world, new):
        # What the user planned with a function or a method does not outlive a reset; sources do.
        one.clock.begin(0)
        one._data.sources.begin()
    assert future(world, 40) == future(new, 40)


def test_agents_that_come_after_a_restored_state_are_the_same() -> None:
    class Arriving(EventSource):
        def begin(self) -> None:
            self.plan(5, "arrive", 1)

        def arrive(self, index: int) -> None:
            self.group.add(1)  # type: ignore[union-attr]
            self.plan(self.now + 4 * self.random(0, index), "arrive", index + 1)

    straight, world = CMOMMT(rng=1), CMOMMT(rng=1)
    for one in (straight, world):
        one.attach(Arriving(), one.robots)
    expected = future(straight, 40)
    world.run(12)
    saved = world.state()
    world.run(20)
    world.restore(saved)
    assert future(world, 28) == expected


def test_a_log_is_copied_with_its_state() -> None:
    world = Rainy(rng=1)
    world.run(10)
    saved = world.state()
    rows = len(world.events)
    world.run(30)
    assert len(saved.events.log.rows) == rows < len(world.events)
