"""The clock: events at their times, in order, and exactly before the step that they precede."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teamsight.world.clock import Clock

times = st.lists(st.one_of(st.integers(0, 12), st.floats(0, 12)), max_size=12)


@pytest.mark.short
@given(times)
def test_each_event_happens_once_before_the_step_at_the_next_whole_tick(planned: list[float]) -> None:
    clock, log = Clock(), []
    for time in planned:
        clock.at(time, lambda time=time: log.append((time, clock.now, tick)))
    for tick in range(14):
        due = [time for time in planned if math.ceil(time - 1e-9) == tick]
        assert (clock.ticks_until_event(tick) == 0) == bool(due)
        assert clock.advance(tick) == bool(due)
    assert len(log) == len(planned)
    assert [time for time, _, _ in log] == sorted(planned)
    for time, now, when in log:
        assert now == pytest.approx(time, abs=1e-9)
        assert when == math.ceil(time - 1e-9)


@given(times)
def test_the_time_to_the_next_event_is_exact(planned: list[float]) -> None:
    clock = Clock()
    for time in planned:
        clock.at(time, lambda: None)
    expected = max(math.ceil(min(planned) - 1e-9), 0) if planned else math.inf
    assert clock.ticks_until_event(0) == expected


def test_small_delays_do_not_drift_past_a_whole_tick() -> None:
    clock, beats = Clock(), []

    def beat() -> Generator[Any, Any, None]:
        while True:
            yield clock.timeout(0.1)
            beats.append(clock.now)

    clock.process(beat())
    for tick in range(31):
        clock.advance(tick)
    assert len(beats) == 300


def test_catching_up_leaves_later_events_alone_and_lets_delays_count_from_there() -> None:
    clock, log = Clock(), []
    clock.at(10, lambda: log.append(clock.now))
    clock.advance(3)
    assert clock.now == 3
    clock.process(iter_once(clock, 2, log))
    clock.advance(4)
    assert log == []
    clock.advance(5)
    assert log == [5]
    clock.advance(10)
    assert log == [5, 10]


def iter_once(clock: Clock, delay: float, log: list[float]) -> Generator[Any, Any, None]:
    yield clock.timeout(delay)
    log.append(clock.now)


def test_an_event_may_plan_another_at_the_same_time() -> None:
    clock, log = Clock(), []
    clock.at(2, lambda: clock.at(2, lambda: log.append(clock.now)))
    assert clock.advance(2)
    assert log == [2]


@pytest.mark.short
def test_whole_numbers_stay_whole_as_in_simpy() -> None:
    clock, log = Clock(), []
    clock.at(2, lambda: log.append(clock.now))
    clock.at(np.int64(4), lambda: log.append(clock.now))
    clock.process(iter_once(clock, 6, log))
    clock.process(iter_once(clock, 6.5, log))
    clock.advance(7)
    assert repr(log) == "[2, 4, 6, 6.5]"
    assert str(clock.timeout(1)).startswith("<Timeout(1) ")
    with pytest.raises(ValueError, match=r"time=.*: must be a finite number"):
        clock.at(10**400, print)


def test_errors_are_also_those_of_simpy() -> None:
    clock = Clock()
    for wrong in (print, None, 5):
        with pytest.raises(ValueError, match="is not a generator; call the function that yields") as raised:
            clock.process(wrong)  # type: ignore[arg-type]
        assert isinstance(raised.value, TypeError)
    for wrong in (-1, -0.5):
        with pytest.raises(ValueError, match=f"Negative delay {wrong}: delay must be at least 0"):
            clock.timeout(wrong)
    with pytest.raises(ValueError, match="delay=inf: must be a finite number"):
        clock.timeout(math.inf)


@pytest.mark.parametrize("time", [-1, 1.5, math.nan, math.inf])
def test_the_past_and_times_that_are_none_are_refused(time: float) -> None:
    clock = Clock()
    clock.advance(2)
    with pytest.raises(ValueError, match=r"time=.*: (has passed; it must be at least the present time, 2|must be a finite number)"):
        clock.at(time, print)


def test_what_cannot_be_called_is_refused() -> None:
    with pytest.raises(TypeError, match=r"at\(1, 5\): the second argument must be callable"):
        Clock().at(1, 5)  # type: ignore[arg-type]


def test_a_time_that_is_no_number_is_named() -> None:
    with pytest.raises(TypeError, match=r"time='3': must be a number"):
        Clock().at("3", print)  # type: ignore[arg-type]
