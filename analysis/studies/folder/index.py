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
    not_finite : dict of str to RunSet
        The runs of which a measure is NaN or infinite, by its name.
    """

    part: Part
    runs: RunSet
    beside: dict[str, str]
    not_finite: dict[str, RunSet]


class Contents(NamedTuple):
    """What the parts of a kind have.

    Attributes
    ----------
    runs : RunSet
        The distinct runs of the undamaged parts.
    damaged : list of Damaged
        The damaged parts, and those beside which another was lost.
    lost : RunSet
        The distinct runs of parts beside which another was lost.
    not_finite : dict of str to int
        In how many of the runs a measure is NaN or infinite, by its name; without those where it never is.
    """

    runs: RunSet
    damaged: list[Damaged]
    lost: RunSet
    not_finite: dict[str, int]


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

    def update(self) -> Contents:
        """Return what the parts have that are there now."""
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
        entries = [entry for _, entry in self._known.values()]
        found = list(complete(self._folder, entries))
        whole = [entry for entry in found if isinstance(entry, Examined)]
        runs = joined([entry.runs for entry in whole]).distinct()
        lost = joined([entry.runs for entry in entries if isinstance(entry, Examined)]).without(runs)
        names = dict.fromkeys(name for entry in whole for name in entry.not_finite)
        odd = {name: joined([entry.not_finite[name] for entry in whole if name in entry.not_finite]) for name in names}
        return Contents(
            runs, [entry for entry in found if isinstance(entry, Damaged)], lost,
            {name: given.distinct().size for name, given in odd.items()},
        )  # fmt: skip


def examined(part: Part) -> Examined | Damaged:
    """Read a part and return what it has, or how it is damaged."""
    try:
        content = parts.load(part)
        return Examined(part, runs_of(part, content), parts.beside(part, content), _not_finite(part, content))
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


def _not_finite(part: Part, content: bytes) -> dict[str, RunSet]:
    """Return the runs of which a measure is NaN or infinite, by its name; None is neither."""
    import pyarrow.compute as pc

    # What events hold is listed beside the measures, with a prefix that no column has.
    names = [name for name, kind in parts.noted(part, content, parts.HOLDS).items() if kind == "number"]
    table = parts.rows(part, content, [*IDENTITY, *names]) if names else None
    if table is None:
        return {}
    odd = {
        name: pc.invert(pc.fill_null(pc.is_finite(table[name]), True)) for name in names if name in table.column_names
    }
    return {name: runs_in(table.filter(mask)) for name, mask in odd.items() if pc.any(mask).as_py()}


def _stamp(path: Path) -> _Stamp:
    found = os.lstat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
