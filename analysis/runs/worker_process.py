"""One worker process: as the pool sees it, and what runs in it."""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Iterator
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any

from teamsight.analysis.runs.attempt import advancing, attempt, emitting
from teamsight.core.kernel import cache as cache_folder


class WorkerProcess:
    """A worker process that makes one job after the other.

    Parameters
    ----------
    context : SpawnContext
        How the process is started.
    imports : tuple of str
        Modules that it imports before its first job.
    folder : path or None
        Folder of compiled kernels; None for that of the environment.

    Attributes
    ----------
    process : BaseProcess
        The process.
    pipe : Connection
        Where its answers arrive; closed at the other end when it is dead.
    is_ready : bool
        Whether it has started.
    job : int or None
        Number of the job in its hands.
    """

    def __init__(self, context: SpawnContext, imports: tuple[str, ...], folder: Path | None) -> None:
        self.is_ready = False
        self.job: int | None = None
        self.pipe, there = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(there, imports, folder), daemon=True)
        try:
            self.process.start()
        except BaseException:
            self.pipe.close()
            raise
        finally:
            there.close()

    def give(self, job: int, message: bytes) -> bool:
        """Send a job; return whether the worker was there to receive it."""
        # First, so that after an interrupt while it is sent the worker is known to be busy.
        self.job = job
        try:
            self.pipe.send_bytes(message)
        except OSError:
            self.job = None
        return self.job is not None

    def answer(self) -> tuple[str, Any] | None:
        """Receive "ready", a message, a report or the outcome of the job; None if the worker is dead."""
        try:
            message = self.pipe.recv_bytes()
        except (EOFError, OSError):
            return None
        try:
            kind, value = pickle.loads(message)
        except Exception as error:
            # A result that can be pickled, but not unpickled here.
            return "unsent", said(error)
        return kind, value

    def dismiss(self) -> None:
        """Let the process end when it is idle, without waiting for it."""
        with contextlib.suppress(OSError):
            self.pipe.send_bytes(_END)

    def join(self) -> None:
        """Wait until the process has ended."""
        self.process.join()
        self.pipe.close()


# The message after the last job; those of jobs begin as a pickle does.
_END = b"end"


def packed(function: Any, job: Any) -> bytes:
    """Return the message that gives a job to a worker; raise an error of pickling if there is none."""
    return bytes(ForkingPickler.dumps((function, job)))


def said(error: Exception) -> str:
    """Return what an error says, or its name."""
    return str(error) or type(error).__name__


def _serve(pipe: Connection, imports: tuple[str, ...], folder: Path | None) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    if folder:
        os.environ[cache_folder.VARIABLE] = str(folder)
    for name in imports:
        # A failing import fails again within a job, where the error is reported.
        with contextlib.suppress(Exception):
            importlib.import_module(name)
    with (
        contextlib.suppress(EOFError, OSError),
        emitting(lambda text: pipe.send(("message", text))),
        advancing(lambda part, done: pipe.send(("advance", (part, done)))),
    ):
        pipe.send(("ready", None))
        while (message := pipe.recv_bytes()) != _END:
            outcome = _made(message)
            try:
                pipe.send(outcome)
            except OSError:
                raise
            except Exception as error:
                pipe.send(("unsent", said(error)))


def _made(message: bytes) -> tuple[str, Any]:
    """Return the outcome of the job in a message."""
    try:
        function, job = pickle.loads(message)
    except Exception as error:
        # A function that this process cannot import, such as one of a notebook.
        return "unsent", said(error)
    return attempt(function, job, BaseException)


def _end_with_parent() -> None:
    """End this process as soon as its parent has ended, also in the middle of a job.

    A parent that is killed cannot end its workers, and a worker reads its pipe only between two jobs.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


@contextlib.contextmanager
def interrupts_held() -> Iterator[None]:
    """Start processes within the block with Ctrl-C blocked: only this process receives it, and then ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        # The first start of a process also starts the resource tracker, which unblocks the signal.
        resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
