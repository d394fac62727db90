"""The file format of lazy memories: safetensors, written atomically, verified and memory-mapped when it is read.

A safetensors file consists of the length of the header (8 bytes), the header as JSON, and the numbers; other programs
can read it without this package. The metadata, all strings, describe the numbers and hold two checksums: of the
numbers, and of the other metadata.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from teamsight.core import checks, files
from teamsight.policies.memory.transitions import Table

FORMAT, SCHEMA = "teamsight lazy memory", "1"

_ALIGNMENT = 64
_MOST_HEADER = 100_000_000
_OWN_NAMES = ("format", "schema", "sha256", "sha256_of_metadata")
_NO_HEADER = "its header is not that of a lazy memory, or was altered; give a file that LazyMemory.save wrote"


class MemoryFileError(ValueError):
    """Raised if a file cannot be written, or is not a complete and unaltered memory that this version can read."""


def write(
    path: str | os.PathLike[str], table: Table, sha256: str, about: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write a table, its checksum and its description; an existing file is replaced only when the new one is complete.

    Only another memory is replaced, or, with `force`, any regular file.

    Raises
    ------
    MemoryFileError
        If the file cannot be written, or an existing file may not be replaced.
    """
    header = _header(table.shape, sha256, about)
    if len(header) > _MOST_HEADER:
        raise MemoryFileError(
            f"{path}: the settings take {len(header)} bytes; at most {_MOST_HEADER} fit; shorten them"
        )
    try:
        with files.complete(path, lambda target: _check_replaceable(target, force)) as file:
            file.write(header)
            # Not tofile, whose errors do not say why a write was incomplete.
            file.write(np.ascontiguousarray(table, "<f4").data.cast("B"))
    except files.UnwritableError as error:
        raise MemoryFileError(str(error)) from error


def read(path: str | os.PathLike[str], *, verify: bool = True) -> tuple[Table, str, dict[str, Any]]:
    """Return the table of a file, memory-mapped and read-only, its checksum, and its description.

    With `verify`, the numbers are compared with their checksum, which reads all of them.

    Raises
    ------
    MemoryFileError
        If it does not exist, or is not a complete and unaltered memory that this version can read.
    """
    try:
        with files.open_regular(path) as file:
            return _read(str(path), file, verify)
    except OSError as error:
        reason = error.strerror or str(error)
        raise MemoryFileError(f"{path}: cannot be read ({reason}); give the path of a saved memory") from error


def _read(path: str, file: BinaryIO, verify: bool) -> tuple[Table, str, dict[str, Any]]:
    size = os.fstat(file.fileno()).st_size
    length = int.from_bytes(file.read(8), "little")
    if size < 8 or length > _MOST_HEADER:
        raise MemoryFileError(f"{path}: {_NO_HEADER}")
    if 8 + length > size:
        raise MemoryFileError(f"{path}: is cut off after {size} bytes; copy it again, or explore again")
    header = file.read(length)
    metadata, shape = _parse(path, header)
    if metadata.get("schema") != SCHEMA:
        raise MemoryFileError(checks.other_format(path, metadata.get("schema"), SCHEMA, None))
    missing = size - (8 + length + 4 * shape[0] * shape[1])
    if missing:
        what = f"is {-missing} bytes too short" if missing < 0 else f"has {missing} bytes too many"
        raise MemoryFileError(f"{path}: {what} for its {shape[1]} transitions; copy it again, or explore again")
    try:
        about = {name: json.loads(text) for name, text in metadata.items() if name not in _OWN_NAMES}
        # What `write` would write: this also finds unknown members, duplicate names, NaN and other spellings.
        is_whole = _header(shape, metadata["sha256"], about)[8:] == header
    except (ValueError, KeyError, TypeError, RecursionError):
        is_whole = False
    if not is_whole:
        raise MemoryFileError(f"{path}: {_NO_HEADER}")
    # The open file is mapped, even if another file takes its name meanwhile.
    table = np.memmap(file, np.dtype("<f4"), "r", 8 + length, shape).view(np.ndarray)
    if verify and metadata["sha256"] != checksum(table):
        raise MemoryFileError(f"{path}: was altered, since its checksum does not fit; copy it again, or explore again")
    return table, metadata["sha256"], about


def _header(shape: tuple[int, ...], sha256: str, about: Mapping[str, Any]) -> bytes:
    """Return the bytes of a file before its numbers."""
    metadata = {name: json.dumps(value, ensure_ascii=False, allow_nan=False) for name, value in about.items()}
    metadata |= {"format": FORMAT, "schema": SCHEMA, "sha256": sha256}
    digest = hashlib.sha256(json.dumps(metadata, sort_keys=True).encode()).hexdigest()
    tensor = {"dtype": "F32", "shape": shape, "data_offsets": [0, 4 * shape[0] * shape[1]]}
    header = {"__metadata__": metadata | {"sha256_of_metadata": digest}, "table": tensor}
    text = json.dumps(header, ensure_ascii=False).encode()
    text += b" " * (-(8 + len(text)) % _ALIGNMENT)
    return len(text).to_bytes(8, "little") + text


def _parse(path: str, header: bytes) -> tuple[dict[str, str], tuple[int, int]]:
    """Return the metadata and the shape of the table of any memory; raise an error for another file."""
    try:
        parsed = json.loads(header.decode())
        metadata, (columns, transitions) = parsed["__metadata__"], parsed["table"]["shape"]
        is_memory = metadata["format"] == FORMAT and all(type(n) is int and n > 0 for n in (columns, transitions))
    except (ValueError, KeyError, TypeError, RecursionError):
        is_memory = False
    if not is_memory:
        raise MemoryFileError(f"{path}: {_NO_HEADER}")
    return metadata, (columns, transitions)


def checksum(table: Table) -> str:
    """Return the SHA-256 of a dense table's bytes."""
    return hashlib.sha256(table.astype("<f4", copy=False).data).hexdigest()


def _check_replaceable(target: Path, force: bool) -> None:
    if not files.check_place(target) or force:
        return
    with files.open_regular(target) as file:
        length = int.from_bytes(file.read(8), "little")
        try:
            _parse(str(target), file.read(length) if length <= _MOST_HEADER else b"")
        except MemoryFileError as error:
            raise MemoryFileError(
                f"{target}: holds something else; give --force (in Python, force=True) to replace it, or another file"
            ) from error
