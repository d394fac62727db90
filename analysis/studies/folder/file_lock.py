"""Locks on files, which end with the process that holds them, however it ends."""

from __future__ import annotations

import contextlib
import errno
import importlib
import os
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from teamsight.core import files

# What file systems answer that do not support locks.
_UNSUPPORTED = {errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOLCK, errno.EINVAL}
# On Windows other processes cannot read locked bytes, so these stand far behind the content.
_FIRST_BYTE, _BYTES = 1 << 30, 1 << 20


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
        self._path = path
        self._number = number
        self._is_noted = False

    def take(self, place: int | None = None) -> bool:
        """Take the lock and return True, or return False if another process has it.

        Parameters
        ----------
        place : int, optional
            Take a lock that does not exclude those of other places, from 1; by default one that excludes all.
        """
        if not _try(self._number, place):
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
    """Return whether another process holds the lock of all places of a file; False if that cannot be found out.

    Parameters
    ----------
    path : Path
        The file, which need not exist, and is not written.
    """
    try:
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except OSError:
        return False
    try:
        # No shard has place 0, which a lock of all excludes. A file that is only read cannot be locked in another way
        # on network file systems.
        return not _try(number, 0, warn=False)
    except OSError:
        return False
    finally:
        os.close(number)


def _open(path: Path) -> int:
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    return os.open(path, flags, 0o666)


def _try(number: int, place: int | None, *, warn: bool = True) -> bool:
    """Try to lock a file, and return whether that was possible."""
    try:
        if system := _module("fcntl"):
            system.flock(number, system.LOCK_NB | (system.LOCK_EX if place is None else system.LOCK_SH))
        elif system := _module("msvcrt"):
            # This system locks bytes, all of them or that of the place.
            os.lseek(number, _FIRST_BYTE + (place or 0), os.SEEK_SET)
            system.locking(number, system.LK_NBLCK, _BYTES if place is None else 1)
    except (BlockingIOError, PermissionError):
        return False
    except OSError as error:
        if error.errno not in _UNSUPPORTED:
            if error.errno in (errno.EDEADLK, getattr(errno, "EDEADLOCK", errno.EDEADLK)):
                return False
            raise
        if warn:
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
