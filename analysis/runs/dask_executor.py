"""Jobs on a Dask cluster, by the extra `dask`."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from types import TracebackType
from typing import TypeVar

from teamsight.analysis.runs.executor import Outcome

T = TypeVar("T")
R = TypeVar("R")


class DaskExecutor:
    """Runs jobs on a Dask cluster; an `Executor`.

    Parameters
    ----------
    scheduler : str, optional
        Address of a running scheduler, such as tcp://10.0.0.1:8786, or tls://…; by default a cluster of `workers`
        processes is started on this machine, which listens on 127.0.0.1 only.
    workers : int
        Number of processes of the cluster on this machine.
    tls_ca, tls_cert, tls_key : str, optional
        Files of the certificate authority, the certificate and its key, for a scheduler that requires TLS.

    Attributes
    ----------
    size : int
        Number of worker processes.
    """

    def __init__(
        self,
        scheduler: str | None = None,
        workers: int = 1,
        *,
        tls_ca: str | None = None,
        tls_cert: str | None = None,
        tls_key: str | None = None,
    ) -> None:
        self.size = workers
        raise NotImplementedError

    def __enter__(self) -> DaskExecutor:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None

    def outcomes(self, function: Callable[[T], R], jobs: Iterable[T]) -> Generator[Outcome, None, None]:
        """Yield the outcome of each job as they end; see `teamsight.analysis.runs.executor.Executor`."""
        yield from ()
