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


def is_own(name: str) -> bool:
    """Whether a file of this name may stand in the folder of a study. Hidden files of the system may, too."""
    return name in _OWN or name.startswith(".")


def foreign_parts(folder: Path, kind: str) -> list[str]:
    """Return what stands among the parts of a kind and is neither a part nor a draft nor hidden, below the folder.

    Raises
    ------
    OSError
        If the folder of the kind cannot be listed.
    """
    names = sorted(os.listdir(folder / kind))
    return [f"{kind}/{name}" for name in names if not (PART.fullmatch(name) or name.startswith("."))]


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

    def distinct(self) -> RunSet:
        """Return each run once, in ascending order of setting and replicate."""
        order, first = self.sorted_firsts()
        chosen = order[first]
        return RunSet(self.ids[chosen], self.replicates[chosen])

    def without(self, others: RunSet) -> RunSet:
        """Return the distinct runs that are not among `others`, in order."""
        # The order is stable: of equal runs, that of `others` comes first.
        order, first = joined((others, self)).sorted_firsts()
        chosen = order[first & (order >= others.size)] - others.size
        return RunSet(self.ids[chosen], self.replicates[chosen])

    def firsts(self) -> NDArray[np.bool_]:
        """Return whether each run is the first of those that equal it, shape (N,)."""
        order, first = self.sorted_firsts()
        found = np.empty(self.size, bool)
        found[order] = first
        return found

    def sorted_firsts(self) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the indices that sort the runs, and which of these come first among equal runs."""
        order = np.lexsort((self.replicates, self.ids))
        ids, replicates = self.ids[order], self.replicates[order]
        first = np.ones(self.size, bool)
        first[1:] = (ids[1:] != ids[:-1]) | (replicates[1:] != replicates[:-1])
        return order, first

    def names(self, most: int | None = None) -> list[str]:
        """Return the run ids, at most `most` of them."""
        rows = zip(self.ids[:most].tolist(), self.replicates[:most].tolist(), strict=True)
        return [run_id(setting, replicate) for setting, replicate in rows]


def joined(sets: tuple[RunSet, ...] | list[RunSet]) -> RunSet:
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
    digits = np.frombuffer(settings.buffers()[1] or b"", np.uint8)[settings.offset * _DIGITS :]
    return RunSet(_ids(digits[: len(settings) * _DIGITS]), replicates.astype(np.int64, copy=False))


def _ids(texts: NDArray[np.uint8]) -> NDArray[np.uint64]:
    """Return the numbers that the bytes of consecutive texts of 16 hexadecimal digits spell."""
    digits = _VALUES[texts]
    if (digits == 255).any():
        raise ValueError("has a setting that is not 16 hexadecimal digits")
    return (digits[0::2] << 4 | digits[1::2]).view(">u8").astype(np.uint64)


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


def shard_of(run_ids: Iterable[str]) -> str:
    """Return the digest of the ids of a shard's runs, 16 hexadecimal digits; their order does not matter."""
    return digest("\n".join(sorted(run_ids)).encode())


def listed(folder: Path, kind: str) -> list[Part]:
    """Return the parts of a kind in the order of their names; files of other names are left out.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    kind : str
        Name of the folder below it.
    """
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
    if not is_whole(part, content):
        raise DamagedError(part, _damage(content))
    return content


def is_whole(part: Part, content: bytes) -> bool:
    """Whether these are the bytes that the name of a part promises."""
    return digest(content) == part.digest


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


def rows(part: Part, content: bytes, columns: Iterable[str] | None = None) -> pa.Table:
    """Return the rows of a part.

    Parameters
    ----------
    part : Part
        The part.
    content : bytes
        Its bytes.
    columns : iterable of str, optional
        Names of columns; all by default. Those that it does not have are left out.

    Raises
    ------
    DamagedError
        If it cannot be read as Parquet.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(pa.BufferReader(content))
        names = None if columns is None else [name for name in columns if name in file.schema_arrow.names]
        # Without threads, whose overhead is larger than a part.
        return file.read(names, use_threads=False)
    except (pa.ArrowException, OSError) as error:
        raise DamagedError(part, f"is no Parquet file ({shown(str(error))})") from error


def noted(part: Part, content: bytes, key: str) -> dict[str, str]:
    """Return what the metadata of a part says under a key, without what is not known; empty if it says nothing.

    Raises
    ------
    DamagedError
        If it cannot be read as Parquet.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        metadata = pq.read_schema(pa.BufferReader(content)).metadata or {}
        found = json.loads(metadata.get(key.encode(), b"{}"))
    except (pa.ArrowException, OSError, ValueError) as error:
        raise DamagedError(part, f"is no Parquet file ({shown(str(error))})") from error
    return {str(name): str(value) for name, value in found.items() if value is not None}


def beside(part: Part, content: bytes) -> dict[str, str]:
    """Return the names of the other parts of a shard by kind, as its part of "runs" says."""
    return {kind: f"{part.shard}-{digest}.parquet" for kind, digest in noted(part, content, BESIDE).items()}


def write(folder: Path, kind: str, shard: str, content: bytes) -> Path:
    """Write a part and return its path. It is there completely, or not at all.

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
    return target


def digest(content: bytes) -> str:
    """Return the digest by which bytes are named, 16 hexadecimal digits."""
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def _damage(content: bytes) -> str:
    """Return what is wrong with bytes that have another digest than their name says."""
    if not content:
        return "is empty"
    if not content.startswith(_BEGINNING):
        return "is no Parquet file"
    if not content.endswith(_END):
        return f"is cut off after {len(content)} bytes, or its end is damaged"
    return "is damaged (its bytes are not those that were written)"


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
            if part.shard in shards:
                found.append(_moved(part.path, folder / DAMAGED / kind))
    return [path.relative_to(folder).as_posix() for path in found]


def remove_drafts(folder: Path) -> int:
    """Remove the drafts that killed processes have left; return how many. No process may write meanwhile."""
    count = 0
    for path in drafts(folder):
        with contextlib.suppress(OSError):
            path.unlink()
            count += 1
    return count


def drafts(folder: Path) -> list[Path]:
    """Return the drafts in the folder of a study."""
    found: list[Path] = []
    for place in (folder, folder / ARRAY, *(folder / kind for kind in KINDS)):
        with contextlib.suppress(OSError):
            found += [place / name for name in sorted(os.listdir(place)) if DRAFT.fullmatch(name)]
    return found


def _moved(path: Path, place: Path) -> Path:
    """Move a file into a folder, under a name that is free there."""
    try:
        make_folder(place, parents=True)
        target, number = place / path.name, 1
        while os.path.lexists(target):
            number += 1
            target = place / f"{path.name}.{number}"
        os.rename(path, target)
    except OSError as error:
        raise files.unwritable(path, error) from error
    return target


# What changes if a file is replaced or written to.
_Stamp = tuple[int, int, int, int]


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
        self._folder = folder
        self._kind = kind
        self._known: dict[str, tuple[_Stamp, Examined | Damaged]] = {}

    def update(self) -> Contents:
        """Return what the parts have that are there now."""
        known, self._known = self._known, {}
        for part in listed(self._folder, self._kind):
            name = part.path.name
            try:
                stamp = _stamp(part.path)
                if name in known and known[name][0] == stamp:
                    self._known[name] = known[name]
                else:
                    self._known[name] = stamp, examined(part)
            except FileNotFoundError:
                # It was set aside meanwhile.
                continue
        entries = [entry for _, entry in self._known.values()]
        found = list(complete(self._folder, entries))
        whole = [entry for entry in found if isinstance(entry, Examined)]
        runs = joined([entry.runs for entry in whole]).distinct()
        lost = joined([entry.runs for entry in entries if isinstance(entry, Examined)]).without(runs)
        names = dict.fromkeys(name for entry in whole for name in entry.not_finite)
        odd = {name: joined([entry.not_finite[name] for entry in whole if name in entry.not_finite]) for name in names}
        return Contents(
            runs, [entry for entry in found if isinstance(entry, Damaged)], lost,
            {name: given.distinct().size for name, given in odd.items()},
        )  # fmt: skip


def examined(part: Part) -> Examined | Damaged:
    """Read a part and return what it has, or how it is damaged."""
    try:
        content = load(part)
        return Examined(part, runs_of(part, content), beside(part, content), _not_finite(part, content))
    except DamagedError as error:
        return error.damaged


def complete(folder: Path, found: Iterable[Examined | Damaged]) -> Iterator[Examined | Damaged]:
    """Yield what was found, and how a part is damaged in place of one beside which another was lost."""
    # After the parts themselves were listed: those beside them are written first, and set aside last.
    there = {kind: {part.path.name for part in listed(folder, kind)} for kind in KINDS if kind not in DONE}
    for one in found:
        lost = [] if isinstance(one, Damaged) else [
            kind for kind, name in one.beside.items() if name not in there.get(kind, ())
        ]  # fmt: skip
        if isinstance(one, Examined) and lost:
            yield Damaged(one.part.kind, one.part.path.name, f"its part of {lost[0]} is lost")
        else:
            yield one


def runs_of(part: Part, content: bytes) -> RunSet:
    """Return the run of each row of a part.

    Raises
    ------
    DamagedError
        If it has no such rows.
    """
    try:
        return runs_in(rows(part, content, IDENTITY))
    except DamagedError:
        raise
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def _not_finite(part: Part, content: bytes) -> dict[str, RunSet]:
    """Return the runs of which a measure is NaN or infinite, by its name; None is neither."""
    import pyarrow.compute as pc

    # What events hold is listed beside the measures, with a prefix that no column has.
    names = [name for name, kind in noted(part, content, HOLDS).items() if kind == "number"]
    table = rows(part, content, [*IDENTITY, *names]) if names else None
    if table is None:
        return {}
    odd = {
        name: pc.invert(pc.fill_null(pc.is_finite(table[name]), True)) for name in names if name in table.column_names
    }
    return {name: runs_in(table.filter(mask)) for name, mask in odd.items() if pc.any(mask).as_py()}


def _stamp(path: Path) -> _Stamp:
    found = os.lstat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


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
            table = rows(part, load(part), needed)
            keys.append(_runs(part, table))
        except FileNotFoundError:
            # It was set aside meanwhile, and its runs are missing now.
            continue
        except DamagedError:
            if skip_damaged:
                continue
            raise
        tables.append(table)
    whole = _joined(folder / kind, tables, _kept(keys, without))
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
            whole = pa.concat_tables([_without_empty(table) for table in chosen], promote_options="permissive")
        return whole.replace_schema_metadata(None)
    except (pa.ArrowInvalid, pa.ArrowTypeError) as error:
        raise ValueError(
            f"{place}: its parts have columns of different types ({shown(str(error))}); give columns=[…] of the "
            "others, or read the parts one by one"
        ) from error


def _without_empty(table: pa.Table) -> pa.Table:
    """Return a table without the columns in which all is null."""
    names = zip(table.column_names, table.columns, strict=True)
    return table.select([name for name, column in names if column.null_count < table.num_rows])


def _counting(folder: Path, kind: str) -> list[Part]:
    """Return the parts that count: of kinds other than `DONE`, those that were written beside one of runs."""
    found = listed(folder, kind)
    if kind in DONE:
        return found
    runs: dict[str, Part] = {}
    for part in listed(folder, "runs"):
        runs.setdefault(part.shard, part)
    several = {shard for shard, count in Counter(part.shard for part in found).items() if count > 1}
    # Rarely are there several: a sweep was killed before it wrote the runs, and another version made them again.
    beside = {shard: _beside(runs[shard], kind) for shard in several.intersection(runs)}
    return [
        part for part in found if part.shard in runs and beside.get(part.shard, part.path.name) == part.path.name
    ]  # fmt: skip


def _beside(runs: Part, kind: str) -> str | None:
    """Return the name of the part of a kind that was written beside one of runs; None if none was."""
    with contextlib.suppress(FileNotFoundError, DamagedError):
        return beside(runs, load(runs)).get(kind)
    return None


def _runs(part: Part, table: pa.Table) -> RunSet:
    try:
        return runs_in(table)
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def _kept(keys: list[RunSet], without: RunSet | None) -> list[NDArray[np.bool_]]:
    """Return which rows of each part are kept: those of runs that no part before it has."""
    if not keys:
        return []
    # Runs have many rows each in some kinds: first come the runs of each part, then their rows.
    starts = [_starts(key) for key in keys]
    blocks = joined([RunSet(key.ids[start], key.replicates[start]) for key, start in zip(keys, starts, strict=True)])
    number = np.repeat(np.arange(len(keys)), [start.sum() for start in starts])
    kept = _first_part(blocks, number)
    if without is not None and without.size:
        left = blocks.without(without)
        kept &= ~joined((left, blocks)).firsts()[left.size :]
    ends = np.cumsum([start.sum() for start in starts])[:-1]
    per_part = np.split(kept, ends)
    return [
        chosen[np.cumsum(start) - 1] if len(start) else np.empty(0, bool)
        for chosen, start in zip(per_part, starts, strict=True)
    ]


def _starts(key: RunSet) -> NDArray[np.bool_]:
    """Return in which rows another run begins than that of the row before."""
    start = np.ones(key.size, bool)
    start[1:] = (key.ids[1:] != key.ids[:-1]) | (key.replicates[1:] != key.replicates[:-1])
    return start


def _first_part(blocks: RunSet, number: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return whether each block of rows is of the first part that has its run."""
    order, first = blocks.sorted_firsts()
    # The order is stable, so the first of equal blocks is of the first part.
    group = np.cumsum(first) - 1
    found = np.empty(blocks.size, bool)
    found[order] = number[order] == number[order[first]][group] if blocks.size else True
    return found
