"""Jobs on a Dask cluster; needs the extra `dask`."""

from __future__ import annotations

import contextlib
import logging
import math
import pickle
import queue
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from teamsight.analysis.runs.executor import MOST_DEATHS, ExecutorError, Outcome, TakenJobs, error_text, made, shortened
from teamsight.analysis.runs.processes import interrupts_held
from teamsight.core import checks
from teamsight.core.extras import extra

if TYPE_CHECKING:
    from distributed import Client, Future, LocalCluster

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
        super().__init__(function, jobs)
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
            return self.end(index, "died", f"{error.allowed_failures + 1} workers of the cluster ended")
        if error is not None:
            raise ExecutorError(
                f"the workers cannot make the job ({shortened(error_text(error), 160)}); install the "
                "same version of teamsight where the scheduler and its workers run"
            ) from error
        status, value = future.result()
        if status == "done":
            try:
                value = pickle.loads(value)
            except Exception as failure:
                status, value = "unsent", error_text(failure)
        return self.end(index, status, value)


# A worker of a cluster may have several threads; worlds are made one after the other in each process.
_one_at_a_time = threading.Lock()


def make_packed(message: bytes) -> tuple[str, Any]:
    """Make the job of a message, in a worker: return its status and its result, pickled if it is done."""
    with _one_at_a_time:
        status, value = made(message)
        if status != "done":
            return status, value
        try:
            return status, pickle.dumps(value)
        except Exception as error:
            return "unsent", error_text(error)


# Seconds until a scheduler must have answered, and until it must have a worker.
_ANSWER, _WORKER = 15.0, 60.0
# Seconds for which a number of workers is used.
_AGE = 1.0
_LOCAL = "127.0.0.1"
_LOST = "the connection is lost; start the scheduler again and repeat the command"

T = TypeVar("T")
R = TypeVar("R")


class DaskExecutor:
    """Runs jobs on a Dask cluster; an `Executor`.

    Workers need the same version of this package, and so does the scheduler; each makes one job at a time. A job in
    which workers end is made again by others; it has died when the scheduler has given it up twice, the second time
    alone. A scheduler gives a job up after three workers, or as its setting ``allowed-failures`` says.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running scheduler, such as tcp://10.0.0.1:8786, or tls://…; by default a cluster of `workers`
        processes is started on this machine, which listens on 127.0.0.1 only, dashboard included.
    workers : int
        Number of processes of the cluster on this machine.
    tls_ca, tls_cert, tls_key : str or path, optional
        Files of the certificate authority, the certificate and its key, for a scheduler that requires TLS.

    Attributes
    ----------
    dashboard : str
        Address of the cluster's web page.

    Raises
    ------
    ModuleNotFoundError
        If the package distributed is not installed.
    ValueError
        If the address or a file is wrong.
    ExecutorError
        If there is no scheduler at the address, it has no workers, or the cluster cannot start.
    """

    shard: tuple[int, int] | None = None

    def __init__(
        self,
        scheduler: str | None = None,
        workers: int = 1,
        *,
        tls_ca: str | Path | None = None,
        tls_cert: str | Path | None = None,
        tls_key: str | Path | None = None,
    ) -> None:
        security = _security(scheduler, {"tls_ca": tls_ca, "tls_cert": tls_cert, "tls_key": tls_key})
        self._cluster: LocalCluster | None = None
        self._address, self._count = scheduler, workers
        self._size, self._counted_at = 1, -math.inf
        if scheduler is None:
            self._client, self._cluster = _local(workers)
        else:
            self._client = _connected(scheduler, security)
        self.dashboard: str = self._client.dashboard_link
        try:
            self._wait_for_workers()
        except BaseException:
            self._close()
            raise

    @property
    def size(self) -> int:
        """Number of worker processes, which may change; while there are none, their number is awaited."""
        now = time.monotonic()
        if now > self._counted_at + _AGE:
            self._wait_for_workers()
            self._size, self._counted_at = len(self._workers()) or 1, now
        return self._size

    def __enter__(self) -> DaskExecutor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    def outcomes(self, function: Callable[[T], R], jobs: Iterable[T]) -> Generator[Outcome, None, None]:
        """Yield the outcome of each job as they end; see `teamsight.analysis.runs.executor.Executor`.

        A cluster does not stop jobs that it is making when the generator is closed; their results are dropped.

        Raises
        ------
        ExecutorError
            If the connection to the scheduler is lost, it has no workers for a minute, or they cannot run the function.
        """
        submitted = DaskJobs(self._client, function, jobs)
        try:
            while not submitted.is_empty:
                submitted.submit(self.size)
                yield from submitted.unsent()
                if submitted.open_jobs and (outcome := submitted.ended()):
                    # Before the caller works on the outcome, so that no worker waits for that.
                    submitted.submit(self.size)
                    yield outcome
        except (OSError, RuntimeError) as error:
            if isinstance(error, ExecutorError) or self._client.status == "running":
                raise
            raise self._error(_LOST) from error
        finally:
            submitted.cancel()

    def _wait_for_workers(self) -> None:
        """Wait until the cluster has a worker."""
        end = time.monotonic() + _WORKER
        while not self._workers():
            if time.monotonic() > end:
                at = self._address or _LOCAL
                raise self._error(f"has had no workers for {_WORKER:g} seconds; start some: dask worker {at}")
            time.sleep(0.1)

    def _workers(self) -> list[str]:
        """Return the addresses of the workers."""
        if self._client.status != "running":
            raise self._error(_LOST)
        try:
            return list(self._client.nthreads())
        except (OSError, RuntimeError) as error:
            raise self._error(_LOST) from error

    def _error(self, text: str) -> ExecutorError:
        return ExecutorError(f"scheduler={self._address or _LOCAL}: {text}")

    def _close(self) -> None:
        """Close the connection and the cluster, without waiting for jobs that are still being made."""
        failures = (OSError, RuntimeError, TimeoutError)
        with interrupts_held(), _quiet():
            if self._cluster is not None and self._client.status == "running":
                # A worker that is closed while it starts prints tracebacks.
                with contextlib.suppress(*failures):
                    self._client.wait_for_workers(self._count, timeout=5)
            with contextlib.suppress(*failures):
                self._client.close(timeout=2)
            if self._cluster is not None:
                with contextlib.suppress(*failures):
                    self._cluster.close(timeout=2)


def _security(scheduler: str | None, files: dict[str, str | Path | None]) -> Any:
    """Return the TLS settings of a connection; None without TLS."""
    distributed = extra("distributed", "Dask", "dask")
    if scheduler is not None and not scheduler.startswith(("tcp://", "tls://")):
        raise ValueError(
            f"scheduler={checks.shown(scheduler)}: must be an address such as tcp://10.0.0.1:8786, or tls://…"
        )
    is_secure = scheduler is not None and scheduler.startswith("tls://")
    # First those that are missing.
    for name, path in sorted(files.items(), key=lambda one: one[1] is not None):
        if path is None and is_secure:
            raise ValueError(f"{name}=None: is needed for {scheduler}; give tls_ca, tls_cert and tls_key")
        if path is not None and not is_secure:
            place = scheduler or "the cluster on this machine"
            raise ValueError(
                f"{name}={path}: is for a scheduler with TLS only, not for {place}; give scheduler=tls://…, or leave "
                "it out"
            )
        if path is not None and not Path(path).is_file():
            raise ValueError(f"{name}={path}: is not a file; give a PEM file")
    if not is_secure:
        return None
    return distributed.Security(
        tls_ca_file=str(files["tls_ca"]), tls_client_cert=str(files["tls_cert"]), tls_client_key=str(files["tls_key"]),
        require_encryption=True,
    )  # fmt: skip


def _connected(scheduler: str, security: Any) -> Client:
    """Return a client of a running scheduler."""
    from distributed import Client

    try:
        with _quiet():
            return Client(scheduler, security=security, timeout=_ANSWER, set_as_default=False)
    except (OSError, TimeoutError, RuntimeError, ValueError) as error:
        reason = shortened(error_text(error), 160)
        raise ExecutorError(
            f"scheduler={scheduler}: cannot be reached ({reason}); start one: dask scheduler, or correct the address"
        ) from error


def _local(workers: int) -> tuple[Client, LocalCluster]:
    """Start a cluster on this machine."""
    from distributed import Client, LocalCluster

    from teamsight.analysis.runs.processes import check_workers

    count = check_workers(workers)
    cluster = None
    try:
        # Threads and processes inherit the signal mask, so that only this process receives Ctrl-C.
        with interrupts_held():
            cluster = LocalCluster(
                n_workers=count, threads_per_worker=1, processes=True, host=_LOCAL, protocol="tcp",
                dashboard_address=f"{_LOCAL}:0", worker_dashboard_address=None, silence_logs=logging.CRITICAL,
                scheduler_kwargs={"allowed_failures": MOST_DEATHS - 1},
            )  # fmt: skip
            return Client(cluster, set_as_default=False), cluster
    except BaseException as error:
        if cluster is not None:
            with interrupts_held(), _quiet():
                cluster.close(timeout=2)
        if not isinstance(error, (OSError, RuntimeError)):
            raise  # such as Ctrl-C, which arrives when all has been started
        reason = shortened(error_text(error), 160)
        raise ExecutorError(
            f"workers={count}: a cluster on this machine cannot start ({reason}); a script must start it under if "
            '__name__ == "__main__":'
        ) from error


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Silence what the package logs about connections within the block; errors say it in one line."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
