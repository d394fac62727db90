"""`StudyFolder`: what a sweep writes to disk, and what is read from there."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from teamsight.analysis.studies.folder import parts as part_files
from teamsight.analysis.studies.folder.aside import remove_drafts, set_aside
from teamsight.analysis.studies.folder.file_lock import opened
from teamsight.analysis.studies.folder.index import Index
from teamsight.analysis.studies.folder.layout import ARRAY, DONE, KINDS, MANIFEST, PROGRESS
from teamsight.analysis.studies.folder.lock import check_shard, locked
from teamsight.analysis.studies.folder.manifest import Manifest, read_manifest
from teamsight.analysis.studies.folder.parts import Damaged
from teamsight.analysis.studies.folder.preparation import make_own_folder, prepared, settled
from teamsight.analysis.studies.folder.progress import Heartbeat, Progress, read_progress
from teamsight.analysis.studies.folder.reading import read_parts
from teamsight.analysis.studies.folder.run_set import RunSet
from teamsight.analysis.studies.folder.sweeps import Record, read_sweeps, recorded
from teamsight.core import checks

if TYPE_CHECKING:
    import pyarrow as pa

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
        given = Path(path)
        # A model or a notebook may change the current folder; what begins with ~ is left to be refused.
        self.path = given if str(given).startswith("~") else given.absolute()
        self._indexes = {kind: Index(self.path, kind) for kind in DONE}

    def __repr__(self) -> str:
        return f"StudyFolder({os.fspath(self.path)!r})"

    @property
    def is_prepared(self) -> bool:
        """Whether there is a manifest."""
        return os.path.lexists(self.path / MANIFEST)

    @property
    def manifest(self) -> Manifest:
        """The study, and what made the runs.

        Raises
        ------
        ValueError
            If this is not the folder of a study, or the manifest is damaged or of a newer version.
        """
        return read_manifest(self.path)

    @property
    def study(self) -> Study:
        """The study as the manifest has it, with all runs that were ever asked for."""
        from teamsight.analysis.studies.study import Study

        return Study.from_dict(self.manifest.study)

    @property
    def progress(self) -> tuple[Progress, ...]:
        """The last heartbeats: of a sweep of all, and of each shard of a job array."""
        paths = [self.path / PROGRESS, *sorted((self.path / ARRAY).glob("*.json"))]
        return tuple(found for path in paths if (found := read_progress(path)) is not None)

    @property
    def sweeps(self) -> list[Record]:
        """Begin and end of each sweep: time, host, engine, workers, versions, and how many runs were made."""
        return read_sweeps(self.path)

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
            Type of each parameter's column; by default those of the plan.
        mixed_code : bool
            Accept runs of other code beside those of this.

        Raises
        ------
        UnwritableError
            If the folder cannot be written, or holds something else.
        ValueError
            If it is that of another study, which the message compares with this, or of other code.
        """
        given = plan.types if types is None else types
        # Shards of a job array do this at the same time.
        with self._exclusively(".prepare"):
            return prepared(self.path, study, plan, code, sources, given, mixed_code)

    def settle(self, kinds: Mapping[str, str | None]) -> Mapping[str, str]:
        """Decide what measured columns hold, where it is not decided yet, and return what all of them hold.

        Parameters
        ----------
        kinds : mapping of str to str or None
            "int", "number", "flag" or "text" by column.
        """
        with self._exclusively(".prepare"):
            return settled(self.path, kinds)

    @contextlib.contextmanager
    def lock(
        self,
        shard: tuple[int, int] | None = None,
        wait: bool = False,
        waiting: Callable[[str], object] = lambda message: None,
    ) -> Iterator[None]:
        """Keep other sweeps out of the folder, which is created if it does not exist.

        The lock ends with the process, however that ends.

        Parameters
        ----------
        shard : (int, int), optional
            Shard i of n, from 1, of a job array; shards run side by side, but not beside a sweep of all.
        wait : bool
            Wait until others have ended, in place of raising.
        waiting : callable
            Called with a message that says who holds the folder, before waiting.

        Raises
        ------
        LockedError
            If another process holds it; with its id, host and when it began.
        UnwritableError
            If the folder cannot be written, or holds something else.
        """
        check_shard(shard)
        make_own_folder(self.path)
        with locked(self.path, shard, wait, waiting):
            yield

    @contextlib.contextmanager
    def recorded(
        self, *, engine: str, workers: int, code: str, shard: tuple[int, int] | None = None
    ) -> Iterator[Heartbeat]:
        """Record begin and end of a sweep; call `Heartbeat.update` of what is returned with what is done.

        Parameters
        ----------
        engine, workers : str, int
            What makes the runs.
        code : str
            Digest of teamsight's code.
        shard : (int, int), optional
            See `lock`.
        """
        with recorded(self.path, engine, workers, code, shard) as heartbeat:
            yield heartbeat

    def tidy(self) -> list[Damaged]:
        """Remove drafts that killed processes have left, and set damaged parts of runs aside; return these.

        Only under `lock` of all. Parts of the other kinds are checked by `read` and by `verify`.
        """
        remove_drafts(self.path)
        damaged = self.damaged()
        set_aside(self.path, {each.name.partition("-")[0] for each in damaged})
        return damaged

    def damaged(self) -> list[Damaged]:
        """Return the damaged parts among those of which runs are done or failed; their runs are missing."""
        return [each for kind in DONE for each in self._indexes[kind].update().damaged]

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
        for kind in parts:
            checks.choice("kind", kind, KINDS)
        shard = part_files.shard_of(run_ids)
        for kind in KINDS:
            if kind in parts:
                part_files.write(self.path, kind, shard, parts[kind])

    def done(self) -> RunSet:
        """Return the distinct runs that are in undamaged parts, in the order of their ids."""
        return self._indexes["runs"].update().runs

    def lost(self) -> RunSet:
        """Return the distinct runs that are in undamaged parts beside which another was lost, such as that of steps."""
        return self._indexes["runs"].update().lost

    def not_finite(self) -> dict[str, int]:
        """Return in how many of the runs that are done a measure is NaN or infinite, by its name."""
        return self._indexes["runs"].update().not_finite

    def failed(self) -> RunSet:
        """Return the runs that have failed, except those that were made later."""
        return self._indexes["failed"].update().runs.without(self.done())

    def read(self, kind: str, columns: Iterable[str] | None = None, *, skip_damaged: bool = False) -> pa.Table:
        """Return the rows of a kind, each run once; without columns if there are no parts.

        Parameters
        ----------
        kind : {"runs", "failed", "steps", "trajectories", "events"}
            Which parts. Rows of "failed" whose run was made later, and rows of shards that are not done, are left out.
        columns : iterable of str, optional
            Names of columns; all by default.
        skip_damaged : bool
            Leave damaged parts out, in place of raising.

        Raises
        ------
        ValueError
            If this is not, or no longer, the folder of a study.
        DamagedError
            If a part is damaged.
        """
        checks.choice("kind", kind, KINDS)
        if not self.is_prepared:
            _ = self.manifest  # which says so
        without = self.done() if kind == "failed" else None
        return read_parts(self.path, kind, columns, without, skip_damaged=skip_damaged)

    @contextlib.contextmanager
    def _exclusively(self, name: str) -> Iterator[None]:
        """Hold a lock for a moment, after waiting for it."""
        make_own_folder(self.path)
        with opened(self.path / name) as lock:
            while not lock.take():
                time.sleep(0.02)
            yield
