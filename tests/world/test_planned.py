"""Planned calls: at their times, in the order of planning, unless cancelled; what goes wrong stops at its event."""

from __future__ import annotations

import traceback
from collections.abc import Generator
from typing import Any

import pytest
import simpy
from hypothesis import given
from hypothesis import strategies as st

from teamsight.world.clock import Clock

operations = st.lists(
    st.one_of(
        st.tuples(st.just("plan"), st.one_of(st.integers(0, 6), st.floats(0, 6)), st.sampled_from([0.5, 1, 1.5])),
        st.tuples(st.just("cancel"), st.integers(0, 400), st.none()),
        st.tuples(st.just("advance"), st.integers(1, 3), st.none()),
    ),
    max_size=40,
)


@pytest.mark.short
@given(operations)
def test_calls_happen_as_in_a_sorted_list(plan: list[Any]) -> None:
    clock, happened = Clock(), []
    # The slow twin: (time, priority, number) of all calls to come, which is sorted for each advance.
    expected: list[tuple[float, float, int]] = []
    calls: list[Any] = []
    due: list[tuple[float, float, int]] = []
    tick = 0
    for kind, value, priority in [*plan, ("advance", 10, None)]:
        if kind == "plan":
            entry = (tick + value, priority, len(calls))
            calls.append((entry, clock.plan(tick + value, happened.append, entry, priority=priority)))
            expected.append(entry)
        elif kind == "cancel" and calls:
            entry, planned = calls[value % len(calls)]
            planned.cancel()
            expected = [one for one in expected if one != entry]
        elif kind == "advance":
            tick += value
            due += sorted(one for one in expected if one[0] <= tick + 1e-9)
            expected = [one for one in expected if one[0] > tick + 1e-9]
            clock.advance(tick)
            assert happened == due
            assert [(time, priority, event.arguments[0][2]) for time, priority, _, event in clock.pending] == sorted(expected)


def test_a_cancelled_call_does_not_interrupt_compiled_stretches_and_takes_no_memory() -> None:
    clock = Clock()
    kept = clock.at(500, lambda: None)
    for number in range(1000):
        clock.at(100 + number % 7, lambda: pytest.fail("was cancelled")).cancel()
    assert len(clock._queue) < 200
    assert clock.ticks_until_event(0) == 500
    kept.cancel()
    kept.cancel()
    assert clock.ticks_until_event(0) == float("inf")
    assert repr(kept) == "<<lambda>() planned at 500 (cancelled)>"
    assert not clock.advance(1000)


def test_a_call_that_has_happened_can_be_cancelled_without_effect() -> None:
    clock, log = Clock(), []
    planned = clock.at(1, lambda: log.append(1))
    clock.at(2, planned.cancel)
    clock.advance(3)
    assert (log, planned.is_cancelled) == ([1], False)


def test_a_process_waits_for_a_planned_call() -> None:
    clock, log = Clock(), []

    def wait() -> Generator[Any, Any, None]:
        yield clock.at(2.5, lambda: log.append("call"))
        log.append(clock.now)

    clock.process(wait())
    clock.advance(3)
    assert log == ["call", 2.5]


@pytest.mark.parametrize("value", [5, None, "request", [1]])
def test_a_process_that_yields_no_event_is_named_with_what_it_yielded_and_the_cure(value: Any) -> None:
    clock, log = Clock(), []

    def patrol() -> Generator[Any, Any, None]:
        yield clock.timeout(1.5)
        yield value  # here

    clock.process(patrol())
    clock.at(1.7, lambda: log.append(clock.now))
    with pytest.raises(TypeError, match=r"process patrol: Invalid yield value .*, which is no event; yield one, such as world.clock") as raised:
        clock.advance(3)
    # As in SimPy.
    assert isinstance(raised.value, RuntimeError)
    assert f'Invalid yield value "{value!r}", which' in str(raised.value)
    frames = traceback.extract_tb(raised.value.__traceback__)
    assert frames[-1].line == "yield value  # here"
    assert clock.active_process is None
    assert clock.processes == []
    clock.advance(3)
    assert log == [1.7]


def test_a_process_may_handle_its_bad_yield_and_an_interrupt_too() -> None:
    clock, log = Clock(), []

    def patrol() -> Generator[Any, Any, None]:
        try:
            yield 7
        except TypeError:
            log.append("handled")
        try:
            yield clock.timeout(10)
        except simpy.Interrupt:
            yield "nothing"

    process = clock.process(patrol())
    clock.at(2, process.interrupt)
    clock.advance(1)
    assert log == ["handled"]
    with pytest.raises(TypeError, match=r"yield value \"'nothing'\""):
        clock.advance(2)


class OddError(Exception):
    """An exception that cannot be made from its own arguments, of which SimPy makes a copy."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(f"{code}: {reason}")


def test_an_exception_in_a_process_keeps_its_type_and_traceback() -> None:
    clock = Clock()

    def broken() -> Generator[Any, Any, None]:
        yield clock.timeout(1)
        raise OddError(3, "flat battery")

    clock.process(broken())
    with pytest.raises(OddError, match="3: flat battery") as raised:
        clock.advance(2)
    assert traceback.extract_tb(raised.value.__traceback__)[-1].line == 'raise OddError(3, "flat battery")'
    assert raised.value.__cause__ is None


def test_what_waited_for_a_call_that_fails_goes_on() -> None:
    clock, log = Clock(), []
    planned = clock.at(1, lambda: 1 / 0)

    def wait() -> Generator[Any, Any, None]:
        yield planned
        log.append(clock.now)

    clock.process(wait())
    with pytest.raises(ZeroDivisionError):
        clock.advance(5)
    assert clock.now == 5
    clock.advance(5)
    assert log == [1]


def test_an_event_may_begin_another_run() -> None:
    clock, log = Clock(), []

    def again() -> None:
        clock.begin(0)
        clock.at(0, lambda: log.append(("at 0", clock.now)))
        clock.at(3, lambda: log.append(("at 3", clock.now)))

    clock.at(5, again)
    clock.at(5, lambda: pytest.fail("was dropped"))
    clock.advance(5)
    assert (log, clock.now) == ([("at 0", 0)], 0)
    clock.advance(3)
    assert log[1:] == [("at 3", 3)]


@pytest.mark.short
def test_an_event_of_another_clock_is_refused_at_its_yield() -> None:
    clock, other = Clock(), Clock()
    for event in (other.timeout(5), simpy.Environment().timeout(5), simpy.Resource(other).request()):

        def patrol(event: Any = event) -> Generator[Any, Any, None]:
            yield clock.timeout(1)
            yield event  # here

        clock.process(patrol())
        with pytest.raises(TypeError, match=r"process patrol: Invalid yield value \"<.*of another clock.*such as world.clock.timeout") as raised:
            clock.advance(int(clock.now) + 2)
        assert traceback.extract_tb(raised.value.__traceback__)[-1].line == "yield event  # here"
    assert clock.processes == []


@pytest.mark.short
def test_a_function_that_yields_is_not_planned() -> None:
    clock = Clock()

    def patrol() -> Generator[Any, Any, None]:
        yield clock.timeout(1)

    with pytest.raises(TypeError, match=r"call patrol yields, so it does nothing; start a process: clock.process\(patrol\(\)\)"):
        clock.at(3, patrol)
    assert not clock.pending
    clock.at(3, lambda: patrol())
    with pytest.raises(TypeError, match=r"the planned call <lambda> yields"):
        clock.advance(3)
    clock.at(4, lambda: clock.process(patrol()))
    clock.advance(6)


def test_a_generator_makes_one_process() -> None:
    clock, log = Clock(), []

    def patrol() -> Generator[Any, Any, None]:
        log.append(clock.now)
        yield clock.timeout(1)
        log.append(clock.now)

    generator = patrol()
    clock.process(generator)
    with pytest.raises(ValueError, match=r"a process of this generator was started already.*process\(patrol\(…\)\)"):
        clock.process(generator)
    clock.advance(3)
    assert log == [0, 1]
    with pytest.raises(ValueError, match="started already"):
        Clock().process(generator)


@pytest.mark.short
def test_a_process_in_which_the_clock_begins_again_ends_at_its_yield() -> None:
    clock, log = Clock(), []

    def boss() -> Generator[Any, Any, None]:
        try:
            yield clock.timeout(1)
            clock.begin(0)
            log.append("begun")
            yield clock.timeout(1)
            log.append("lives on")
        finally:
            log.append("tidied up")

    def assistant() -> Generator[Any, Any, None]:
        yield process
        log.append("continued")

    process = clock.process(boss())
    clock.process(assistant())
    clock.advance(2)
    for tick in range(6):
        clock.advance(tick)
    assert log == ["begun", "tidied up"]
    assert not process.is_alive
    assert clock.processes == []
