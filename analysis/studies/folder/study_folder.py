"""The folder of a study: its manifest, what a sweep writes and reads, and `verify`, which finds damaged parts."""

from __future__ import annotations

import contextlib
import json
import os
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np

from teamsight.analysis.studies.definition.model import TASK_PREFIX
from teamsight.analysis.studies.definition.values import hex_of, run_id
from teamsight.analysis.studies.folder import parts, progress
from teamsight.analysis.studies.folder.lock import check_shard, exclusively, locked
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
# Lines of the difference of two studies that an error shows.
_MOST_LINES = 6
# Studies of another root or pairing differ in every seed, so a few of each part are computed.
_MOST_SEEDS = 16


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


def _digest(values: Mapping[str, object]) -> str:
    """Return a digest of values, which finds damage and changes by hand."""
    return parts.digest(json.dumps(values, sort_keys=True, separators=(",", ":")).encode())


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _other_code(folder: Path, what: str, old: str, new: str) -> ValueError:
    return ValueError(
        f"{folder}: its runs were made by another version of {what} ({old}, now {new}); give another folder, use that "
        "version, or accept a mixture with --mixed-code (in Python, mixed_code=True)"
    )


def _why_strange(part: Part, content: bytes, plan: Plan) -> str | None:
    """Return why a part is not of a study; None if it is.

    Raises
    ------
    DamagedError
        If it cannot be read.
    """
    with parts.reading(part, content) as file:
        table = parts.rows(file, (*IDENTITY, *(("seed", "steps") if part.kind in DONE else ())))
        runs = parts.runs_in(table)
        index = plan.index_of(runs.ids)
        if (index < 0).any():
            return f"belongs to another study (setting {hex_of(runs.ids[index < 0][0])} is not planned)"
        seeds, steps = (table[name].to_numpy() if name in table.column_names else () for name in ("seed", "steps"))
    if len(wrong := [one for one in set(steps) if one != plan.study.steps]):
        return f"belongs to another study (runs of {wrong[0]} steps, not {plan.study.steps})"
    # The seeds of a task follow from its scenario, and no module that a study names is imported here.
    if not references.is_reference(plan.study.model.partition(TASK_PREFIX)[2]):
        for row in range(0, len(seeds), -(-len(seeds) // _MOST_SEEDS) or 1):
            if plan.seed(int(index[row]), int(runs.replicates[row])) != seeds[row]:
                name = run_id(runs.ids[row], runs.replicates[row])
                return f"belongs to another study (seed {seeds[row]} of run {name} is not planned)"
    return None


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
            If this is not the folder of a study, or the manifest is damaged, changed by hand, or of a newer version.
        """
        path = self.path / MANIFEST

        def refuse(reason: str) -> NoReturn:
            raise ValueError(
                f"{path}: is damaged or was changed ({reason}); restore it from a copy, or move it away and run "
                "teamsight sweep with the study file again: it writes a new one if all parts belong to the study"
            )

        try:
            with files.open_regular(path) as file:
                found = json.loads(file.read(_MOST_BYTES))
        except (FileNotFoundError, NotADirectoryError):
            raise ValueError(
                f"{self.path}: is not the folder of a study (it has no {MANIFEST}); give one that teamsight sweep has "
                "made"
            ) from None
        except (ValueError, RecursionError):
            refuse("it is not JSON")
        if not isinstance(found, dict) or found.get("software") != _MARK["software"]:
            refuse("teamsight did not write it")
        if found.get("format") != FORMAT:
            versions = found.get("versions")
            wrote = versions.get("teamsight") if isinstance(versions, dict) else None
            raise ValueError(checks.other_format(path, found.get("format"), FORMAT, wrote))
        if found.pop("digest", None) != _digest(found):
            refuse("its digest differs")
        try:
            values = {name: found[name] for name in Manifest._fields}
        except KeyError as error:
            refuse(f"it has no {error}")
        return Manifest(**{**values, "earlier": tuple(values["earlier"])})

    def _write_manifest(self, manifest: Manifest) -> Manifest:
        """Write the manifest, or replace it, and return it."""
        values: dict[str, Any] = {**_MARK, **manifest._asdict(), "earlier": list(manifest.earlier)}
        values["digest"] = _digest(values)
        # A line for each key: an indent would write a line for each value of a long list, and take minutes.
        lines = (
            f"  {json.dumps(name)}: {json.dumps(value, ensure_ascii=False, allow_nan=False)}"
            for name, value in values.items()
        )
        with files.complete(self.path / MANIFEST) as draft:
            draft.write(("{\n" + ",\n".join(lines) + "\n}\n").encode())
        return manifest

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
        place, types = study.path, dict(plan.types if types is None else types)
        # With a folder that is found from everywhere.
        values = {**study.as_dict(), "path": None if place is None else os.path.abspath(place)}
        self._make()
        # Shards of a job array do this at the same time.
        with exclusively(self.path):
            if not self.is_prepared:
                holds = self._check_parts(plan, code, mixed_code)
                about = progress.versions(), progress.commits(Path(place) if place else None), progress.machine()
                return self._write_manifest(
                    Manifest(values, types, code, dict(sources), holds, (), *about, now := _now(), now)
                )
            found = self.manifest
            self._check_same(found, study, types)
            changed = [name for name, old in found.sources.items() if sources.get(name, old) != old]
            earlier = found.earlier
            if found.code != code or changed:
                if not mixed_code:
                    what, old, new = "teamsight", found.code, code
                    if old == new:
                        is_file = changed[0].startswith("file ")
                        what = changed[0] if is_file else f"module {changed[0]!r}"
                        old, new = found.sources[changed[0]], sources[changed[0]]
                    raise _other_code(self.path, what, old, new)
                earlier = (*earlier, {"code": found.code, "sources": dict(found.sources), "until": _now()})
            wanted = found._replace(
                study=values, types=types, code=code, sources={**found.sources, **sources}, earlier=earlier
            )
            return found if wanted == found else self._write_manifest(wanted._replace(changed=_now()))

    def _check_parts(self, plan: Plan, code: str, mixed_code: bool) -> dict[str, str]:
        """Refuse parts of another study or of other code, where the manifest is lost; return what columns hold.

        Damaged parts do not count.
        """
        holds: dict[str, str] = {}
        for part in (part for kind in DONE for part in parts.listed(self.path, kind)):
            with contextlib.suppress(DamagedError):
                content = parts.load(part)
                if why := _why_strange(part, content, plan):
                    raise files.UnwritableError(f"{part.path}: {why}; move it away, or give another folder")
                with parts.reading(part, content) as file:
                    holds = {**parts.noted(file, parts.HOLDS), **holds}
        used = [str(record["code"]) for record in self.sweeps if "code" in record]
        if used and code not in used and not mixed_code:
            raise _other_code(self.path, "teamsight", used[-1], code)
        return holds

    def _check_same(self, found: Manifest, study: Study, types: Mapping[str, str]) -> None:
        """Refuse another study than that of the folder, unless it only adds to it."""
        from teamsight.analysis.studies.definition.check import difference
        from teamsight.analysis.studies.study import Study

        lines = difference(Study.from_dict(found.study), study)
        for name, old in found.types.items():
            if types.get(name, old) != old:
                lines.append(f"type of {name}: {old} in the folder, {types[name]} now")
        if lines:
            more = [f"and {len(lines) - _MOST_LINES} more"] if len(lines) > _MOST_LINES else []
            raise ValueError(
                f"{self.path}: is the folder of another study ({'; '.join([*lines[:_MOST_LINES], *more])}); give "
                "another folder, or the study that it was made with"
            )

    def _make(self) -> None:
        """Create the folder, unless it is there.

        Raises
        ------
        UnwritableError
            If it cannot be created or holds something else.
        """
        files.check_name(self.path)
        try:
            found = [] if self.is_prepared else list(parts.foreign(self.path))
        except FileNotFoundError:
            found = []
        except NotADirectoryError:
            raise files.UnwritableError(f"{self.path}: is a file; give a folder") from None
        except OSError as error:
            raise files.unwritable(self.path, error) from error
        if found:
            more = f" and {len(found) - 1} more" if len(found) > 1 else ""
            raise files.UnwritableError(
                f"{self.path}: holds something else ({found[0]}{more}); give an empty or a new folder"
            )
        parts.make_folder(self.path, parents=True)

    def settle(self, kinds: Mapping[str, str | None]) -> Mapping[str, str]:
        """Decide what measured columns hold, where it is not decided yet, and return what all of them hold.

        Parameters
        ----------
        kinds : mapping of str to str or None
            "int", "number", "flag" or "text" by column.
        """
        with exclusively(self.path):
            found = self.manifest
            holds = {**{name: kind for name, kind in kinds.items() if kind is not None}, **found.holds}
            if holds != found.holds:
                self._write_manifest(found._replace(holds=holds))
            return holds

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
        self._make()
        with locked(self.path, shard, wait, waiting):
            yield

    def recorded(
        self, *, engine: str, workers: int, code: str, shard: tuple[int, int] | None = None
    ) -> contextlib.AbstractContextManager[Heartbeat]:
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
        return recorded(self.path, engine, workers, code, shard)

    def tidy(self) -> list[Damaged]:
        """Remove drafts that killed processes have left, and set damaged parts of runs aside; return these.

        Only under `lock` of all. Parts of the other kinds are checked by `read` and by `verify`.
        """
        parts.remove_drafts(self.path)
        damaged = self.damaged()
        parts.set_aside(self.path, {each.name.partition("-")[0] for each in damaged})
        return damaged

    def damaged(self) -> list[Damaged]:
        """Return the damaged parts among those of which runs are done or failed; their runs are missing."""
        return [each for kind in DONE for each in self._indexes[kind].update().damaged]

    def write(self, contents: Mapping[str, bytes], run_ids: Iterable[str]) -> None:
        """Write the parts of a shard; those of "failed" and "runs" last, since they make it done.

        Each is written beside its place, brought to disk, read back and moved there. After an error nothing of it
        counts, and the shard may be written again.

        Parameters
        ----------
        contents : mapping of str to bytes
            Parquet files by kind: "runs", "failed", "steps", "trajectories", "events".
        run_ids : iterable of str
            The runs of the shard; their order does not matter.

        Raises
        ------
        UnwritableError
            If a part cannot be written, such as on a full disk.
        """
        for kind in contents:
            checks.choice("kind", kind, KINDS)
        shard = parts.shard_of(run_ids)
        for kind in KINDS:
            if kind in contents:
                parts.write(self.path, kind, shard, contents[kind])

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
        return parts.read_parts(self.path, kind, columns, without, skip_damaged=skip_damaged)


class Verification(NamedTuple):
    """What `verify` found.

    Attributes
    ----------
    parts : int
        Parts that were read.
    damaged : tuple of Damaged
        Parts that are damaged or belong to another study.
    aside : tuple of str
        Where parts were moved, below the folder; with a damaged part go the others of its shard.
    runs : tuple of str
        Ids of the runs of their shards, as far as they are known for certain.
    unnamed : int
        Shards among them whose runs are not all known.
    foreign : tuple of str
        Files among the parts that are none, which are left where they are.
    drafts : int
        Drafts that killed processes have left; they are removed by a repair.
    """

    parts: int
    damaged: tuple[Damaged, ...]
    aside: tuple[str, ...]
    runs: tuple[str, ...]
    unnamed: int
    foreign: tuple[str, ...]
    drafts: int


def verify(folder: str | os.PathLike[str], repair: bool = True) -> Verification:
    """Read all parts of a study; set those aside that are damaged.

    Parameters
    ----------
    folder : path
        The folder of the study.
    repair : bool
        Move damaged parts to ``damaged/`` below it; they are never deleted. Without, nothing is changed.

    Raises
    ------
    LockedError
        If a sweep runs, and `repair` is set.
    ValueError
        If this is not the folder of a study.
    """
    place = StudyFolder(folder)
    plan = place.study.plan()
    with place.lock() if repair else contextlib.nullcontext():
        found = [part for kind in KINDS for part in parts.listed(place.path, kind)]
        damaged = tuple(_damage(place.path, found, plan))
        shards = {each.name.partition("-")[0]: list[Part]() for each in damaged}
        for part in found:
            if part.shard in shards:
                shards[part.shard].append(part)
        # Parts that are set aside can no longer be read.
        named = [_runs_of(*shard) for shard in sorted(shards.items())]
        runs, unnamed = sorted(set().union(*named)), sum(parts.shard_of(names) not in shards for names in named)
        foreign, left = tuple(parts.foreign_parts(place.path)), len(parts.drafts(place.path))
        aside = parts.set_aside(place.path, shards) if repair else []
        if repair:
            parts.remove_drafts(place.path)
    return Verification(len(found), damaged, tuple(aside), tuple(runs), unnamed, foreign, left)


def _damage(folder: Path, found: Iterable[Part], plan: Plan) -> Iterator[Damaged]:
    """Yield each part that is damaged, of another study, or without the parts that were written beside it."""
    whole = []
    for part in found:
        # Unless it was set aside by another process, where this one only looks.
        with contextlib.suppress(FileNotFoundError):
            try:
                content = parts.load(part)
                why = _why_strange(part, content, plan)
                with parts.reading(part, content) as file:
                    entry = parts.Examined(part, parts.joined([]), parts.beside(part, file), {})
            except DamagedError as error:
                yield error.damaged
                continue
            if why:
                yield Damaged(part.kind, part.path.name, why)
            else:
                whole.append(entry)
    yield from (one for one in parts.complete(folder, whole) if isinstance(one, Damaged))


def _runs_of(shard: str, found: list[Part]) -> set[str]:
    """Return the ids of the runs of a shard: those of its undamaged parts, and all if its name confirms them."""
    certain, names = set[str](), set[str]()
    for part in found:
        # A damaged part may still be readable; its reader raises errors of many kinds.
        with contextlib.suppress(Exception):
            content = parts.bytes_of(part)
            with parts.reading(part, content) as file:
                here = parts.runs_in(parts.rows(file, IDENTITY)).names()
            names.update(here)
            certain.update(here if parts.digest(content) == part.digest else ())
    return names if parts.shard_of(names) == shard else certain


def runs_to_repeat(folder: str | os.PathLike[str], found: Verification) -> RunSet | None:
    """Return the runs that were in damaged parts and are missing now; None for all that are missing.

    All are meant if some are not known by name, and none was missing before: the last sweeps had ended with all made.

    Parameters
    ----------
    folder : path
        The folder of the study.
    found : Verification
        What `verify` has set aside.
    """
    place = StudyFolder(folder)
    if found.unnamed and _were_complete(place):
        return None
    ids = np.array([int(run.partition("-")[0], 16) for run in found.runs], np.uint64)
    replicates = np.array([int(run.partition("-")[2]) for run in found.runs], np.int64)
    return RunSet(ids, replicates).without(place.done()).without(place.failed())


def _were_complete(place: StudyFolder) -> bool:
    """Return whether the last sweep of all, or the last one of every shard of a job array, has left nothing missing."""
    # Each shard of a job array knows of its own runs; of an adaptive study, as far as it has found out.
    arrays: defaultdict[str, list[Progress]] = defaultdict(list)
    for each in place.progress:
        arrays[each.shard.partition("/")[2]].append(each)
    totals = {count: sum(each.total for each in shards) for count, shards in arrays.items()}
    planned = max(place.study.runs, *totals.values(), 0)
    return any(
        len(shards) == int(count or 1)
        and totals[count] >= planned
        and all(each.has_ended and each.done + each.failed == each.total for each in shards)
        for count, shards in arrays.items()
    )
