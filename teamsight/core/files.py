"""Regular files on disk, written beside their place and moved there when complete."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

from teamsight.core.checks import shown

# A name may have 255 bytes; that of a draft is 23 bytes longer than the file's.
_MOST_OF_A_NAME = 200
_KINDS = (
    (stat.S_ISLNK, "link", "the path that it leads to"),
    (stat.S_ISDIR, "folder", "a file"),
    (stat.S_ISFIFO, "named pipe", "a regular file"),
    (stat.S_ISSOCK, "socket", "a regular file"),
    (stat.S_ISCHR, "device", "a regular file"),
    (stat.S_ISBLK, "device", "a regular file"),
)


class UnwritableError(ValueError):
    """Raised when a file cannot be written at the given path."""


def check_name(path: str | os.PathLike[str]) -> None:
    """Raise an error for a path that is certainly a mistake. Nothing in a path is expanded.

    Raises
    ------
    UnwritableError
        If it is empty, has a null character, or begins with a home folder that was not expanded.
    """
    text = os.fsdecode(path)
    if not text.strip():
        raise UnwritableError(f"path={text!r}: is empty; give a file or a folder, such as results")
    if "\0" in text:
        raise UnwritableError(f"path={shown(text)}: contains a null character; remove it")
    if text.startswith("~"):
        raise UnwritableError(
            f"path={shown(text)}: ~ is not expanded; give Path(...).expanduser(), or an absolute path"
        )


def check_place(path: str | os.PathLike[str]) -> bool:
    """Return whether there is a regular file at `path`; raise an error for anything else.

    Raises
    ------
    UnwritableError
        If there is a folder, a link, a device, a named pipe or a socket, or the path cannot be examined.
    """
    try:
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        return False
    except OSError as error:
        raise unwritable(path, error) from error
    for is_kind, kind, wanted in _KINDS:
        if is_kind(mode):
            raise UnwritableError(f"{os.fspath(path)}: is a {kind}, which is never replaced; give {wanted}")
    return True


@contextlib.contextmanager
def complete(path: str | os.PathLike[str], check: Callable[[Path], object] = lambda target: None) -> Iterator[BinaryIO]:
    """Open a draft beside `path`, and move it to `path` when all of it is on disk.

    After an error or Ctrl-C, `path` is unchanged and the draft is removed.

    Parameters
    ----------
    path : path
        The file to write; ``~`` is not expanded but refused.
    check : callable
        Called with the path right before the draft is moved there; it raises if the file there must not be replaced.

    Raises
    ------
    UnwritableError
        If the draft cannot be created or written, or `path` exists and is not a regular file.
    """
    check_name(path)
    target = Path(path)
    check_place(target)
    # The name cannot be guessed, so no link can wait there; O_EXCL would refuse it.
    name = os.fsdecode(os.fsencode(target.name)[:_MOST_OF_A_NAME])
    draft = target.with_name(f".{name}.{secrets.token_hex(8)}.part")
    try:
        with open(draft, "xb", opener=_exclusive) as file:
            yield file
            file.flush()
            _sync(file.fileno())
        check_place(target)
        check(target)
        os.replace(draft, target)
        sync_folder(target.parent)
    except OSError as error:
        raise unwritable(target, error) from error
    finally:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)


@contextlib.contextmanager
def open_regular(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a regular file to read it; anything else, such as a named pipe, is refused without waiting.

    Raises
    ------
    OSError
        If there is no regular file.
    """
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | getattr(os, "O_NONBLOCK", 0))) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(errno.EINVAL, "Not a regular file", os.fspath(path))
        yield file


def unwritable(path: str | os.PathLike[str], error: OSError) -> UnwritableError:
    """Return the error for a path that cannot be written, on one line."""
    reason = error.strerror or str(error)
    return UnwritableError(f"{os.fspath(path)}: cannot be written ({reason}); give a path that can be")


def append(path: str | os.PathLike[str], content: bytes) -> None:
    """Append to a regular file, which is created if it does not exist; a link is not followed.

    Raises
    ------
    UnwritableError
        If it cannot be written.
    """
    check_place(path)
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    try:
        with open(path, "ab", opener=lambda name, _: os.open(name, flags, 0o666)) as file:
            file.write(content)
    except OSError as error:
        raise unwritable(path, error) from error


def sync_folder(folder: Path) -> None:
    """Wait until the new name in a folder is on disk, if the system supports that."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _exclusive(name: str, flags: int) -> int:
    # Not tempfile, whose files only their owner can read.
    return os.open(name, flags | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0), 0o666)


def _sync(number: int) -> None:
    """Wait until a file is on disk, if its file system supports that."""
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP):
            raise
