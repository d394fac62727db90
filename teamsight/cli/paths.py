"""Paths as options: the home folder is expanded, and what cannot be a path is refused."""

from __future__ import annotations

import contextlib
import os
import re
from pathlib import Path

from teamsight.core import checks

# A scheme of one letter is a drive of Windows.
_ADDRESS = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]+:/")


def path(name: str, given: str | os.PathLike[str], wanted: str) -> Path:
    """Return the path of a file or of a folder.

    Parameters
    ----------
    name : str
        What the error calls it.
    given : str or PathLike
        The path as it was given.
    wanted : {"a file", "a folder"}
        What it must be able to be.

    Raises
    ------
    ValueError
        If it cannot be such a path.
    """
    text = os.fspath(given)
    if not text.strip():
        raise ValueError(f"{name}={checks.shown(text)}: is empty; give {wanted}")
    if "\0" in text:
        raise ValueError(f"{name}={checks.shown(text)}: contains a null character; give {wanted}")
    if _ADDRESS.match(text):
        raise ValueError(f"{name}={checks.shown(text)}: is an address; give {wanted} on this machine")
    # Shells expand "~" neither in quotes nor behind "=".
    expanded = os.path.expanduser(text)
    if expanded.startswith("~"):
        raise ValueError(f"{name}={checks.shown(text)}: there is no such user; write ./~ for a name that begins so")
    if wanted == "a file" and os.path.basename(text) in ("", ".", ".."):
        raise ValueError(f"{name}={checks.shown(text)}: is a folder; give a file")
    found = Path(expanded)
    # pathlib drops the "./" of "./~", and the result would be expanded again.
    return found.absolute() if os.fspath(found).startswith("~") else found


def check_apart(option: str, path: Path, name: str, read: Path) -> None:
    """Refuse to overwrite a file that the command reads, even with ``--force``.

    Parameters
    ----------
    option, path : str, Path
        The option that names the output, and a file that would be written.
    name, read : str, Path
        What the file that is read is called, and its path.

    Raises
    ------
    ValueError
        If both are the same file.
    """
    with contextlib.suppress(OSError):  # one of them does not exist
        if os.path.samefile(path, read):
            raise ValueError(f"{option}={path}: is the {name} file, which would be overwritten; give another place")
