"""Making one job: its result, or why there is none."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Callable, Hashable, Iterator
from typing import Any, Literal

Attempted = tuple[Literal["done", "failed"], Any]


def attempt(function: Callable[[Any], Any], job: Any, errors: type[BaseException] = Exception) -> Attempted:
    """Make a job: return "done" with its result, or "failed" with an error and its traceback.

    Parameters
    ----------
    function, job : callable, object
        What to call, and with what.
    errors : type
        Which exceptions are failures of the job. Where a job must not end the process, that is every one.
    """
    try:
        return "done", function(job)
    except errors as error:
        return "failed", (str(error) or type(error).__name__, f"\n{traceback.format_exc()}")


def _drop(text: str) -> None:
    pass


_emit: Callable[[str], None] = _drop


def emit(text: str) -> None:
    """Send a message from within a job to the process that owns the executor."""
    _emit(text)


def _forget(part: object, done: int) -> None:
    pass


_advance: Callable[[Hashable, int], None] = _forget


def advance(part: Hashable, done: int) -> None:
    """Report from within a job how much of it is done, to the process that owns the executor.

    Parameters
    ----------
    part : hashable
        What is being made; a later report about the same replaces this one. It can be pickled.
    done : int
        How much of it is done.
    """
    _advance(part, done)


@contextlib.contextmanager
def advancing(on_advance: Callable[[Hashable, int], None]) -> Iterator[None]:
    """Pass what jobs report within the block to a function; jobs on a cluster report nothing."""
    global _advance
    before, _advance = _advance, on_advance
    try:
        yield
    finally:
        _advance = before


def receiver() -> Callable[[str], None]:
    """Return what receives the messages that are emitted now."""
    return _emit


@contextlib.contextmanager
def emitting(on_message: Callable[[str], None]) -> Iterator[None]:
    """Pass messages that are emitted within the block to a function."""
    global _emit
    before, _emit = _emit, on_message
    try:
        yield
    finally:
        _emit = before
