"""Jobs on their way through a Dask cluster."""

from __future__ import annotations

import contextlib
import pickle
import queue
import threading
import uuid
from collections import deque
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from teamsight.analysis.runs.attempt import attempt
from teamsight.analysis.runs.executor import ExecutorError, Outcome, shortened
from teamsight.analysis.runs.taken_jobs import TakenJobs
from teamsight.analysis.runs.worker_process import said

if TYPE_CHECKING:
    from distributed import Client, Future

# Jobs that each worker has at most: one that it makes, and one that it makes next.
_EACH = 2
# Seconds after which a caller that waits for a job looks at the cluster.
_PATIENCE = 2.0


class DaskJobs(TakenJobs):
    """The jobs of one call, each from where it is taken until its outcome.

    Parameters
    ----------
    client : Client
        Connection to the scheduler.
    function : callable
        What each job is an argument of.
    jobs : iterable
        The jobs, from which one is taken only when a worker will soon need it.
    """

    def __init__(self, client: Client, function: Callable[[Any], Any], jobs: Iterable[Any]) -> None:
        super().__init__(function, jobs, lambda function, job: pickle.dumps((function, job)))
        self._client = client
        self._name = f"teamsight-{uuid.uuid4().hex}"
        self._futures: dict[int, Future] = {}
        self._ended: queue.SimpleQueue[int] = queue.SimpleQueue()
        # The scheduler blames the death of a worker on all jobs that it has given to it. Jobs that it has given up wait
        # here, and are then made with no other beside them: whoever dies alone is guilty.
        self._suspects: deque[int] = deque()
        self._alone: int | None = None

    def submit(self, workers: int) -> None:
        """Submit jobs for so many workers."""
        if self._suspects or self._alone is not None:
            if not self._futures:
                self._alone = self._suspects.popleft()
                self._send(self._alone)
            return
        while len(self._futures) + len(self._unsent) < _EACH * workers and not self._is_exhausted:
            if (index := self._next()) is not None:
                self._send(index)

    def ended(self) -> Outcome | None:
        """Wait for a job and return its outcome; None if none ended for a while, or one is made again."""
        try:
            index = self._ended.get(timeout=_PATIENCE)
        except queue.Empty:
            return None
        return self._outcome(index, self._futures.pop(index))

    def cancel(self) -> None:
        """Cancel all jobs."""
        futures = list(self._futures.values())
        self._futures.clear()
        if futures and self._client.status == "running":
            with contextlib.suppress(OSError):  # the connection is lost now
                self._client.cancel(futures, force=True)

    def _send(self, index: int) -> None:
        name = f"{self._name}-{index}" + ("-alone" if index == self._alone else "")
        future = self._client.submit(make_packed, self._messages[index], key=name, pure=False)
        self._futures[index] = future
        future.add_done_callback(lambda _: self._ended.put(index))

    def _outcome(self, index: int, future: Future) -> Outcome | None:
        from distributed import KilledWorker

        was_alone = index == self._alone
        if was_alone:
            self._alone = None
        if future.status == "cancelled":
            raise ConnectionError("cancelled")
        error = future.exception()
        if isinstance(error, KilledWorker):
            if not was_alone:
                self._suspects.append(index)
                return None
            return self._end(index, "died", f"{error.allowed_failures + 1} workers of the cluster ended")
        if error is not None:
            raise ExecutorError(
                f"the workers cannot make the job ({shortened(f'{type(error).__name__}: {error}', 160)}); install the "
                "same version of teamsight where the scheduler and its workers run"
            ) from error
        status, value = future.result()
        if status == "done":
            try:
                value = pickle.loads(value)
            except Exception as failure:
                status, value = "unsent", said(failure)
        return self._end(index, status, value)

    def _end(self, index: int, status: Any, value: Any) -> Outcome:
        del self._messages[index]
        return Outcome(index, status, value)


# A worker of a cluster may have several threads; worlds are made one after the other in each process.
_one_at_a_time = threading.Lock()


def make_packed(message: bytes) -> tuple[str, Any]:
    """Make the job of a message, in a worker: return its status and its result, pickled if it is done."""
    with _one_at_a_time:
        try:
            function, job = pickle.loads(message)
        except Exception as error:
            return "unsent", said(error)
        status, value = attempt(function, job, BaseException)
        if status == "failed":
            return status, value
        try:
            return status, pickle.dumps(value)
        except Exception as error:
            return "unsent", said(error)
