"""Jobs for the tests of the crew: functions of a module, as spawned workers need them."""

from __future__ import annotations

import os
import signal
import time

from teamsight.analysis.crew import tell


def square(number: int) -> int:
    """Return the square, the later the smaller the number, so that results arrive out of order."""
    time.sleep(0.02 / (1 + number))
    return number * number


def fail_at_three(number: int) -> int:
    if number == 3:
        raise ValueError("delta=0: a ring needs at least 1 sector")
    return number


def die(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


def talk(number: int) -> int:
    tell(f"line {number}")
    return number


def process_of(number: int) -> int:
    time.sleep(0.05)
    return os.getpid()


def sleep_long(number: int) -> None:
    time.sleep(60)


def sleep_short(number: int) -> None:
    time.sleep(2)
