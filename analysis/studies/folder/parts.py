"""Parts: the Parquet files of a shard, named by digests of their runs and of their bytes."""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from teamsight.analysis.studies.folder.layout import PART, make_folder
from teamsight.core import files
from teamsight.core.checks import shown

if TYPE_CHECKING:
    import pyarrow as pa

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
