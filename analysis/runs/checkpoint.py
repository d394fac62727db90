"""Checkpoint work: outcomes of runs kept in a file while a command is under way, so that it can be interrupted."""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import re
import zlib
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import teamsight
from teamsight.core import files

Key = tuple[str, ...]
Numbers = tuple[float, int]

_ROOMS = ("agents", "policies", "world")
# How our own begins: a break, and the digest of a run's key, which may have been cut off.
_BEGINNING_LENGTH = 36
_BEGINNING = re.compile(rb'\n(\["?|\["[0-9a-f]{1,32}|\["[0-9a-f]{32}",?)')
_KINDS = ("*.py", "*.json", "*.safetensors")


class Checkpoint:
    """Outcomes of runs, in a file that is there only until all of them are made.

    A line is the digest of a run's key and its outcome, and a checksum of both. What another version of the simulation
    has left is not believed.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._found = _read(path)

    def __len__(self) -> int:
        return len(self._found)

    def __bool__(self) -> bool:
        return True

    def check(self) -> None:
        """Refuse a place where something else stands, which would be written into and deleted.

        Raises
        ------
        ValueError
            If it does.
        """
        if files.check_place(self.path):
            with files.open_regular(self.path) as file:
                if not _BEGINNING.fullmatch(file.read(_BEGINNING_LENGTH)):
                    raise ValueError(f"{self.path}: holds something else; move it away, or give another folder")

    def outcomes(self, keys: Iterable[Key]) -> dict[Key, Numbers]:
        """Return the outcomes of those runs that are done."""
        return {key: self._found[name] for key in keys if (name := _name(key)) in self._found}

    def add(self, outcomes: Mapping[Key, Numbers]) -> None:
        """Keep some more; an interruption loses at most these."""
        new = {_name(key): numbers for key, numbers in outcomes.items()}
        files.append(self.path, "".join(_line(name, numbers) for name, numbers in new.items()))
        self._found |= new

    def forget(self) -> None:
        """Delete the file: all is done."""
        self.path.unlink(missing_ok=True)


def _line(name: str, numbers: Numbers) -> str:
    text = json.dumps([name, *numbers], separators=(",", ":"))
    # A line begins with its break: so the one before it is over, even if it was cut off.
    return f"\n{text}\t{zlib.crc32(text.encode()):08x}"


def _read(path: Path) -> dict[str, Numbers]:
    found: dict[str, Numbers] = {}
    with contextlib.suppress(OSError), files.open_regular(path) as file:
        for line in file.read().split(b"\n"):
            text, _, sum_ = line.partition(b"\t")
            # The last line may have been cut off.
            if sum_ == b"%08x" % zlib.crc32(text):
                with contextlib.suppress(ValueError, TypeError, RecursionError):
                    name, numbers = _outcome(json.loads(text))
                    found[name] = numbers
    return found


def _outcome(line: list[object]) -> tuple[str, Numbers]:
    """Return what a line tells; raise a ValueError or TypeError if it is of another form, be its sum right."""
    name, fraction, neighbours = line
    if not isinstance(name, str) or type(fraction) is not float or type(neighbours) is not int:
        raise TypeError
    return name, (fraction, neighbours)


def _name(key: Key) -> str:
    return hashlib.blake2b("\0".join((*key, _simulation())).encode(), digest_size=16).hexdigest()


@cache
def _simulation() -> str:
    """Return a digest of what simulates."""
    digest = hashlib.blake2b(digest_size=16)
    for file in sources():
        digest.update(file.read_bytes())
    return digest.hexdigest()


def sources() -> list[Path]:
    """Return the files of code and constants that simulate; with others, a run could have another outcome."""
    # The leaf modules stand beside the face, whose own __path__ may begin with a whole repository.
    found = [*Path(str(teamsight.__file__)).parent.glob("*.py")]
    for room in _ROOMS:
        folder = Path(importlib.import_module(f"teamsight.{room}").__path__[0])
        found += [file for kind in _KINDS for file in folder.rglob(kind)]
    return sorted(found)
