"""`StudyFolder`: what a sweep writes to disk, and what is read from there."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.analysis.studies.folder.run_set import RunSet

if TYPE_CHECKING:
    import pyarrow as pa

    from teamsight.analysis.studies.folder.manifest import Manifest
    from teamsight.analysis.studies.folder.parts import Damaged
    from teamsight.analysis.studies.folder.progress import Heartbeat
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study


class StudyFolder:
    """The folder of a study.

    Making the object reads and writes nothing. What `done`, `failed` and `read` return is what is on disk at that
    moment, also while a sweep writes.

    Parameters
    ----------
    path : path
        The folder, which need not exist before `prepare`.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)

    @property
    def is_prepared(self) -> bool:
        """Whether there is a manifest."""
        raise NotImplementedError

    @property
    def manifest(self) -> Manifest:
        """The study, and what made the runs.

        Raises
        ------
        ValueError
            If this is not the folder of a study, or the manifest is damaged or of a newer version.
        """
        raise NotImplementedError

    @property
    def study(self) -> Study:
        """The study as the manifest has it, with all runs that were ever asked for."""
        raise NotImplementedError

    def prepare(
        self,
        study: Study,
        plan: Plan,
        *,
        code: str,
        sources: Mapping[str, str],
        types: Mapping[str, str] | None = None,
        mixed_code: bool = False,
    ) -> Manifest:
        """Create the folder, or check that it is that of `study`, whose additions it takes over.

        Parameters
        ----------
        study, plan : Study, Plan
            What is to be run.
        code : str
            Digest of teamsight's code.
        sources : mapping of str to str
            Digest of the file of each module that the study names.
        types : mapping of str to str, optional
            Parquet type of each parameter; by default those of the plan.
        mixed_code : bool
            Accept runs of other code beside those of this.

        Raises
        ------
        UnwritableError
            If the folder cannot be written, or holds something else.
        ValueError
            If it is that of another study, which the message compares with this, or of other code.
        """
        raise NotImplementedError

    @contextlib.contextmanager
    def lock(
        self,
        shard: tuple[int, int] | None = None,
        wait: bool = False,
        waiting: Callable[[str], object] = lambda holder: None,
    ) -> Iterator[None]:
        """Keep other sweeps out of the folder, which is created if it does not exist.

        Parameters
        ----------
        shard : (int, int), optional
            Shard i of n, from 1, of a job array; shards run side by side, but not beside a sweep of all.
        wait : bool
            Wait until others have ended, in place of raising.
        waiting : callable
            Called once with a description of who holds the folder, before waiting.

        Raises
        ------
        LockedError
            If another process holds it; with its id, host and when it began.
        UnwritableError
            If the folder cannot be written, or holds something else.
        """
        raise NotImplementedError
        yield

    @contextlib.contextmanager
    def recorded(self, *, engine: str, workers: int, code: str, shard: tuple[int, int] | None = None) -> Iterator[Heartbeat]:
        """Record begin and end of a sweep in ``sweeps.jsonl``; call `update` of what is returned with what is done."""
        raise NotImplementedError
        yield

    def tidy(self) -> list[Damaged]:
        """Remove drafts that killed processes have left, and set damaged parts of runs aside; return these.

        Only under `lock` of all. Parts of the other kinds are checked by `read` and by `verify`.
        """
        raise NotImplementedError

    def write(self, parts: Mapping[str, bytes], run_ids: Iterable[str]) -> None:
        """Write the parts of a shard; those of "failed" and "runs" last, since they make it done.

        Each is written beside its place, brought to disk, read back and moved there. After an error nothing of it
        counts, and the shard may be written again.

        Parameters
        ----------
        parts : mapping of str to bytes
            Parquet files by kind: "runs", "failed", "steps", "trajectories", "events".
        run_ids : iterable of str
            The runs of the shard; their order does not matter.

        Raises
        ------
        UnwritableError
            If a part cannot be written, such as on a full disk.
        """
        raise NotImplementedError

    def done(self) -> RunSet:
        """Return the runs that are in an undamaged part."""
        raise NotImplementedError

    def failed(self) -> RunSet:
        """Return the runs that have failed, except those that were made later."""
        raise NotImplementedError

    def read(self, kind: str, columns: Iterable[str] | None = None) -> pa.Table:
        """Return the rows of a kind, each run once; without columns if there are no parts.

        Parameters
        ----------
        kind : {"runs", "failed", "steps", "trajectories", "events"}
            Which parts. Rows of "failed" whose run was made later, and rows of shards that are not done, are left out.
        columns : iterable of str, optional
            Names of columns; all by default.

        Raises
        ------
        DamagedError
            If a part is damaged.
        """
        raise NotImplementedError
