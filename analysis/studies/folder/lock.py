"""The lock of a study: one sweep of all, or shards of a job array side by side."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from teamsight.analysis.studies.folder import file_lock
from teamsight.analysis.studies.folder.parts import ARRAY, LOCK, SHARD_LOCK, shard_file
from teamsight.core import checks, files

# A reader of the status holds the lock for an instant, which must not refuse a sweep.
_TRIES, _PAUSE = 6, 0.05
_WAITING_PAUSE = 0.2
_MOST_READ = 4096
# Held while a shard looks whether it may run.
_ADMISSION = ".admission"


class LockedError(ValueError):
    """Raised when another process holds the folder of a study."""


class Holder(NamedTuple):
    """A process that holds a lock.

    Attributes
    ----------
    pid : int
        Its number; 0 if it is not known.
    host : str
        Its machine.
    since : str
        When it took the lock (UTC), by the clock of its machine.
    shard : str
        The shard that it makes, as in "3/16"; empty if it makes all.
    """

    pid: int
    host: str
    since: str
    shard: str

    def __str__(self) -> str:
        what = f"shard {self.shard}" if self.shard else "a sweep"
        return f"{what}, process {self.pid} on {self.host} since {self.since}" if self.pid else f"{what}, now starting"


def check_shard(shard: tuple[int, int] | None) -> None:
    """Refuse a shard that is not i of n, from 1.

    Raises
    ------
    TypeError, ValueError
        If a number is not an integer, or out of range.
    """
    if shard is not None:
        part, parts = shard
        checks.count("shard", part, most=checks.count("shard", parts), cure="shards i/n are numbered from 1")


@contextlib.contextmanager
def locked(
    folder: Path, shard: tuple[int, int] | None, wait: bool, waiting: Callable[[str], object]
) -> Iterator[None]:
    """Hold the lock of all, or, for a shard, a shared lock and one of the shard.

    Parameters
    ----------
    folder : Path
        The folder of the study, which exists.
    shard, wait, waiting
        See `StudyFolder.lock`.

    Raises
    ------
    LockedError
        If another process holds it, and `wait` is not set.
    UnwritableError
        If a lock file cannot be written.
    """
    name = "" if shard is None else f"{shard[0]}/{shard[1]}"
    with contextlib.ExitStack() as held:
        own = held.enter_context(file_lock.opened(folder / LOCK))
        place = None if shard is None else shard[0]
        _acquire(lambda: own.take(place), folder, wait, waiting)
        if shard is not None:
            of_shard = own = held.enter_context(file_lock.opened(folder / ARRAY / shard_file(shard, "lock")))
            _acquire(lambda: _admitted(of_shard, shard[1], folder), folder, wait, waiting)
        own.note(_myself(name))
        yield


def holders(folder: Path) -> tuple[Holder, ...]:
    """Return who holds the locks of a study now; nothing is written."""
    found = []
    if file_lock.is_held(folder / LOCK):
        found.append(_noted(folder / LOCK, ""))
    with contextlib.suppress(OSError):
        for name in sorted(os.listdir(folder / ARRAY)):
            match = SHARD_LOCK.fullmatch(name)
            if match and file_lock.is_held(folder / ARRAY / name):
                found.append(_noted(folder / ARRAY / name, f"{int(match[1])}/{int(match[2])}"))
    return tuple(found)


def _admitted(own: file_lock.FileLock, parts: int, folder: Path) -> bool:
    """Take the lock of a shard i of n, unless shards of another n are being made: these share runs with it."""
    with file_lock.opened(folder / ARRAY / _ADMISSION) as admission:
        # One process at a time, since two that begin together would not see each other.
        if not admission.take():
            return False
        others = (holder.shard.partition("/")[2] for holder in holders(folder))
        return all(not other or int(other) == parts for other in others) and own.take()


def _acquire(take: Callable[[], bool], folder: Path, wait: bool, waiting: Callable[[str], object]) -> None:
    """Take a lock, or raise `LockedError`, or wait."""
    tries = 0
    while not take():
        tries += 1
        if tries == _TRIES:
            others = "; ".join(map(str, holders(folder))) or "another sweep"
            if not wait:
                raise LockedError(
                    f"{folder}: is in use ({others}); wait for it with --wait (in Python, wait=True), or stop it"
                )
            waiting(f"{folder}: is in use ({others}); waiting until it is free")
        time.sleep(_PAUSE if tries < _TRIES else _WAITING_PAUSE)


def _myself(name: str) -> bytes:
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    return json.dumps({"pid": os.getpid(), "host": socket.gethostname(), "since": now, "shard": name}).encode()


def _noted(path: Path, name: str) -> Holder:
    """Return what the holder of a lock has written into its file."""
    # The holder may be about to write.
    with contextlib.suppress(OSError, ValueError, TypeError, KeyError), files.open_regular(path) as file:
        found = json.loads(file.read(_MOST_READ))
        return Holder(int(found["pid"]), str(found["host"]), str(found["since"]), name)
    return Holder(0, "", "", name)
