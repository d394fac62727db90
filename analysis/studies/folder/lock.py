"""The lock of a study: one sweep of all, or shards of a job array side by side; it ends with its process.

The package filelock does not do: it opens the file of a lock for writing, which empties it, so that nobody could note
there who holds it, and `status` could not ask about a folder that it may only read.
"""

from __future__ import annotations

import contextlib
import errno
import importlib
import json
import os
import socket
import time
import warnings
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from teamsight.analysis.studies.folder.parts import ARRAY, LOCK, SHARD_LOCK, shard_file
from teamsight.core import checks, files

# A reader of the status holds the lock for an instant, which must not refuse a sweep.
_TRIES, _PAUSE = 6, 0.05
_WAITING_PAUSE = 0.2
_MOST_READ = 4096
# What file systems answer that do not support locks.
_UNSUPPORTED = {errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOLCK, errno.EINVAL}
# On Windows other processes cannot read locked bytes, so this one stands far behind the content.
_LOCKED_BYTE = 1 << 30
# Held for a moment, by whoever takes a lock or changes the manifest.
_TURN = ".turn"


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
    """Hold the lock of all, or of a shard; see `StudyFolder.lock`. The folder exists."""
    name = "" if shard is None else f"{shard[0]}/{shard[1]}"

    def is_free(holder: Holder) -> bool:
        # Shards of two divisions would share runs.
        return bool(name and holder.shard) and holder.shard.partition("/")[2] == name.partition("/")[2]

    def take() -> bool:
        # One process at a time, since two that begin together would not see each other.
        with exclusively(folder):
            return all(map(is_free, holders(folder))) and own.take()

    with opened(folder / LOCK if shard is None else folder / ARRAY / shard_file(shard, "lock")) as own:
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
        now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
        own.note(json.dumps(Holder(os.getpid(), socket.gethostname(), now, name)._asdict()).encode())
        yield


def holders(folder: Path) -> tuple[Holder, ...]:
    """Return who holds the locks of a study now; nothing is written."""
    places = {folder / LOCK: ""}
    with contextlib.suppress(OSError):
        for name in sorted(os.listdir(folder / ARRAY)):
            if match := SHARD_LOCK.fullmatch(name):
                places[folder / ARRAY / name] = f"{int(match[1])}/{int(match[2])}"
    return tuple(_noted(path, shard) for path, shard in places.items() if is_held(path))


def _noted(path: Path, shard: str) -> Holder:
    """Return what the holder of a lock has written into its file."""
    # The holder may be about to write.
    with contextlib.suppress(OSError, ValueError, TypeError, KeyError), files.open_regular(path) as file:
        found = json.loads(file.read(_MOST_READ))
        return Holder(int(found["pid"]), str(found["host"]), str(found["since"]), shard)
    return Holder(0, "", "", shard)


@contextlib.contextmanager
def exclusively(folder: Path) -> Iterator[None]:
    """Hold a lock of the folder for a moment, after waiting for it."""
    with opened(folder / _TURN) as lock:
        while not lock.take():
            time.sleep(0.02)
        yield


class FileLock:
    """A file that can be locked.

    Parameters
    ----------
    path : Path
        The file.
    number : int
        Its file descriptor, open for reading and writing.
    """

    def __init__(self, path: Path, number: int) -> None:
        self._path, self._number = path, number
        self._is_noted = False

    def take(self) -> bool:
        """Take the lock and return True, or return False if another process has it."""
        if not _try(self._number):
            return False
        # Whoever deletes the file of a lock lets others create and lock a new one.
        with contextlib.suppress(OSError):
            if os.path.samestat(os.fstat(self._number), os.stat(self._path)):
                return True
        try:
            replacement = _open(self._path)
        except OSError as error:
            raise files.unwritable(self._path, error) from error
        os.close(self._number)
        self._number = replacement
        return False

    def note(self, content: bytes) -> None:
        """Write who holds the lock, for readers; an error, such as that of a full disk, is ignored."""
        self._is_noted = True
        with contextlib.suppress(OSError):
            os.ftruncate(self._number, 0)
            os.lseek(self._number, 0, os.SEEK_SET)
            os.write(self._number, content)

    def close(self) -> None:
        """Release the lock."""
        with contextlib.suppress(OSError):
            if self._is_noted:
                os.ftruncate(self._number, 0)
            os.close(self._number)


@contextlib.contextmanager
def opened(path: Path) -> Iterator[FileLock]:
    """Open a file to lock it, and release the lock at the end; the file stays.

    Raises
    ------
    UnwritableError
        If it cannot be written.
    """
    try:
        path.parent.mkdir(exist_ok=True)
        lock = FileLock(path, _open(path))
    except OSError as error:
        raise files.unwritable(path, error) from error
    try:
        yield lock
    finally:
        lock.close()


def is_held(path: Path) -> bool:
    """Return whether another process holds the lock of a file; False if that cannot be found out.

    Parameters
    ----------
    path : Path
        The file, which need not exist, and is not written.
    """
    with contextlib.suppress(OSError):
        number = _open(path, os.O_RDONLY)
        try:
            return not _try(number, is_asked=True)
        finally:
            os.close(number)
    return False


def _open(path: Path, how: int = os.O_RDWR | os.O_CREAT) -> int:
    return os.open(path, how | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0), 0o666)


def _try(number: int, *, is_asked: bool = False) -> bool:
    """Try to lock a file, and return whether that was possible; `is_asked` if it is only read, and freed at once."""
    try:
        if system := _module("fcntl"):
            # A file that is only read cannot be locked in another way on network file systems.
            system.flock(number, system.LOCK_NB | (system.LOCK_SH if is_asked else system.LOCK_EX))
        elif system := _module("msvcrt"):
            os.lseek(number, _LOCKED_BYTE, os.SEEK_SET)
            system.locking(number, system.LK_NBLCK, 1)
    except (BlockingIOError, PermissionError):
        return False
    except OSError as error:
        if error.errno not in _UNSUPPORTED:
            if error.errno in (errno.EDEADLK, getattr(errno, "EDEADLOCK", errno.EDEADLK)):
                return False
            raise
        if not is_asked:
            warnings.warn(
                f"this file system has no locks ({error.strerror}); start no second sweep of this folder meanwhile",
                stacklevel=2,
            )
    return True


def _module(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None
