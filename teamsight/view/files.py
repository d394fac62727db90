"""Files of replays: known by a mark, and written completely or not at all."""

from __future__ import annotations

import os

from teamsight.core.files import UnwritableError, check_name, check_place, complete, open_regular, unwritable
from teamsight.view.page import MARK

#: The mark in films and pictures.
SOFTWARE = "teamsight"
# Films and pictures: how they begin, where, and the mark. All have it in their first or last bytes.
_KINDS = (
    (0, MARK.encode(), MARK.encode()),
    (0, b"\x89PNG\r\n\x1a\n", b"Software\0" + SOFTWARE.encode()),
    (0, b"GIF8", SOFTWARE.encode()),
    (4, b"ftyp", SOFTWARE.encode()),
)
_ENDS = 100_000


def check_replaceable(path: str | os.PathLike[str], *, force: bool = False) -> None:
    """Raise an error if a file must not be replaced: one that is no recording of teamsight.

    Parameters
    ----------
    path : path
        Where the file is to be.
    force : bool
        Replace any regular file.

    Raises
    ------
    ValueError
        If it must not be replaced, or cannot be written.
    """
    check_name(path)
    folder = os.path.dirname(os.fspath(path)) or "."
    if not os.path.isdir(folder):
        raise UnwritableError(f"{os.fspath(path)}: cannot be written (there is no folder {folder}); make it first")
    if check_place(path) and not force and not _is_own(path):
        raise ValueError(
            f"{os.fspath(path)}: holds something else; give --force (in Python, force=True) to replace it, or another "
            "place"
        )


def write(path: str | os.PathLike[str], content: bytes, *, force: bool = False) -> None:
    """Write a recording; see `check_replaceable`."""
    with complete(path, lambda target: check_replaceable(target, force=force)) as draft:
        draft.write(content)


def _is_own(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a recording of teamsight."""
    try:
        with open_regular(path) as file:
            head = file.read(_ENDS)
            file.seek(max(os.fstat(file.fileno()).st_size - _ENDS, 0))
            content = head + file.read(_ENDS)
    except OSError as error:
        raise unwritable(path, error) from error
    return any(head[at:].startswith(start) and mark in content for at, start, mark in _KINDS)
