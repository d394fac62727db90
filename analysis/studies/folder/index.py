"""Index: which runs are in the undamaged parts of a folder, kept in memory between calls."""

from __future__ import annotations

import os
from pathlib import Path

from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.parts import Damaged, DamagedError, Part
from teamsight.analysis.studies.folder.run_set import IDENTITY, RunSet, joined, runs_in

# What changes if a file is replaced or written to.
_Stamp = tuple[int, int, int, int]


class Index:
    """The runs of one kind of parts. A part is read again only if its file has changed.

    Parameters
    ----------
    folder : Path
        The folder of the study.
    kind : str
        Which parts.
    """

    def __init__(self, folder: Path, kind: str) -> None:
        self._folder = folder
        self._kind = kind
        self._known: dict[str, tuple[_Stamp, RunSet | Damaged]] = {}

    def update(self) -> tuple[RunSet, list[Damaged]]:
        """Return the distinct runs of the undamaged parts that are there now, and the damaged parts."""
        known, self._known = self._known, {}
        for part in parts.listed(self._folder, self._kind):
            name = part.path.name
            try:
                stamp = _stamp(part.path)
                if name in known and known[name][0] == stamp:
                    self._known[name] = known[name]
                else:
                    self._known[name] = stamp, examined(part)
            except FileNotFoundError:
                # It was set aside meanwhile.
                continue
        found = [entry for _, entry in self._known.values()]
        runs = joined([entry for entry in found if isinstance(entry, RunSet)]).distinct()
        return runs, [entry for entry in found if isinstance(entry, Damaged)]


def examined(part: Part) -> RunSet | Damaged:
    """Read a part and return the run of each row, or how it is damaged."""
    try:
        return runs_of(part, parts.load(part))
    except DamagedError as error:
        return error.damaged


def runs_of(part: Part, content: bytes) -> RunSet:
    """Return the run of each row of a part.

    Raises
    ------
    DamagedError
        If it has no such rows.
    """
    try:
        return runs_in(parts.rows(part, content, IDENTITY))
    except DamagedError:
        raise
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def _stamp(path: Path) -> _Stamp:
    found = os.lstat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
