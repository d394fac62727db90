"""The parts of a study's folder: Parquet files, which runs are in them, and their rows."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamsight.analysis.studies.definition.values import run_id
from teamsight.core import files
from teamsight.core.checks import shown

if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.parquet as pq

MANIFEST, SWEEPS, PROGRESS, LOCK = "manifest.json", "sweeps.jsonl", "progress.json", "lock"
#: Locks and heartbeats of the shards i/n of a job array.
ARRAY = "array"
#: Where damaged parts are set aside.
DAMAGED = "damaged"
#: Folders of parts. Parts of "failed" and "runs" are written last: they make a shard done.
KINDS = ("steps", "trajectories", "events", "failed", "runs")
#: What a part is called: a digest of its run ids, and one of its bytes.
PART = re.compile(r"([0-9a-f]{16})-([0-9a-f]{16})\.parquet")
#: The lock of shard i of n of a job array.
SHARD_LOCK = re.compile(r"(\d{4,})-of-(\d{4,})\.lock")
#: Files that were being written when their process ended; see `teamsight.core.files.complete`.
DRAFT = re.compile(r"\..+\.[0-9a-f]{16}\.part")
#: Kinds of which each run has one row; a shard with such a part is done.
DONE = ("failed", "runs")
_OWN = frozenset({MANIFEST, SWEEPS, PROGRESS, LOCK, ARRAY, DAMAGED, *KINDS})


def foreign(folder: Path) -> Iterator[str]:
    """Yield what is in a folder that is not of a study, below the folder; hidden files of the system are ignored."""
    yield from (name for name in sorted(os.listdir(folder)) if name not in _OWN and not name.startswith("."))
    yield from foreign_parts(folder)


def foreign_parts(folder: Path) -> Iterator[str]:
    """Yield what stands among the parts and is neither a part nor a draft nor hidden, below the folder."""
    for kind in KINDS:
        with contextlib.suppress(FileNotFoundError):
            for name in sorted(os.listdir(folder / kind)):
                if not (PART.fullmatch(name) or name.startswith(".")):
                    yield f"{kind}/{name}"


def make_folder(folder: Path, *, parents: bool = False) -> None:
    """Create a folder that stays after a power cut, unless it is there.

    Raises
    ------
    UnwritableError
        If it cannot be created.
    """
    if not os.path.isdir(folder):
        if parents and folder.parent != folder:
            # One after the other: each name must be on disk.
            make_folder(folder.parent, parents=True)
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise files.unwritable(folder, error) from error
        files.sync_folder(folder.parent)


def shard_file(shard: tuple[int, int], suffix: str) -> str:
    """Return the name of a file of shard i of n."""
    return f"{shard[0]:04d}-of-{shard[1]:04d}.{suffix}"


#: The columns that identify a run in every part.
IDENTITY = ("setting", "replicate")

_DIGITS = 16
# The value of each hexadecimal digit by its byte; 255 for other bytes.
_VALUES = np.full(256, 255, np.uint8)
_VALUES[np.frombuffer(b"0123456789abcdef", np.uint8)] = np.arange(16)


class RunSet(NamedTuple):
    """Runs by setting and replicate.

    Attributes
    ----------
    ids : ndarray, shape (N,), uint64
        Id of the setting of each run.
    replicates : ndarray, shape (N,), int64
        Number of each run of its setting.
    """

    ids: NDArray[np.uint64]
    replicates: NDArray[np.int64]

    @property
    def size(self) -> int:
        """The number of runs."""
        return len(self.ids)

    def where(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> RunSet:
        """Return the runs at some places."""
        return RunSet(self.ids[chosen], self.replicates[chosen])

    def distinct(self) -> RunSet:
        """Return each run once, in ascending order of setting and replicate."""
        order, first = self.sorted_firsts()
        return self.where(order[first])

    def without(self, others: RunSet) -> RunSet:
        """Return the distinct runs that are not among `others`, in order."""
        found = self.distinct()
        return found.where(~found.are_in(others))

    def are_in(self, others: RunSet) -> NDArray[np.bool_]:
        """Return whether each run is among `others`, shape (N,)."""
        if not others.size:
            return np.zeros(self.size, bool)
        order, first = joined([others, self]).sorted_firsts()
        # The order is stable: of equal runs, that of `others` comes first.
        is_other = (order < others.size)[first]
        found = np.empty(len(order), bool)
        found[order] = is_other[np.cumsum(first) - 1]
        return found[others.size :]

    def sorted_firsts(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the indices that sort the runs, and which of these come first among equal runs."""
        order = np.lexsort((self.replicates, self.ids))
        ids, replicates = self.where(order)
        first = np.ones(self.size, bool)
        first[1:] = (ids[1:] != ids[:-1]) | (replicates[1:] != replicates[:-1])
        return order, first

    def names(self) -> list[str]:
        """Return the run ids."""
        return [run_id(*run) for run in zip(self.ids.tolist(), self.replicates.tolist(), strict=True)]


def joined(sets: Collection[RunSet]) -> RunSet:
    """Return the runs of several sets one after the other, equal ones as often as they occur."""
    if not sets:
        return RunSet(np.empty(0, np.uint64), np.empty(0, np.int64))
    return RunSet(np.concatenate([each.ids for each in sets]), np.concatenate([each.replicates for each in sets]))


def runs_in(table: pa.Table) -> RunSet:
    """Return the run of each row of a table of parts.

    Raises
    ------
    ValueError
        If a column is missing, or a setting is not 16 hexadecimal digits.
    """
    import pyarrow as pa

    if not table.num_rows:
        return joined([])
    for name in IDENTITY:
        if name not in table.column_names:
            raise ValueError(f"has no column {name!r}")
        if table[name].null_count:
            raise ValueError(f"has rows without {name}")
    try:
        # A text of another length than 16 cannot be cast.
        settings = pa.concat_arrays(table["setting"].cast(pa.string()).cast(pa.binary(_DIGITS)).chunks)
        replicates = table["replicate"].cast(pa.int64()).to_numpy()
    except pa.ArrowException:
        raise ValueError("has another type of settings or replicates than a part") from None
    texts = np.frombuffer(settings.buffers()[1] or b"", np.uint8)[settings.offset * _DIGITS :]
    digits = _VALUES[texts[: len(settings) * _DIGITS]]
    if (digits == 255).any():
        raise ValueError("has a setting that is not 16 hexadecimal digits")
    ids = (digits[0::2] << 4 | digits[1::2]).view(">u8").astype(np.uint64)
    return RunSet(ids, replicates.astype(np.int64, copy=False))


#: Metadata of parts of "runs": digests of the parts that were written beside it, and what measured columns hold.
BESIDE, HOLDS = "teamsight.beside", "teamsight.holds"
_BEGINNING = _END = b"PAR1"
# What systems answer if there is no space.
_FULL = {errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC)}


class Part(NamedTuple):
    """A file that has the name of a part.

    Attributes
    ----------
    path : Path
        The file.
    kind : str
        What its rows are, such as "runs".
    shard : str
        Digest of the run ids of its shard, 16 hexadecimal digits.
    digest : str
        Digest that its bytes must have, 16 hexadecimal digits.
    """

    path: Path
    kind: str
    shard: str
    digest: str


class Damaged(NamedTuple):
    """A part that is damaged, and how."""

    kind: str
    name: str
    reason: str


class DamagedError(ValueError):
    """Raised when a part that shall be read is damaged.

    Parameters
    ----------
    part : Part
        The part.
    reason : str
        What is wrong with it.
    """

    def __init__(self, part: Part, reason: str) -> None:
        folder = part.path.parent.parent
        super().__init__(f"{part.path}: {reason}; run teamsight verify {folder}")
        self.damaged = Damaged(part.kind, part.path.name, reason)


def digest(content: bytes) -> str:
    """Return the digest by which bytes are named, 16 hexadecimal digits."""
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def shard_of(run_ids: Iterable[str]) -> str:
    """Return the digest of the ids of a shard's runs, 16 hexadecimal digits; their order does not matter."""
    return digest("\n".join(sorted(run_ids)).encode())


def listed(folder: Path, kind: str) -> list[Part]:
    """Return the parts of a kind in the folder of a study, in the order of their names; other files are left out."""
    try:
        names = sorted(os.listdir(folder / kind))
    except FileNotFoundError:
        return []
    found = ((name, PART.fullmatch(name)) for name in names)
    return [Part(folder / kind / name, kind, match[1], match[2]) for name, match in found if match]


def load(part: Part) -> bytes:
    """Return the bytes of a part.

    Raises
    ------
    DamagedError
        If they are not those that its name promises.
    FileNotFoundError
        If the part has been moved away.
    """
    content = bytes_of(part)
    if digest(content) == part.digest:
        return content
    reason = "is damaged (its bytes are not those that were written)"
    if not content:
        reason = "is empty"
    elif not content.startswith(_BEGINNING):
        reason = "is no Parquet file"
    elif not content.endswith(_END):
        reason = f"is cut off after {len(content)} bytes, or its end is damaged"
    raise DamagedError(part, reason)


def bytes_of(part: Part) -> bytes:
    """Return the bytes of a part, unchecked.

    Raises
    ------
    DamagedError
        If it is no regular file, or cannot be read.
    FileNotFoundError
        If the part has been moved away.
    """
    try:
        with files.open_regular(part.path) as file:
            return file.read()
    except OSError as error:
        if error.errno in (errno.EINVAL, errno.EISDIR, errno.ENXIO):
            raise DamagedError(part, "is not a regular file") from None
        if error.errno == errno.EIO:
            raise DamagedError(part, "cannot be read (input/output error)") from error
        raise


@contextlib.contextmanager
def reading(part: Part, content: bytes) -> Iterator[pq.ParquetFile]:
    """Open a part; what fails within the block says that it is damaged.

    Raises
    ------
    DamagedError
        If it cannot be read as Parquet, or the block raises a ValueError.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        yield pq.ParquetFile(pa.BufferReader(content))
    except (pa.ArrowException, OSError, json.JSONDecodeError) as error:
        raise DamagedError(part, f"is no Parquet file ({shown(str(error))})") from error
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def rows(file: pq.ParquetFile, columns: Iterable[str] | None = None) -> pa.Table:
    """Return the rows of a part: all columns, or those of these names that it has."""
    known = file.schema_arrow.names
    names = None if columns is None else [name for name in columns if name in known]
    # Without threads, whose overhead is larger than a part.
    return file.read(names, use_threads=False)


def noted(file: pq.ParquetFile, key: str) -> dict[str, str]:
    """Return what the metadata of a part says under a key, without what is not known; empty if it says nothing."""
    found = json.loads((file.metadata.metadata or {}).get(key.encode(), b"{}"))
    return {str(name): str(value) for name, value in found.items() if value is not None}


def beside(part: Part, file: pq.ParquetFile) -> dict[str, str]:
    """Return the names of the other parts of a shard by kind, as its part of "runs" says."""
    return {kind: f"{part.shard}-{digest}.parquet" for kind, digest in noted(file, BESIDE).items()}


def write(folder: Path, kind: str, shard: str, content: bytes) -> None:
    """Write a part. It is there completely, or not at all.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    kind : str
        What its rows are.
    shard : str
        See `shard_of`.
    content : bytes
        The Parquet file.

    Raises
    ------
    UnwritableError
        If it cannot be written, or reads back as other bytes.
    """
    target = folder / kind / f"{shard}-{digest(content)}.parquet"
    name = ""

    def check(target: Path) -> None:
        # Called when the draft is on disk.
        with files.open_regular(name) as file:
            if file.read() != content:
                raise files.UnwritableError(
                    f"{target}: reads back as other bytes than were written; check the disk, or give another folder"
                )

    try:
        make_folder(target.parent)
        with files.complete(target, check) as draft:
            name = draft.name
            draft.write(content)
    except files.UnwritableError as error:
        if isinstance(error.__cause__, OSError) and error.__cause__.errno in _FULL:
            raise files.UnwritableError(
                f"{target}: cannot be written ({error.__cause__.strerror}); free some space and repeat the "
                "command, which goes on where it stopped"
            ) from error
        raise


def set_aside(folder: Path, shards: Collection[str]) -> list[str]:
    """Move all parts of some shards to ``damaged/``, and return where they are now, below the folder.

    Parts that make a shard done are moved first: an interruption leaves no shard that counts without its other parts.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    shards : collection of str
        Digests of the shards.

    Raises
    ------
    UnwritableError
        If a part cannot be moved.
    """
    found = []
    for kind in reversed(KINDS):
        for part in listed(folder, kind):
            if part.shard not in shards:
                continue
            try:
                make_folder(folder / DAMAGED / kind, parents=True)
                target, number = folder / DAMAGED / kind / part.path.name, 1
                while os.path.lexists(target):
                    number += 1
                    target = target.with_name(f"{part.path.name}.{number}")
                os.rename(part.path, target)
            except OSError as error:
                raise files.unwritable(part.path, error) from error
            found.append(target.relative_to(folder).as_posix())
    return found


def drafts(folder: Path) -> list[Path]:
    """Return the drafts that killed processes have left in the folder of a study."""
    found: list[Path] = []
    for place in (folder, folder / ARRAY, *(folder / kind for kind in KINDS)):
        with contextlib.suppress(OSError):
            found += [place / name for name in sorted(os.listdir(place)) if DRAFT.fullmatch(name)]
    return found


def remove_drafts(folder: Path) -> None:
    """Remove the drafts that killed processes have left. No process may write meanwhile."""
    for path in drafts(folder):
        with contextlib.suppress(OSError):
            path.unlink()


class Examined(NamedTuple):
    """What an undamaged part has.

    Attributes
    ----------
    part : Part
        The part.
    runs : RunSet
        The run of each row.
    beside : dict of str to str
        The names of the other parts of its shard by kind.
    not_finite : dict of str to RunSet
        The runs of which a measure is NaN or infinite, by its name.
    """

    part: Part
    runs: RunSet
    beside: dict[str, str]
    not_finite: dict[str, RunSet]


class Contents(NamedTuple):
    """What the parts of a kind have.

    Attributes
    ----------
    runs : RunSet
        The distinct runs of the undamaged parts.
    damaged : list of Damaged
        The damaged parts, and those beside which another was lost.
    lost : RunSet
        The distinct runs of parts beside which another was lost.
    not_finite : dict of str to int
        In how many of the runs a measure is NaN or infinite, by its name; without those where it never is.
    """

    runs: RunSet
    damaged: list[Damaged]
    lost: RunSet
    not_finite: dict[str, int]


class Index:
    """The runs of one kind of parts. A part is read again only if its file has changed.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    kind : str
        Which parts.
    """

    def __init__(self, folder: Path, kind: str) -> None:
        self._folder, self._kind = folder, kind
        # By what changes if a file is replaced or written to.
        self._known: dict[tuple[str, int, int, int, int], Examined | Damaged] = {}

    def update(self) -> Contents:
        """Return what the parts have that are there now."""
        known, self._known = self._known, {}
        for part in listed(self._folder, self._kind):
            # Unless it was set aside meanwhile.
            with contextlib.suppress(FileNotFoundError):
                stat = os.lstat(part.path)
                stamp = part.path.name, stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns
                self._known[stamp] = known[stamp] if stamp in known else examined(part)
        found = list(complete(self._folder, self._known.values()))
        whole = [entry for entry in found if isinstance(entry, Examined)]
        runs = joined([entry.runs for entry in whole]).distinct()
        lost = joined([entry.runs for entry in self._known.values() if isinstance(entry, Examined)]).without(runs)
        odd: dict[str, list[RunSet]] = {}
        for entry in whole:
            for name, some in entry.not_finite.items():
                odd.setdefault(name, []).append(some)
        return Contents(
            runs, [entry for entry in found if isinstance(entry, Damaged)], lost,
            {name: joined(given).distinct().size for name, given in odd.items()},
        )  # fmt: skip


def examined(part: Part) -> Examined | Damaged:
    """Read a part and return what it has, or how it is damaged."""
    import pyarrow.compute as pc

    try:
        with reading(part, load(part)) as file:
            # What events hold is listed beside the measures, with a prefix that no column has.
            names = [name for name, kind in noted(file, HOLDS).items() if kind == "number"]
            table = rows(file, [*IDENTITY, *names])
            runs, odd = runs_in(table), {}
            for name in table.column_names[len(IDENTITY) :]:
                # None is neither finite nor not.
                is_odd = pc.invert(pc.fill_null(pc.is_finite(table[name]), True))
                if pc.any(is_odd).as_py():
                    odd[name] = runs.where(is_odd.to_numpy())
            return Examined(part, runs, beside(part, file), odd)
    except DamagedError as error:
        return error.damaged


def complete(folder: Path, found: Iterable[Examined | Damaged]) -> Iterator[Examined | Damaged]:
    """Yield what was found, and how a part is damaged in place of one beside which another was lost."""
    # After the parts themselves were listed: those beside them are written first, and set aside last.
    there = {kind: {part.path.name for part in listed(folder, kind)} for kind in KINDS if kind not in DONE}
    for one in found:
        others = {} if isinstance(one, Damaged) else one.beside
        lost = next((kind for kind, name in others.items() if name not in there.get(kind, ())), None)
        if lost is None or isinstance(one, Damaged):
            yield one
        else:
            yield Damaged(one.part.kind, one.part.path.name, f"its part of {lost} is lost")


def read_parts(
    folder: Path, kind: str, columns: Iterable[str] | None = None, without: RunSet | None = None, *,
    skip_damaged: bool = False,
) -> pa.Table:  # fmt: skip
    """Return the rows of all parts of a kind.

    A run that several parts have, as those of two machines, is taken from the part whose name comes first.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    kind : str
        Which parts.
    columns : iterable of str, optional
        Names of columns, in the order wanted; all by default.
    without : RunSet, optional
        Runs to leave out.
    skip_damaged : bool
        Leave damaged parts out, in place of raising.

    Raises
    ------
    DamagedError
        If a part is damaged.
    """
    wanted = None if columns is None else list(columns)
    needed = None if wanted is None else [*wanted, *(name for name in IDENTITY if name not in wanted)]
    tables, keys = [], []
    for part in _counting(folder, kind):
        try:
            with reading(part, load(part)) as file:
                table = rows(file, needed)
                keys.append(runs_in(table))
        except FileNotFoundError:
            # It was set aside meanwhile, and its runs are missing now.
            continue
        except DamagedError:
            if skip_damaged:
                continue
            raise
        tables.append(table)
    whole = _joined(folder / kind, tables, _kept(keys, without or joined([])))
    return whole if wanted is None else whole.select([name for name in wanted if name in whole.column_names])


def _joined(place: Path, tables: list[pa.Table], kept: list[NDArray[np.bool_]]) -> pa.Table:
    """Return the rows of all parts that are kept as one table."""
    import pyarrow as pa

    if not tables:
        return pa.table({})
    chosen = [table if mask.all() else table.filter(pa.array(mask)) for table, mask in zip(tables, kept, strict=True)]
    try:
        try:
            whole = pa.concat_tables(chosen, promote_options="permissive")
        except (pa.ArrowInvalid, pa.ArrowTypeError):
            # A column without a value has the type of numbers, whatever it holds in other parts.
            filled = [[name for name in one.column_names if one[name].null_count < one.num_rows] for one in chosen]
            chosen = [table.select(names) for table, names in zip(chosen, filled, strict=True)]
            whole = pa.concat_tables(chosen, promote_options="permissive")
        return whole.replace_schema_metadata(None)
    except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
        raise ValueError(
            f"{place}: its parts have columns of different types ({shown(str(error))}); give columns=[…] of the "
            "others, or read the parts one by one"
        ) from error


def _counting(folder: Path, kind: str) -> list[Part]:
    """Return the parts that count: of kinds other than `DONE`, those that were written beside one of runs."""
    found = listed(folder, kind)
    if kind in DONE:
        return found
    runs: dict[str, Part] = {}
    for part in listed(folder, "runs"):
        runs.setdefault(part.shard, part)
    chosen: dict[str, str] = {}
    # Rarely are there several: a sweep was killed before it wrote the runs, and another version made them again.
    for shard, count in Counter(part.shard for part in found).items():
        if count > 1 and shard in runs:
            chosen[shard] = ""
            with contextlib.suppress(FileNotFoundError, DamagedError), reading(runs[shard], load(runs[shard])) as file:
                chosen[shard] = beside(runs[shard], file).get(kind, "")
    return [
        part for part in found if part.shard in runs and chosen.get(part.shard, part.path.name) == part.path.name
    ]  # fmt: skip


def _kept(keys: list[RunSet], without: RunSet) -> list[NDArray[np.bool_]]:
    """Return which rows of each part are kept: those of runs that no part before it has."""
    if not keys:
        return []
    every, sizes = joined(keys), [key.size for key in keys]
    number = np.repeat(np.arange(len(keys)), sizes)
    order, first = every.sorted_firsts()
    kept = np.empty(every.size, bool)
    # The order is stable, so the first of equal rows is of the first part.
    kept[order] = number[order] == number[order[first]][np.cumsum(first) - 1]
    return np.split(kept & ~every.are_in(without), np.cumsum(sizes)[:-1])
