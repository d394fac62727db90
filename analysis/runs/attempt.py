"""What a worker process does: receive a job, make it, and return its result or why there is none."""

from __future__ import annotations

import multiprocessing
import os
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection, wait
from typing import Any


def attempt(function: Callable[[Any], Any], job: Any) -> tuple[str, Any]:
    """Make a job: return "done" with its result, or "failed" with an error and its traceback."""
    try:
        return "done", function(job)
    except Exception as error:
        return "failed", (str(error) or type(error).__name__, f"\n{traceback.format_exc()}")


def answer(pipe: Connection) -> tuple[str, Any] | None:
    """Wait for a job and return its outcome; None when there are no more."""
    try:
        message = pipe.recv()
    except (EOFError, OSError):
        raise
    except Exception as error:
        # A function that this process cannot import, such as one of a notebook.
        return "unsent", str(error)
    return None if message is None else attempt(*message)


def end_with_parent() -> None:
    """End this process as soon as its parent has ended, also in the middle of a job.

    A parent that is killed cannot end its workers, and a worker reads its pipe only between two jobs.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
