"""The folder of a study: its manifest, and what a sweep writes and reads."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, Protocol

import numpy as np

from teamsight.analysis.studies.definition.model import TASK_PREFIX
from teamsight.analysis.studies.definition.values import hex_of, run_id
from teamsight.analysis.studies.folder import parts, progress
from teamsight.analysis.studies.folder import parts as part_files
from teamsight.analysis.studies.folder.file_lock import opened
from teamsight.analysis.studies.folder.lock import check_shard, locked
from teamsight.analysis.studies.folder.parts import (
    ARRAY,
    DONE,
    IDENTITY,
    KINDS,
    MANIFEST,
    PROGRESS,
    Damaged,
    DamagedError,
    Index,
    Part,
    RunSet,
    foreign_parts,
    is_own,
    make_folder,
    read_parts,
    remove_drafts,
    runs_in,
    set_aside,
)
from teamsight.analysis.studies.folder.progress import Heartbeat, Progress, Record, read_progress, read_sweeps, recorded
from teamsight.core import checks, files, references

if TYPE_CHECKING:
    import pyarrow as pa

    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

#: The version of the layout of the folder; a newer one is refused.
FORMAT = 1
_MARK = {"software": "teamsight", "format": FORMAT}
_MOST_BYTES = 2_000_000_000


class Manifest(NamedTuple):
    """What ``manifest.json`` says.

    Attributes
    ----------
    study : mapping
        The study as `Study.as_dict` returns it.
    types : mapping of str to str
        Type of each parameter's column.
    code : str
        Digest of teamsight's code.
    sources : mapping of str to str
        Digest of the file of each module that the study names, and of those beside it that these import.
    holds : mapping of str to str
        What each measured column holds, as the first part decided: "int", "number", "flag" or "text".
    earlier : sequence of mapping
        "code" and "sources" of runs that were made by other code, where that was allowed.
    versions : mapping of str to str
        Versions of Python, teamsight and the packages that decide results, when the folder was made.
    commits : mapping
        Git commits of teamsight and of the study file's folder at that time, where there are any.
    machine : mapping
        Host, operating system, processor and number of cores that made the folder.
    created, changed : str
        When the folder was made, and when the study last grew (UTC).
    """

    study: Mapping[str, Any]
    types: Mapping[str, str]
    code: str
    sources: Mapping[str, str]
    holds: Mapping[str, str]
    earlier: tuple[Mapping[str, Any], ...]
    versions: Mapping[str, str]
    commits: Mapping[str, Any]
    machine: Mapping[str, Any]
    created: str
    changed: str


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a folder.

    Raises
    ------
    ValueError
        If there is none, it is damaged or changed by hand, or a newer version has written it.
    """
    path = folder / MANIFEST
    try:
        with files.open_regular(path) as file:
            content = file.read(_MOST_BYTES)
    except (FileNotFoundError, NotADirectoryError):
        raise ValueError(
            f"{folder}: is not the folder of a study (it has no {MANIFEST}); give one that teamsight sweep has made"
        ) from None
    try:
        found = json.loads(content)
    except (ValueError, RecursionError):
        _refuse(path, "it is not JSON")
    if not isinstance(found, dict) or found.get("software") != _MARK["software"]:
        _refuse(path, "teamsight did not write it")
    if found.get("format") != FORMAT:
        versions = found.get("versions")
        wrote = versions.get("teamsight") if isinstance(versions, dict) else None
        raise ValueError(checks.other_format(path, found.get("format"), FORMAT, wrote))
    digest = found.pop("digest", None)
    if digest != _digest(found):
        _refuse(path, "its digest differs")
    try:
        values = {name: found[name] for name in Manifest._fields}
    except KeyError as error:
        _refuse(path, f"it has no {error}")
    return Manifest(**{**values, "earlier": tuple(values["earlier"])})


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write the manifest of a folder, or replace it.

    Raises
    ------
    UnwritableError
        If it cannot be written.
    """
    values: dict[str, Any] = {**_MARK, **manifest._asdict(), "earlier": list(manifest.earlier)}
    values["digest"] = _digest(values)
    # A line for each key: an indent would write a line for each value of a long list, and take minutes.
    lines = (f"  {json.dumps(name)}: {_written(value)}" for name, value in values.items())
    with files.complete(folder / MANIFEST) as draft:
        draft.write(("{\n" + ",\n".join(lines) + "\n}\n").encode())


def _written(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _digest(values: Mapping[str, object]) -> str:
    """Return a digest of values, which finds damage and changes by hand."""
    text = json.dumps(values, sort_keys=True, separators=(",", ":"))
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def _refuse(path: Path, reason: str) -> NoReturn:
    raise ValueError(
        f"{path}: is damaged or was changed ({reason}); restore it from a copy, or move it away and run teamsight "
        "sweep with the study file again: it writes a new one if all parts belong to the study"
    )


#: The columns by which a part is recognised.
RECOGNISED = (*IDENTITY, "seed", "steps")
# Studies of another root or pairing differ in every seed, so a few of each part are computed.
_MOST_SEEDS = 16


class HasSteps(Protocol):
    """What is read of a `Study`."""

    @property
    def steps(self) -> int:
        """Steps of each run."""


def stranger(table: pa.Table, study: HasSteps, plan: Plan) -> str | None:
    """Return why rows are not of a study; None if they are.

    Parameters
    ----------
    table : Table
        Rows with the columns `RECOGNISED`, of which only the identity must be there.
    study, plan : Study, Plan
        The study.
    """
    runs = runs_in(table)
    index = plan.index_of(runs.ids)
    if (index < 0).any():
        return f"belongs to another study (setting {hex_of(runs.ids[index < 0][0])} is not planned)"
    columns: Mapping[str, np.ndarray] = {
        name: table[name].to_numpy() for name in ("seed", "steps") if name in table.column_names
    }
    if "steps" in columns and (columns["steps"] != study.steps).any():
        wrong = int(columns["steps"][columns["steps"] != study.steps][0])
        return f"belongs to another study (runs of {wrong} steps, not {study.steps})"
    # The seeds of a task follow from its scenario, and no module that a study names is imported here.
    task = plan.study.model.partition(TASK_PREFIX)[2]
    if "seed" in columns and not references.is_reference(task):
        chosen = slice(None, None, -(-runs.size // _MOST_SEEDS) or 1)
        seen = (index[chosen].tolist(), runs.replicates[chosen].tolist(), columns["seed"][chosen].tolist())
        for setting, replicate, seed in zip(*seen, strict=True):
            if plan.seed(setting, replicate) != seed:
                return f"belongs to another study (seed {seed} of run {_name(plan, setting, replicate)} is not planned)"
    return None


def why_strange(part: Part, content: bytes, study: HasSteps, plan: Plan) -> str | None:
    """Return why a part is not of a study; None if it is.

    Raises
    ------
    DamagedError
        If it cannot be read.
    """
    table = parts.rows(part, content, RECOGNISED if part.kind in DONE else IDENTITY)
    try:
        return stranger(table, study, plan)
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def check_belongs(folder: Path, study: HasSteps, plan: Plan) -> None:
    """Raise an error if a folder without a manifest has parts that are not of a study. Damaged parts do not count.

    Raises
    ------
    UnwritableError
        If there are such parts.
    """
    for kind in DONE:
        for part in parts.listed(folder, kind):
            try:
                why = why_strange(part, parts.load(part), study, plan)
            except DamagedError:
                continue
            if why:
                raise files.UnwritableError(f"{part.path}: {why}; move it away, or give another folder")


def _name(plan: Plan, setting: int, replicate: int) -> str:
    return run_id(plan.ids[setting], replicate)


# Lines of the difference of two studies that an error shows.
_MOST_LINES = 6


def check_own(folder: Path) -> None:
    """Raise an error if a folder holds something else than a study.

    Raises
    ------
    UnwritableError
        If it does, or it cannot be examined.
    """
    files.check_name(folder)
    try:
        if os.path.lexists(folder / MANIFEST):
            return
        foreign = sorted(_foreign(folder))
    except FileNotFoundError:
        return
    except NotADirectoryError:
        raise files.UnwritableError(f"{folder}: is a file; give a folder") from None
    except OSError as error:
        raise files.unwritable(folder, error) from error
    if foreign:
        more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
        raise files.UnwritableError(
            f"{folder}: holds something else ({foreign[0]}{more}); give an empty or a new folder"
        )


def _foreign(folder: Path) -> Iterator[str]:
    """Yield what is in a folder, and in its folders of parts, that is not of a study."""
    for name in os.listdir(folder):
        if not is_own(name):
            yield name
        elif name in KINDS:
            yield from foreign_parts(folder, name)


def make_own_folder(folder: Path) -> None:
    """Create the folder of a study, unless it is there.

    Raises
    ------
    UnwritableError
        If it cannot be created or holds something else.
    """
    check_own(folder)
    make_folder(folder, parents=True)


def prepared(
    folder: Path,
    study: Study,
    plan: Plan,
    code: str,
    sources: Mapping[str, str],
    types: Mapping[str, str],
    mixed_code: bool,
) -> Manifest:
    """Create or check a folder; see `StudyFolder.prepare`."""
    make_own_folder(folder)
    if not os.path.lexists(folder / MANIFEST):
        check_belongs(folder, study, plan)
        _check_recorded_code(folder, code, mixed_code)
        return _created(folder, study, code, sources, types)
    found = read_manifest(folder)
    wanted = _grown(folder, found, study, types)
    wanted = _with_code(folder, wanted, code, sources, mixed_code)
    if wanted != found:
        wanted = wanted._replace(changed=_now())
        write_manifest(folder, wanted)
    return wanted


def _created(folder: Path, study: Study, code: str, sources: Mapping[str, str], types: Mapping[str, str]) -> Manifest:
    place = None if study.path is None else Path(study.path)
    now = _now()
    made = Manifest(
        _values(study), dict(types), code, dict(sources), _held(folder), (), progress.versions(),
        progress.commits(place),
        progress.machine(), now, now,
    )  # fmt: skip
    write_manifest(folder, made)
    return made


def _held(folder: Path) -> dict[str, str]:
    """Return what measured columns hold in the undamaged parts of a folder whose manifest is lost."""
    found: dict[str, str] = {}
    for part in parts.listed(folder, "runs"):
        with contextlib.suppress(DamagedError):
            found = {**parts.noted(part, parts.load(part), parts.HOLDS), **found}
    return found


def settled(folder: Path, kinds: Mapping[str, str | None]) -> Mapping[str, str]:
    """Take over what measured columns hold, where it is not decided, and return what is decided now."""
    found = read_manifest(folder)
    holds = {**{name: kind for name, kind in kinds.items() if kind is not None}, **found.holds}
    if holds != found.holds:
        write_manifest(folder, found._replace(holds=holds))
    return holds


def _grown(folder: Path, found: Manifest, study: Study, types: Mapping[str, str]) -> Manifest:
    """Return the manifest with the additions of a study to that of the folder."""
    from teamsight.analysis.studies.definition.check import difference
    from teamsight.analysis.studies.study import Study

    lines = difference(Study.from_dict(found.study), study)
    lines += [
        f"type of {name}: {old} in the folder, {types[name]} now"
        for name, old in found.types.items()
        if name in types and types[name] != old
    ]
    if lines:
        more = [f"and {len(lines) - _MOST_LINES} more"] if len(lines) > _MOST_LINES else []
        raise ValueError(
            f"{folder}: is the folder of another study ({'; '.join([*lines[:_MOST_LINES], *more])}); give another "
            "folder, or the study that it was made with"
        )
    return found._replace(study=_values(study), types=dict(types))


def _with_code(folder: Path, found: Manifest, code: str, sources: Mapping[str, str], mixed_code: bool) -> Manifest:
    """Return the manifest with the code that makes runs now, if it is the same or may differ."""
    changed = [name for name, digest in found.sources.items() if sources.get(name, digest) != digest]
    wanted = found._replace(code=code, sources={**found.sources, **sources})
    if found.code == code and not changed:
        return wanted
    if not mixed_code:
        what = f"module {changed[0]!r}" if found.code == code else "teamsight"
        old, new = (found.code, code) if found.code != code else (found.sources[changed[0]], sources[changed[0]])
        raise _other_code(folder, what, old, new)
    before = {"code": found.code, "sources": dict(found.sources), "until": _now()}
    return wanted._replace(earlier=(*found.earlier, before))


def _check_recorded_code(folder: Path, code: str, mixed_code: bool) -> None:
    """Refuse other code than that of earlier sweeps, where the manifest that says so is lost."""
    used = [record["code"] for record in read_sweeps(folder) if "code" in record]
    if used and code not in used and not mixed_code:
        raise _other_code(folder, "teamsight", str(used[-1]), code)


def _other_code(folder: Path, what: str, old: str, new: str) -> ValueError:
    return ValueError(
        f"{folder}: its runs were made by another version of {what} ({old}, now {new}); give another folder, use that "
        "version, or accept a mixture with --mixed-code (in Python, mixed_code=True)"
    )


def _values(study: Study) -> dict[str, Any]:
    """Return the values of a study, with a folder that is found from everywhere."""
    place = None if study.path is None else os.path.abspath(study.path)
    return {**study.as_dict(), "path": place}


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


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
