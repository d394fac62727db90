"""Unfinished work: outcomes of runs kept in a file while a command is under way, so that it can be interrupted."""

from __future__ import annotations

import contextlib
import hashlib
import json
import zlib
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

import teamsight

Key = tuple[str, ...]
Numbers = tuple[float, int]

_ROOMS = ("agents", "policies", "world")


class Unfinished:
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

    def outcomes(self, keys: Iterable[Key]) -> dict[Key, Numbers]:
        """Return the outcomes of those runs that are done."""
        return {key: self._found[name] for key in keys if (name := _name(key)) in self._found}

    def add(self, outcomes: Mapping[Key, Numbers]) -> None:
        """Keep some more; an interruption loses at most these."""
        new = {_name(key): numbers for key, numbers in outcomes.items()}
        with self.path.open("a", encoding="utf-8") as file:
            file.writelines(_line(name, numbers) for name, numbers in new.items())
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
    with contextlib.suppress(OSError):
        for line in path.read_bytes().split(b"\n"):
            text, _, sum_ = line.partition(b"\t")
            # The last line may have been cut off.
            if sum_ == b"%08x" % zlib.crc32(text):
                name, fraction, neighbours = json.loads(text)
                found[name] = (fraction, neighbours)
    return found


def _name(key: Key) -> str:
    return hashlib.blake2b("\0".join((*key, _simulation())).encode(), digest_size=16).hexdigest()


@cache
def _simulation() -> str:
    """Return a digest of the code that simulates; by another one, a run could have another outcome."""
    digest = hashlib.blake2b(teamsight.__version__.encode(), digest_size=16)
    for room in _ROOMS:
        module = __import__(f"teamsight.{room}", fromlist=["__path__"])
        for file in sorted(Path(module.__path__[0]).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()
