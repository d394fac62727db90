"""Jobs on a Dask cluster; needs the extra `dask`."""

from __future__ import annotations

import contextlib
import logging
import math
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from teamsight.analysis.runs.dask_jobs import DaskJobs
from teamsight.analysis.runs.executor import MOST_DEATHS, ExecutorError, Outcome, shortened
from teamsight.analysis.runs.worker_process import interrupts_held
from teamsight.core import checks
from teamsight.core.extras import extra

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

# Seconds until a scheduler must have answered, and until it must have a worker.
_ANSWER, _WORKER = 15.0, 60.0
# Seconds for which a number of workers is used.
_AGE = 1.0
_LOCAL = "127.0.0.1"

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
            raise self._lost() from error
        finally:
            submitted.cancel()

    def _wait_for_workers(self) -> None:
        """Wait until the cluster has a worker."""
        end = time.monotonic() + _WORKER
        while not self._workers():
            if time.monotonic() > end:
                at = self._address or _LOCAL
                raise ExecutorError(
                    f"scheduler={at}: has had no workers for {_WORKER:g} seconds; start some: dask worker {at}"
                )
            time.sleep(0.1)

    def _workers(self) -> list[str]:
        """Return the addresses of the workers."""
        if self._client.status != "running":
            raise self._lost()
        try:
            return list(self._client.nthreads())
        except (OSError, RuntimeError) as error:
            raise self._lost() from error

    def _lost(self) -> ExecutorError:
        at = self._address or _LOCAL
        return ExecutorError(
            f"scheduler={at}: the connection is lost; start the scheduler again and repeat the command"
        )

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
    """Return the TLS settings of a connection; None without files."""
    distributed = extra("distributed", "Dask", "dask")
    given = {name: Path(path) for name, path in files.items() if path is not None}
    if scheduler is not None and not scheduler.startswith(("tcp://", "tls://")):
        raise ValueError(
            f"scheduler={checks.shown(scheduler)}: must be an address such as tcp://10.0.0.1:8786, or tls://…"
        )
    if scheduler is not None and scheduler.startswith("tls://") and len(given) < 3:
        missing = next(name for name in files if name not in given)
        raise ValueError(f"{missing}=None: is needed for {scheduler}; give tls_ca, tls_cert and tls_key")
    if not given:
        return None
    if scheduler is None or not scheduler.startswith("tls://"):
        name, path = next(iter(given.items()))
        raise ValueError(
            f"{name}={path}: is for a scheduler with TLS only, not for {scheduler or 'the cluster on this machine'}; "
            "give scheduler=tls://…, or leave it out"
        )
    for name, path in given.items():
        if not path.is_file():
            raise ValueError(f"{name}={path}: is not a file; give a PEM file")
    return distributed.Security(
        tls_ca_file=str(given["tls_ca"]), tls_client_cert=str(given["tls_cert"]), tls_client_key=str(given["tls_key"]),
        require_encryption=True,
    )  # fmt: skip


def _connected(scheduler: str, security: Any) -> Client:
    """Return a client of a running scheduler."""
    from distributed import Client

    try:
        with _quiet():
            return Client(scheduler, security=security, timeout=_ANSWER, set_as_default=False)
    except (OSError, TimeoutError, RuntimeError, ValueError) as error:
        reason = shortened(str(error) or type(error).__name__, 160)
        raise ExecutorError(
            f"scheduler={scheduler}: cannot be reached ({reason}); start one: dask scheduler, or correct the address"
        ) from error


def _local(workers: int) -> tuple[Client, LocalCluster]:
    """Start a cluster on this machine."""
    from distributed import Client, LocalCluster

    from teamsight.analysis.runs.workers import check_workers

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
        reason = shortened(str(error) or type(error).__name__, 160)
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
