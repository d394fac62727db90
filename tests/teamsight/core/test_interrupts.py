"""A section that defers Ctrl-C: nothing is interrupted in the middle, and no interrupt is lost."""

from __future__ import annotations

import ctypes
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from teamsight.core.interrupts import deferred

pytestmark = pytest.mark.short

CALLBACK = ctypes.CFUNCTYPE(ctypes.c_int)


@pytest.fixture(autouse=True)
def default_handler() -> Iterator[None]:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt() -> None:
    signal.raise_signal(signal.SIGINT)


def test_the_block_is_completed_before_the_interrupt_is_raised() -> None:
    steps = []
    with pytest.raises(KeyboardInterrupt), deferred():
        interrupt()
        steps.append("the rest of the block")
    assert steps == ["the rest of the block"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_without_an_interrupt_nothing_happens_and_the_handler_is_the_one_before() -> None:
    with deferred():
        pass
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_in_a_callback_from_c_is_not_lost(capfd: pytest.CaptureFixture[str]) -> None:
    def call_back() -> int:
        interrupt()
        return 1

    with pytest.raises(KeyboardInterrupt), deferred():
        assert CALLBACK(call_back)() == 1
    assert "Exception ignored" not in capfd.readouterr().err


def test_an_interrupt_is_not_swallowed_by_a_broad_except() -> None:
    with pytest.raises(KeyboardInterrupt), deferred():
        try:
            interrupt()
        except BaseException:
            pytest.fail("raised in the middle of the block")


def test_the_interrupt_keeps_the_exception_of_the_block_as_its_context() -> None:
    with pytest.raises(KeyboardInterrupt) as caught, deferred():
        interrupt()
        raise ValueError("the block failed")
    assert isinstance(caught.value.__context__, ValueError)


def test_an_exception_of_the_block_passes_through() -> None:
    with pytest.raises(ValueError, match="the block failed"), deferred():
        raise ValueError("the block failed")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_nested_block_leaves_the_interrupt_to_the_outermost() -> None:
    steps = []
    with pytest.raises(KeyboardInterrupt), deferred():
        with deferred():
            interrupt()
        steps.append("after the inner block")
        with deferred():
            pass
        steps.append("after another")
    assert steps == ["after the inner block", "after another"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_two_interrupts_in_a_block_raise_one_and_the_next_block_begins_anew() -> None:
    with pytest.raises(KeyboardInterrupt), deferred():
        interrupt()
        interrupt()
    with deferred():
        pass
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt), deferred():
            interrupt()


def test_a_handler_of_the_program_is_called_once_at_the_end() -> None:
    calls: list[Any] = []

    def handler(*given: Any) -> None:
        calls.append(given)

    signal.signal(signal.SIGINT, handler)
    with deferred():
        interrupt()
        assert calls == []
    assert [number for number, _ in calls] == [signal.SIGINT]
    assert signal.getsignal(signal.SIGINT) is handler


def test_a_handler_that_is_installed_inside_the_block_stays() -> None:
    def handler(*given: Any) -> None:
        pass

    with deferred():
        signal.signal(signal.SIGINT, handler)
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.mark.parametrize("action", [signal.SIG_IGN, signal.SIG_DFL])
def test_where_python_does_not_handle_the_signal_nothing_changes(action: signal.Handlers) -> None:
    signal.signal(signal.SIGINT, action)
    with deferred():
        assert signal.getsignal(signal.SIGINT) is action


def test_another_thread_changes_nothing() -> None:
    seen: list[Any] = []

    def work() -> None:
        with deferred():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


HAMMER = """
import signal
from teamsight.core.interrupts import deferred

signal.signal(signal.SIGINT, signal.default_int_handler)
begun = whole = interrupts = 0
announced = -1
while interrupts < 300:
    try:
        while True:
            with deferred():
                begun += 1
                if announced < interrupts:
                    # From here on the other side sends the next.
                    announced = interrupts
                    print(interrupts, flush=True)
                whole += 1
    except KeyboardInterrupt:
        interrupts += 1
    assert begun == whole, (begun, whole)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
print("done", flush=True)
"""


def test_300_interrupts_at_any_moment_are_raised_and_never_in_the_middle() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HAMMER],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    )
    assert process.stdout is not None
    assert process.stderr is not None
    deadline = threading.Timer(1800, process.kill)  # a lost interrupt would leave both waiting
    deadline.start()
    for number in range(300):
        assert process.stdout.readline() == f"{number}\n", f"interrupt {number}: {process.stderr.read()}"
        process.send_signal(signal.SIGINT)
    assert (process.stdout.read(), process.stderr.read(), process.wait()) == ("done\n", "", 0)
    deadline.cancel()
