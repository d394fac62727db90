"""Results on disk: complete files only, each of which tells the settings it came from."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd


class UnwritableError(ValueError):
    """Raised when results cannot be written where they were asked for."""


def prepare_folder(folder: str | os.PathLike[str]) -> Path:
    """Return `folder`, made if need be, after trying that it can be written.

    Raises
    ------
    UnwritableError
        If it cannot be made or written: better now than after the simulation.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise _unwritable(path, error) from error
    return path


@contextlib.contextmanager
def complete(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a file to write beside `path`, and put it in the place of `path` only when all of it is written.

    An error or Ctrl-C leaves what stood at `path` before, and no other trace.
    """
    target = Path(path)
    try:
        # Not mkstemp: its file would be readable by the owner alone, and a result should not be.
        draft = target.with_name(f".{target.name}.{os.getpid()}.part")
        draft.touch()
    except OSError as error:
        raise _unwritable(target, error) from error
    try:
        yield draft
        os.replace(draft, target)
    except OSError as error:
        raise _unwritable(target, error) from error
    finally:
        draft.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` in UTF-8."""
    with complete(path) as draft:
        draft.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content`."""
    with complete(path) as draft:
        draft.write_bytes(content)


def write_json(path: str | os.PathLike[str], value: Any) -> None:
    """Write `value` as indented JSON, keys in the order given."""
    write_text(path, json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def write_table(path: str | os.PathLike[str], table: pd.DataFrame, metadata: Mapping[str, Any]) -> None:
    """Write `table` as Parquet; `metadata` is in ``pandas.read_parquet(path).attrs`` again."""
    table = table.copy()
    table.attrs.clear()
    for name, value in metadata.items():
        table.attrs[name] = value
    with complete(path) as draft:
        table.to_parquet(draft, engine="pyarrow", index=False)


def key_of(settings: Mapping[str, Any]) -> str:
    """Return a name for settings, fit for JSON: the files of unfinished work begin with it."""
    return hashlib.blake2b(json.dumps(settings, sort_keys=True).encode(), digest_size=8).hexdigest()


def forget(folder: Path, key: str) -> None:
    """Delete the files of unfinished work whose names begin with `key`, and the folder if nothing else is in it."""
    # Drafts are left behind where a process was killed.
    for pattern in (f"{key}-*", f".{key}-*.part"):
        for file in folder.glob(pattern):
            file.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        folder.rmdir()


def _unwritable(path: Path, error: OSError) -> UnwritableError:
    reason = error.strerror or str(error)
    return UnwritableError(f"{path}: cannot be written ({reason}); give a folder that can be, with --out or --save")
