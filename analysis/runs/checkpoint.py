"""Checkpoint: results kept in a file while a command runs, so that an interrupted command can resume."""

from __future__ import annotations

import contextlib
import hashlib
import importlib.util
import json
import re
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from teamsight.core import files

Key = tuple[str, ...]

# Packages and modules of the code that decides results. Figures, claims and commands are not among them.
_DECIDING = (
    "core", "world", "policies", "agents", "tasks", "analysis.pursuit.conditions", "analysis.pursuit.trials",
    "analysis.pursuit.ono.conditions", "analysis.pursuit.ono.measure",
    "analysis.pushing.trials",
    "analysis.collecting.learning", "analysis.gathering.plan", "analysis.gathering.simulate",
    "analysis.unreliable.plan", "analysis.unreliable.subject",
    "analysis.runs", "analysis.learning", "analysis.evolution", "analysis.search_space",
    *(f"analysis.studies.{name}" for name in ("shard", "recording", "measured", "resolved", "part_tables", "failure")),
    *(f"analysis.studies.{name}" for name in ("plan", "definition.components", "definition.values")),
    "analysis.studies.definition.identity", "analysis.studies.definition.model",
)  # fmt: skip
_KINDS = ("*.py", "*.json", "*.safetensors")
# A record is a header line, which begins with a line break in case the record before it was cut off, and its content.
_HEADER = re.compile(rb'\["([0-9a-f]{32})",(\d{1,15}),"([0-9a-f]{8})"\]\n')
_BEGINNING_LENGTH = 36
_BEGINNING = re.compile(rb'\n(\["?|\["[0-9a-f]{1,32}|\["[0-9a-f]{32}",?)')


class Codec(NamedTuple):
    """Conversion of results to bytes and back; `decode` raises ValueError or TypeError for bytes of another form."""

    encode: Callable[[Any], bytes]
    decode: Callable[[bytes], Any]


#: Results that JSON can hold; floats return to the last bit.
JSON = Codec(lambda value: json.dumps(value, separators=(",", ":")).encode(), json.loads)


class Checkpoint:
    """Results of finished jobs in a file, which a command deletes when all its jobs are done.

    Results are stored under digests of the code and of the job's key. Entries written by a different version of the
    code are ignored, and so are damaged ones.

    Parameters
    ----------
    path : Path
        The file.
    codec : Codec
        Conversion of the results.
    """

    def __init__(self, path: Path, codec: Codec = JSON) -> None:
        self.path = path
        self.codec = codec

    def check(self) -> None:
        """Raise an error if another file stands at the path, since that would be appended to and deleted.

        Raises
        ------
        ValueError
            If it does.
        """
        if files.check_place(self.path):
            with files.open_regular(self.path) as file:
                if not _BEGINNING.fullmatch(file.read(_BEGINNING_LENGTH)):
                    raise ValueError(f"{self.path}: holds something else; move it away, or give another folder")

    def results(self, keys: Iterable[Key]) -> dict[Key, Any]:
        """Return the results of those jobs that are done.

        Parameters
        ----------
        keys : iterable of tuple of str
            Keys of the jobs.
        """
        names = {_name(key): key for key in keys}
        found = {}
        for name, content in self._contents():
            if name in names:
                with contextlib.suppress(ValueError, TypeError, RecursionError):
                    found[names[name]] = self.codec.decode(content)
        return found

    def count(self, keys: Iterable[Key] | None = None) -> int:
        """Return how many of these jobs are done, or how many jobs in all."""
        done = {name for name, _ in self._contents()}
        return len(done) if keys is None else sum(_name(key) in done for key in keys)

    def add(self, results: Mapping[Key, Any]) -> None:
        """Append results; an interruption loses at most these."""
        records = (_record(_name(key), self.codec.encode(value)) for key, value in results.items())
        files.append(self.path, b"".join(records))

    def forget(self, keys: Iterable[Key] | None = None) -> None:
        """Delete the results of these jobs, or all results; without any results, delete the file. Idempotent.

        Entries of different code are deleted too.
        """
        forgotten = set(map(_name, keys or ()))
        kept = {} if keys is None else {name: one for name, one in self._contents() if name not in forgotten}
        if not kept:
            self.path.unlink(missing_ok=True)
            return
        with files.complete(self.path) as draft:
            draft.writelines(_record(name, content) for name, content in kept.items())

    def _contents(self) -> Iterator[tuple[str, bytes]]:
        """Yield name and content of each record of this code that is complete and undamaged."""
        with contextlib.suppress(OSError), files.open_regular(self.path) as file:
            size = file.seek(0, 2)
            file.seek(0)
            for line in iter(file.readline, b""):
                if header := _HEADER.fullmatch(line):
                    start, length = file.tell(), int(header[2])
                    content = file.read(length) if length <= size - start else None
                    if content is None or zlib.crc32(content) != int(header[3], 16):
                        file.seek(start)
                    elif (name := header[1].decode()).startswith(code_digest()):
                        yield name, content


def _record(name: str, content: bytes) -> bytes:
    return b'\n["%s",%d,"%08x"]\n%s' % (name.encode(), len(content), zlib.crc32(content), content)


def _name(key: Key) -> str:
    """Return 32 hexadecimal digits: half of them a digest of the code, half one of the key."""
    return code_digest() + hashlib.blake2b("\0".join(key).encode(), digest_size=8).hexdigest()


@cache
def code_digest() -> str:
    """Return a digest of the code and the constants that decide results, 16 hexadecimal digits."""
    digest = hashlib.blake2b(digest_size=8)
    for file in sources():
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def sources() -> list[Path]:
    """Return the files of code and constants that decide results."""
    found: list[Path] = []
    for name in _DECIDING:
        spec = importlib.util.find_spec(f"teamsight.{name}")
        assert spec is not None
        if spec.submodule_search_locations:
            found += (file for kind in _KINDS for file in Path(spec.submodule_search_locations[0]).rglob(kind))
        else:
            found.append(Path(str(spec.origin)))
    return sorted(found)
