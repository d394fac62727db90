"""Jobs for the tests of the pool: functions of a module, as spawned workers need them."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from pathlib import Path

import numpy as np

from teamsight.analysis.runs.executor import advance, emit
from teamsight.core.kernel.cache import cache_folder


def square(number: int) -> int:
    """Return the square; the smaller the number the more work, so that results arrive out of order."""
    sum(range(1_000_000 // (1 + number)))
    return number * number


def fail_at_three(number: int) -> int:
    if number == 3:
        raise ValueError("delta=0: a ring needs at least 1 sector")
    return number


def die(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def die_of(array: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def environment_and_draws(number: int) -> tuple[dict[str, str], tuple[float, float]]:
    """Return the environment, and a number of the global generator of NumPy and of Python each."""
    sum(range(2_000_000))
    return dict(os.environ), (np.random.random(), random.random())  # noqa: NPY002


def cache_folder_of(number: int) -> str:
    sum(range(2_000_000))
    return str(cache_folder())


def talk(number: int) -> int:
    emit(f"line {number}")
    return number


def make_in_steps(number: int) -> int:
    for done in range(number):
        advance(number, done + 1)
    return number


def process_of(number: int) -> int:
    sum(range(2_000_000))
    return os.getpid()


def wait_for_ever(number: int) -> None:
    emit("begun")
    threading.Event().wait()


def spin(number: int) -> None:
    emit("begun")
    while True:
        pass


def fail_at_length(number: int) -> None:
    raise ValueError(
        f"number={number}: is wrong\n" + "for a reason that takes long to explain " * 40 + "(in the run rng=7)"
    )


def die_at_three(number: int) -> int:
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def slow(number: int) -> int:
    """Return the double, after more work than a scheduler needs to notice anything."""
    time.sleep(0.2)
    return 2 * number


def die_once(job: tuple[str, int]) -> int:
    """End the worker the first time, then return the square."""
    folder, number = job
    try:
        Path(folder, str(number)).touch(exist_ok=False)
    except FileExistsError:
        return number * number
    os.kill(os.getpid(), signal.SIGKILL)
    return -1


def end(how: str) -> str:
    """End the worker in one of several ways, or return what was given."""
    if how == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if how == "exit 0":
        os._exit(0)
    if how == "exit 1":
        os._exit(1)
    if how == "crash":
        signal.signal(signal.SIGSEGV, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGSEGV)
    return how


def leave(error: type[BaseException]) -> None:
    raise error("away")


class Odd:
    """Can be pickled, but not unpickled."""

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return refuse, (1,)


def refuse(number: int) -> None:
    raise OSError("this is no odd thing")


def return_odd(kind: str) -> object:
    return {"lambda": lambda: 1, "odd": Odd(), "plain": 1}[kind]


def echo(content: bytes) -> bytes:
    return content


def wait_unless(number: int) -> int:
    """Return 0 for 0, and wait for ever for any other number."""
    if number:
        threading.Event().wait()
    return number
