"""The file format of lazy memories: safetensors, written atomically, verified and memory-mapped when it is read.

A safetensors file consists of the length of the header (8 bytes), the header as JSON, and the numbers; other programs
can read it without this package. The metadata, all strings, describe the numbers and hold two checksums: of the
numbers, and of the other metadata.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from teamsight.core import checks, files
from teamsight.policies.memory.order import Table

FORMAT, SCHEMA = "teamsight lazy memory", "1"

_ALIGNMENT = 64
_MOST_HEADER = 100_000_000
_TENSOR = "table"
_CHECKSUM = re.compile("[0-9a-f]{64}")
_OWN_NAMES = ("format", "schema", "sha256")


class MemoryFileError(ValueError):
    """Raised if a file cannot be written, or is not a complete and unaltered memory that this version can read."""


def write(
    path: str | os.PathLike[str], table: Table, sha256: str, about: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write a table and its description; an existing file is replaced only when the new one is complete.

    Parameters
    ----------
    path : path
        The file.
    table : ndarray, shape (columns, transitions), float32
        The numbers.
    sha256 : str
        Their checksum.
    about : mapping
        The description, JSON-serialisable.
    force : bool
        Replace any regular file; by default only a memory is replaced.

    Raises
    ------
    MemoryFileError
        If the file cannot be written, or an existing file may not be replaced.
    """
    metadata = {name: _text_of(value) for name, value in about.items()}
    metadata |= {"format": FORMAT, "schema": SCHEMA, "sha256": sha256}
    metadata["sha256_of_metadata"] = _sha256_of(metadata)
    tensor = {"dtype": "F32", "shape": table.shape, "data_offsets": [0, table.nbytes]}
    header = json.dumps({"__metadata__": metadata, _TENSOR: tensor}, ensure_ascii=False).encode()
    header += b" " * (-(8 + len(header)) % _ALIGNMENT)
    if len(header) > _MOST_HEADER:
        raise MemoryFileError(
            f"{path}: the settings take {len(header)} bytes; at most {_MOST_HEADER} fit; shorten them"
        )
    try:
        with files.complete(path, lambda target: _check_replaceable(target, force)) as file:
            file.write(len(header).to_bytes(8, "little") + header)
            # Not tofile, whose errors do not say why a write was incomplete.
            file.write(np.ascontiguousarray(table, "<f4").data.cast("B"))
    except files.UnwritableError as error:
        raise MemoryFileError(str(error)) from error


def read(path: str | os.PathLike[str], *, verify: bool = True) -> tuple[Table, str, dict[str, Any]]:
    """Return the table of a file, memory-mapped and read-only, its checksum, and its description.

    Parameters
    ----------
    path : path
        A file that `write` wrote.
    verify : bool
        Compare the numbers with their checksum, which reads all of them.

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
        raise MemoryFileError(f"{path}: is not a lazy memory, or was altered; give a file that LazyMemory.save wrote")
    if 8 + length > size:
        raise MemoryFileError(f"{path}: is cut off after {size} bytes; copy it again, or explore again")
    metadata, shape = _parse(path, file.read(length))
    if metadata.get("schema") != SCHEMA:
        raise MemoryFileError(
            f"{path}: has the schema {checks.shown(metadata.get('schema'))}, but this version of teamsight reads "
            f"{SCHEMA!r}; read it with the version that wrote it, or explore again"
        )
    missing = size - (8 + length + 4 * shape[0] * shape[1])
    if missing:
        what = f"is {-missing} bytes too short" if missing < 0 else f"has {missing} bytes too many"
        raise MemoryFileError(f"{path}: {what} for its {shape[1]} transitions; copy it again, or explore again")
    # The open file is mapped, even if another file takes its name meanwhile.
    table = np.memmap(file, np.dtype("<f4"), "r", 8 + length, shape).view(np.ndarray)
    stated = metadata.pop("sha256_of_metadata", None)
    if stated != _sha256_of(metadata) or (verify and metadata.get("sha256") != checksum(table)):
        raise MemoryFileError(f"{path}: was altered, since its checksum does not fit; copy it again, or explore again")
    about = {name: _value(path, name, text) for name, text in metadata.items() if name not in _OWN_NAMES}
    return table, metadata["sha256"], about


def _value(path: str, name: str, text: str) -> Any:
    """Return the value of a metadata text, provided that `write` could have written it: no NaN, no duplicate names."""
    try:
        value = json.loads(text)
        text.encode()
        if _text_of(value) == text:
            return value
    except (ValueError, RecursionError):
        pass
    raise MemoryFileError(
        f"{path}: its metadata is invalid ({checks.shown(name)} is {checks.shown(text)}); write it with LazyMemory.save"
    ) from None


def _text_of(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _parse(path: str, header: bytes) -> tuple[dict[str, str], tuple[int, int]]:
    """Return the metadata and the shape of the table; raise an error for any other header."""
    try:
        parsed = json.loads(header.decode(), object_pairs_hook=_distinct)
        metadata, tensor = parsed.pop("__metadata__"), parsed.pop(_TENSOR)
        columns, transitions = tensor["shape"]
        lengths = [columns, transitions, *tensor["data_offsets"]]
        if any(type(length) is not int for length in lengths) or min(columns, transitions) < 1:
            raise ValueError
        whole = {"dtype": "F32", "shape": [columns, transitions], "data_offsets": [0, 4 * columns * transitions]}
        if parsed or tensor != whole or (8 + len(header)) % _ALIGNMENT:
            raise ValueError
        if metadata["format"] != FORMAT or not all(isinstance(text, str) for text in metadata.values()):
            raise ValueError
        if metadata.get("schema") == SCHEMA and not _CHECKSUM.fullmatch(metadata["sha256"]):
            raise ValueError
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise MemoryFileError(
            f"{path}: its header is not that of a lazy memory, or was altered; give a file that LazyMemory.save wrote"
        ) from None
    return metadata, (columns, transitions)


def checksum(table: Table) -> str:
    """Return the SHA-256 of a dense table's bytes."""
    return hashlib.sha256(table.astype("<f4", copy=False).data).hexdigest()


def _sha256_of(metadata: Mapping[str, str]) -> str:
    return hashlib.sha256(json.dumps(metadata, sort_keys=True).encode()).hexdigest()


def _distinct(members: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(members)
    if len(found) < len(members):
        raise ValueError("duplicate name")
    return found


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
