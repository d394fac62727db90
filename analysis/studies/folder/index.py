"""Index: which runs are in the undamaged parts of a folder, kept in memory between calls."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.layout import DONE, KINDS
from teamsight.analysis.studies.folder.parts import Damaged, DamagedError, Part
from teamsight.analysis.studies.folder.run_set import IDENTITY, RunSet, joined, runs_in

# What changes if a file is replaced or written to.
_Stamp = tuple[int, int, int, int]


class Examined(NamedTuple):
    """What an undamaged part has.

    Attributes
    ----------
    part : Part
        The part.
    runs : RunSet
        The run of each row.
    beside : dict of str to str
        The names of the other parts of its shard by kind.
    """

    part: Part
    runs: RunSet
    beside: dict[str, str]


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
        self._known: dict[str, tuple[_Stamp, Examined | Damaged]] = {}

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
        found = list(complete(self._folder, [entry for _, entry in self._known.values()]))
        runs = joined([entry.runs for entry in found if isinstance(entry, Examined)]).distinct()
        return runs, [entry for entry in found if isinstance(entry, Damaged)]


def examined(part: Part) -> Examined | Damaged:
    """Read a part and return what it has, or how it is damaged."""
    try:
        content = parts.load(part)
        return Examined(part, runs_of(part, content), parts.beside(part, content))
    except DamagedError as error:
        return error.damaged


def complete(folder: Path, found: Iterable[Examined | Damaged]) -> Iterator[Examined | Damaged]:
    """Yield what was found, and how a part is damaged in place of one beside which another was lost."""
    # After the parts themselves were listed: those beside them are written first, and set aside last.
    there = {kind: {part.path.name for part in parts.listed(folder, kind)} for kind in KINDS if kind not in DONE}
    for one in found:
        lost = [] if isinstance(one, Damaged) else [
            kind for kind, name in one.beside.items() if name not in there.get(kind, ())
        ]  # fmt: skip
        if isinstance(one, Examined) and lost:
            yield Damaged(one.part.kind, one.part.path.name, f"its part of {lost[0]} is lost")
        else:
            yield one


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
