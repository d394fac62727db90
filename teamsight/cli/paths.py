"""Paths as options: the home folder expanded, and refused at once where no file or folder can be meant."""

from __future__ import annotations

import contextlib
import os
import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationInfo

from teamsight.core import checks

# A scheme of one letter is a drive of Windows.
_ADDRESS = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]+:/")


def _path(value: Any, info: ValidationInfo, wanted: str) -> Path | None:
    if value is None:
        return None
    text, name = os.fspath(value), info.field_name
    if not text.strip():
        raise ValueError(f"{name}={checks.shown(text)}: is empty; give {wanted}")
    if "\0" in text:
        raise ValueError(f"{name}={checks.shown(text)}: holds a null character, as no path can; give {wanted}")
    if _ADDRESS.match(text):
        raise ValueError(f"{name}={checks.shown(text)}: is an address; give {wanted} on this machine")
    # Shells expand "~" neither in quotes nor behind "=".
    expanded = os.path.expanduser(text)
    if expanded.startswith("~"):
        raise ValueError(f"{name}={checks.shown(text)}: there is no such user; write ./~ for a name that begins so")
    path = Path(expanded)
    # The path of ./~ has lost what tells it from the home folder.
    return path.absolute() if os.fspath(path).startswith("~") else path


def check_apart(option: str, path: Path, name: str, read: Path) -> None:
    """Refuse to write over the file that a command reads, also when forced.

    Parameters
    ----------
    option, path : str, Path
        The option that tells where to write, and a file that would be written.
    name, read : str, Path
        What the file that is read is called, and its path.

    Raises
    ------
    ValueError
        If both are one file.
    """
    with contextlib.suppress(OSError):  # one of them is not there
        if os.path.samefile(path, read):
            raise ValueError(f"{option}={path}: is the file of the {name}, which would be lost; give another place")


def _folder(value: Any, info: ValidationInfo) -> Path | None:
    return _path(value, info, "a folder")


def _file(value: Any, info: ValidationInfo) -> Path | None:
    path = _path(value, info, "a file")
    if path is not None and os.path.basename(os.fspath(value)) in ("", ".", ".."):
        raise ValueError(f"{info.field_name}={checks.shown(os.fspath(value))}: is a folder; give a file")
    return path


#: Options that name a file, to be read or to be written.
FilePath = Annotated[Path, BeforeValidator(_file)]
#: Options that name a folder.
FolderPath = Annotated[Path, BeforeValidator(_folder)]
