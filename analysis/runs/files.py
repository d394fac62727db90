"""Results on disk: complete files only, each of which tells the settings it came from, and one rule for replacing.

The rule: a place is free, or holds what this program wrote, or is written only when forced. Every file carries a mark
by which it is known again: a Parquet table metadata of its schema, a picture its Software text, a page its first line,
and JSON a key. What is no regular file is never replaced.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from teamsight import __version__
from teamsight.core.files import (
    UnwritableError,
    check_folder,
    check_name,
    check_place,
    complete,
    open_regular,
    unwritable,
)

__all__ = [
    "UnwritableError", "check_folder", "check_replaceable", "complete", "forget", "key_of", "prepare_folder",
    "write_bytes", "write_json", "write_page", "write_table", "write_text",
]  # fmt: skip

_SOFTWARE = "teamsight"
_MARK = b"software"
_PAGE = f"<!-- written by {_SOFTWARE}"
_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_TEXT = b"tEXtSoftware\0" + _SOFTWARE.encode()
# A page, picture or JSON that is longer is none of ours.
_MOST_READ = 50_000_000


def prepare_folder(folder: str | os.PathLike[str], *, follow: bool = True) -> Path:
    """Return `folder`, made if need be, after trying that it can be written.

    Parameters
    ----------
    folder : path
        The folder.
    follow : bool
        Whether it may be a link to a folder, as one that a user names may be.

    Raises
    ------
    UnwritableError
        If it cannot be made or written: better now than after the simulation.
    """
    check_name(folder)
    path = Path(folder)
    if not follow:
        check_folder(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except FileExistsError as error:
        raise UnwritableError(f"{path}: cannot be written (is no folder); give a folder") from error
    except OSError as error:
        raise unwritable(path, error) from error
    return path


def check_replaceable(
    path: str | os.PathLike[str], about: Mapping[str, Any] | None = None, *, force: bool = False
) -> None:
    """Refuse to write over what this program did not write, or what tells other settings, unless forced.

    Parameters
    ----------
    path : path
        Where a result is to be written.
    about : mapping, optional
        Settings, fit for JSON; a table that tells others is not replaced. Without any, whatever this program wrote is.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If what stands there must stay.
    """
    if not check_place(path) or force:
        return
    found = _told(Path(path))
    cure = "give --force (in Python, force=True) to replace it, or another place"
    if found is None:
        raise ValueError(f"{path}: holds something else; {cure}")
    wanted = json.loads(json.dumps(dict(about or {})))
    if any(found.get(name) != value for name, value in wanted.items()):
        raise ValueError(f"{path}: holds results of other settings; {cure}")


def write_bytes(path: str | os.PathLike[str], content: bytes, *, force: bool = False) -> None:
    """Write `content`; see `check_replaceable`."""
    with complete(path, lambda target: check_replaceable(target, force=force)) as draft:
        draft.write(content)


def write_text(path: str | os.PathLike[str], text: str, *, force: bool = False) -> None:
    """Write `text` in UTF-8; see `check_replaceable`."""
    write_bytes(path, text.encode(), force=force)


def write_page(path: str | os.PathLike[str], text: str, *, force: bool = False) -> None:
    """Write a page of Markdown, below a comment that says what wrote it; see `check_replaceable`."""
    write_text(path, f"{_PAGE} {__version__} -->\n{text}", force=force)


def write_json(path: str | os.PathLike[str], value: Any, *, force: bool = False) -> None:
    """Write `value` as indented JSON, keys in the order given; see `check_replaceable`.

    An object with the key "software" and the value "teamsight" is known again as written by this program.
    """
    write_text(path, json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n", force=force)


def write_table(
    path: str | os.PathLike[str], table: pd.DataFrame, metadata: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write `table` as Parquet; `metadata` is in ``pandas.read_parquet(path).attrs`` again.

    Parameters
    ----------
    path : path
        Where to write.
    table : DataFrame
        The table; its index is left out.
    metadata : mapping
        The settings, fit for JSON.
    force : bool
        See `check_replaceable`.

    Raises
    ------
    ValueError
        If it cannot be written, or what stands there must stay.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    content = pa.Table.from_pandas(table, preserve_index=False)
    # As pandas keeps its attributes, and the mark beside them.
    told = {b"PANDAS_ATTRS": json.dumps(dict(metadata)).encode(), _MARK: f"{_SOFTWARE} {__version__}".encode()}
    content = content.replace_schema_metadata({**(content.schema.metadata or {}), **told})
    # Arrow gets no name of a file, which it or pandas could read in another way than the system does.
    with complete(path, lambda target: check_replaceable(target, force=force)) as draft:
        pq.write_table(content, draft)


def key_of(settings: Mapping[str, Any]) -> str:
    """Return a name for settings, fit for JSON: the files of unfinished work begin with it."""
    return hashlib.blake2b(json.dumps(settings, sort_keys=True).encode(), digest_size=8).hexdigest()


def forget(folder: Path, key: str) -> None:
    """Delete the files of unfinished work whose names begin with `key`, and the folder if nothing else is in it."""
    # Drafts are left behind where a process was killed.
    for pattern in (f"{key}-*", f".{key}-*.part"):
        for file in folder.glob(pattern):
            if file.is_symlink() or not file.is_dir():  # a folder of such a name is none of ours
                file.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.rmdir()


def _told(path: Path) -> dict[Any, Any] | None:
    """Return the settings that a file of this program tells, empty where its kind tells none; None for other files."""
    # Whatever a reader finds wrong with a file that is not what it seems.
    with contextlib.suppress(Exception), open_regular(path) as file:
        head = file.read(len(_PAGE))
        file.seek(0)
        if head.startswith(b"PAR1"):
            return _told_by_table(file)
        content = file.read(_MOST_READ)
        if head.startswith(_PAGE.encode()) or (head.startswith(_PNG) and _PNG_TEXT in content):
            return {}
        value = json.loads(content)
        if isinstance(value, dict) and value.get("software") == _SOFTWARE:
            return {}
    return None


def _told_by_table(file: io.IOBase | Any) -> dict[Any, Any] | None:
    import pyarrow.parquet as pq

    metadata = pq.read_schema(file).metadata or {}
    if not metadata.get(_MARK, b"").startswith(_SOFTWARE.encode()):
        return None
    return dict(json.loads(metadata.get(b"PANDAS_ATTRS", b"{}")))
