"""Events that lead to one another while the clock stands still end with an error that names them, not in a hang."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Generator
from typing import Any

import pytest

from teamsight.world import clock as clocks
from teamsight.world.clock import Clock

MOST = 500


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clocks, "_MOST_LINKS", MOST)


def waits(clock: Clock, event: Callable[[], Any]) -> None:
    def patrol() -> Generator[Any, Any, None]:
        while True:
            yield event()  # here

    clock.process(patrol())


@pytest.mark.short
@pytest.mark.parametrize(
    "event",
    [
        lambda clock: clock.timeout(0), lambda clock: clock.timeout(1e-300), lambda clock: clock.timeout(1e-12),
        lambda clock: clock.timeout(0) | clock.timeout(5), lambda clock: clock.event().succeed(),
        lambda clock: clock.timeout(0) & (clock.timeout(0) | clock.event()),
    ],
)  # fmt: skip
@pytest.mark.parametrize("tick", [0, 300])
def test_a_process_that_never_waits_receives_an_error_at_its_yield(event: Callable[[Clock], Any], tick: int) -> None:
    clock, log = Clock(), []
    clock.advance(tick)
    waits(clock, lambda: event(clock))
    clock.at(tick + 1, lambda: log.append(clock.now))
    with pytest.raises(RuntimeError, match=rf"process patrol: more than 500 events in a row at time {tick or ''}.*let time pass") as raised:
        clock.advance(tick + 5)
    assert traceback.extract_tb(raised.value.__traceback__)[-1].line == "yield event()  # here"
    # All others go on, without that process.
    assert clock.processes == []
    clock.advance(tick + 5)
    assert log == [tick + 1]


@pytest.mark.short
@pytest.mark.parametrize("delay", [0.0, 1e-13])
def test_a_call_that_plans_itself_at_once_is_named(delay: float) -> None:
    clock, log = Clock(), []

    def again() -> None:
        clock.at(clock.now + delay, again)

    clock.at(2, again)
    clock.at(3, lambda: log.append(clock.now))
    with pytest.raises(RuntimeError, match=r"the planned call test_a_call.*again: more than 500 events in a row at time 2"):
        clock.advance(4)
    clock.advance(4)
    assert log == [3]


def test_a_process_may_handle_the_error() -> None:
    clock, log = Clock(), []

    def patrol() -> Generator[Any, Any, None]:
        try:
            while True:
                yield clock.timeout(0)
        except RuntimeError:
            log.append(clock.now)
        yield clock.timeout(2)
        log.append(clock.now)

    clock.process(patrol())
    clock.advance(5)
    assert log == [0, 2]


@pytest.mark.short
def test_many_events_at_one_time_are_no_chain() -> None:
    clock, log = Clock(), []
    many = 10 * MOST

    def robot() -> Generator[Any, Any, None]:
        yield clock.timeout(0)
        yield clock.timeout(1)
        log.append(clock.now)

    for _ in range(many):
        clock.at(3, lambda: clock.process(robot()))
    clock.advance(5)
    assert log == [4] * many


def test_a_long_chain_in_which_time_passes_is_none() -> None:
    clock, beats = Clock(), []

    def beat() -> Generator[Any, Any, None]:
        while True:
            yield clock.timeout(1e-3)
            beats.append(clock.now)
            # Short chains of their own.
            for _ in range(3):
                yield clock.timeout(0)

    clock.process(beat())
    for tick in range(5):
        clock.advance(tick)
    assert len(beats) == pytest.approx(4000, abs=1)
