"""Checkpoint: results kept in a file while a command runs, so that an interrupted command can resume."""

from __future__ import annotations

import ast
import contextlib
import glob
import hashlib
import importlib.util
import json
import re
import sys
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from teamsight.core import files, references

Key = tuple[str, ...]

# Packages of the code that decides the results of every run. The modules of its measure and model come to these.
_DECIDING = ("core", "world", "policies", "agents", "tasks", "analysis.runs")
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

    Results are stored under digests of the code of all runs and of the job's key, in which the job names its own code;
    see `Run.key`. Entries written by a different version of the code are ignored, and so are damaged ones. Each shard
    of the jobs has a file of its own beside it, so that machines which share a folder do not write into one.

    Parameters
    ----------
    path : Path
        The file.
    codec : Codec
        Conversion of the results.
    shard : (int, int), optional
        Add results to the file of shard i of n.
    """

    def __init__(self, path: Path, codec: Codec = JSON, shard: tuple[int, int] | None = None) -> None:
        self.path = path
        self.codec = codec
        self._own = path if shard is None else path.with_name("{}.{}-of-{}".format(path.name, *shard))

    def check(self) -> None:
        """Raise an error if another file stands at the path, since that would be appended to and deleted.

        Raises
        ------
        ValueError
            If it does.
        """
        for path in self._files():
            if files.check_place(path):
                with files.open_regular(path) as file:
                    if not _BEGINNING.fullmatch(file.read(_BEGINNING_LENGTH)):
                        raise ValueError(f"{path}: holds something else; move it away, or give another folder")

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

    def add(self, results: Mapping[Key, Any]) -> dict[Key, Exception]:
        """Append results; an interruption loses at most these. Return why those are left out that the codec refuses."""
        records, refused = list[bytes](), dict[Key, Exception]()
        for key, value in results.items():
            try:
                records.append(_record(_name(key), self.codec.encode(value)))
            except (TypeError, ValueError) as error:
                refused[key] = error
        if records:
            files.append(self._own, b"".join(records))
        return refused

    def forget(self, keys: Iterable[Key] | None = None) -> None:
        """Delete the results of these jobs, or all results; without any results, delete the file. Idempotent.

        Entries of different code are deleted too.
        """
        forgotten = set(map(_name, keys or ()))
        kept = {} if keys is None else {name: one for name, one in self._contents() if name not in forgotten}
        found = self._files()
        if kept:
            with files.complete(self.path) as draft:
                draft.writelines(_record(name, content) for name, content in kept.items())
        for path in found if not kept else found[1:]:
            path.unlink(missing_ok=True)

    def _files(self) -> list[Path]:
        """Return the file, and those of shards."""
        shards = self.path.parent.glob(f"{glob.escape(self.path.name)}.*-of-*")
        return [self.path, *sorted(path for path in shards if re.fullmatch(r"\.\d+-of-\d+", path.suffix))]

    def _contents(self) -> Iterator[tuple[str, bytes]]:
        """Yield name and content of each record of this code that is complete and undamaged."""
        for path in self._files():
            with contextlib.suppress(OSError), files.open_regular(path) as file:
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


def is_in_shard(key: Key, shard: tuple[int, int]) -> bool:
    """Return whether a job is one of shard i of n; that depends on nothing but its key."""
    number, count = shard
    digest = hashlib.blake2b("\0".join(key).encode(), digest_size=8, person=b"shard").digest()
    return int.from_bytes(digest) % count == number - 1


def _record(name: str, content: bytes) -> bytes:
    return b'\n["%s",%d,"%08x"]\n%s' % (name.encode(), len(content), zlib.crc32(content), content)


def _name(key: Key) -> str:
    """Return 32 hexadecimal digits: half of them a digest of the code, half one of the key."""
    return code_digest() + hashlib.blake2b("\0".join(key).encode(), digest_size=8).hexdigest()


@cache
def code_digest(*modules: str) -> str:
    """Return a digest of the code and the constants that decide results, 16 hexadecimal digits.

    Parameters
    ----------
    *modules : str
        Names of the modules that decide besides those of every run, with what they import; see `modules_of`.
    """
    digest = hashlib.blake2b(digest_size=8)
    for file in sources(*modules):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def sources(*modules: str) -> list[Path]:
    """Return the files of code and constants that decide results; see `code_digest`."""
    found = set(_files_of(modules))
    for name in _DECIDING:
        (folder, *_) = importlib.import_module(f"teamsight.{name}").__path__
        found.update(file for kind in _KINDS for file in Path(folder).rglob(kind))
    return sorted(found)


def _files_of(modules: Iterable[str]) -> Iterator[Path]:
    """Yield the files of modules and of those of teamsight, or beside them, that they import."""
    waiting, seen = list(modules), set[str]()
    while waiting:
        name = waiting.pop()
        if name in seen or f"{name}.".startswith(tuple(f"teamsight.{package}." for package in _DECIDING)):
            continue
        seen.add(name)
        if (file := _file_of(name)) is not None:
            yield file
            # Packages that are installed are not read further: a new version of them is another one of all.
            if not {"site-packages", "dist-packages"}.intersection(file.parts):
                waiting += _imported(file, name)


def _file_of(name: str) -> Path | None:
    """Return the file of a module; None if there is no such module, or it is not written in Python."""
    above = name.rpartition(".")[0]
    if above and (home := _file_of(above)) is not None and home.name != "__init__.py":
        # A function or a class. To look for it would import its module.
        return None
    file = getattr(sys.modules.get(name), "__file__", None)
    with contextlib.suppress(ImportError, ValueError):
        file = file or getattr(importlib.util.find_spec(name), "origin", None)
    return Path(file) if file and file.endswith(".py") else None


def _imported(file: Path, name: str) -> Iterator[str]:
    """Yield what a module imports, also when a function is called or by a text such as "package.module:Name"."""
    package = name if file.name == "__init__.py" else name.rpartition(".")[0]
    for node in _nodes(ast.parse(file.read_bytes())):
        found: list[str] = []
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            home = ".".join([*above, *([node.module] if node.module else [])])
            found = [home, *(f"{home}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and references.is_reference(node.value):
            found = [node.value.partition(":")[0]]
        for one in found:
            top = one.partition(".")[0]
            beside = file.parent / top
            if top in ("teamsight", name.partition(".")[0]) or beside.is_dir() or beside.with_suffix(".py").is_file():
                yield one


def _nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of a module, without what only type checkers import."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        yield node
        yield from _nodes(node)


def modules_of(*objects: object) -> tuple[str, ...]:
    """Return the names of the modules that define functions, classes and what is in dataclasses and mappings.

    Parameters
    ----------
    *objects : object
        What decides a result, such as the measure of a run.
    """
    return tuple(sorted(set(_modules_of(objects))))


def _modules_of(found: Iterable[object]) -> Iterator[str]:
    for one in found:
        if isinstance(one, Mapping):
            yield from _modules_of(one.values())
            continue
        home = getattr(one, "__module__", None) or type(one).__module__
        if home != "builtins":
            yield home
        if is_dataclass(one) and not isinstance(one, type):
            yield from _modules_of(getattr(one, field.name) for field in fields(one))
