"""`verify`: read every part of a study, and set damaged ones aside."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.aside import drafts, remove_drafts, set_aside
from teamsight.analysis.studies.folder.belonging import why_strange
from teamsight.analysis.studies.folder.index import Examined, complete
from teamsight.analysis.studies.folder.layout import KINDS, foreign_parts
from teamsight.analysis.studies.folder.parts import Damaged, DamagedError, Part
from teamsight.analysis.studies.folder.run_set import IDENTITY, joined, runs_in
from teamsight.analysis.studies.folder.study_folder import StudyFolder

if TYPE_CHECKING:
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study


class Verification(NamedTuple):
    """What was found.

    Attributes
    ----------
    parts : int
        Parts that were read.
    damaged : tuple of Damaged
        Parts that are damaged or belong to another study.
    aside : tuple of str
        Where parts were moved, below the folder; with a damaged part go the others of its shard.
    runs : tuple of str
        Ids of the runs of their shards, as far as they are known for certain.
    unnamed : int
        Shards among them whose runs are not all known.
    foreign : tuple of str
        Files among the parts that are none, which are left where they are.
    drafts : int
        Drafts that killed processes have left; they are removed by a repair.
    """

    parts: int
    damaged: tuple[Damaged, ...]
    aside: tuple[str, ...]
    runs: tuple[str, ...]
    unnamed: int
    foreign: tuple[str, ...]
    drafts: int


def verify(folder: str | os.PathLike[str], repair: bool = True) -> Verification:
    """Read all parts of a study; set those aside that are damaged.

    Parameters
    ----------
    folder : path
        The folder of the study.
    repair : bool
        Move damaged parts to ``damaged/`` below it; they are never deleted. Without, nothing is changed.

    Raises
    ------
    LockedError
        If a sweep runs, and `repair` is set.
    ValueError
        If this is not the folder of a study.
    """
    place = StudyFolder(folder)
    study = place.study
    plan = study.plan()
    with place.lock() if repair else contextlib.nullcontext():
        found = [part for kind in KINDS for part in parts.listed(place.path, kind)]
        damaged = tuple(_damage(place.path, found, study, plan))
        shards = {each.name.partition("-")[0]: list[Part]() for each in damaged}
        for part in found:
            if part.shard in shards:
                shards[part.shard].append(part)
        # Parts that are set aside can no longer be read.
        named = [_runs_of(*shard) for shard in sorted(shards.items())]
        runs, unnamed = sorted(set().union(*named)), sum(parts.shard_of(names) not in shards for names in named)
        foreign, left = _foreign(place.path), len(drafts(place.path))
        aside = set_aside(place.path, shards) if repair else []
        if repair:
            remove_drafts(place.path)
    return Verification(len(found), damaged, tuple(aside), tuple(runs), unnamed, foreign, left)


def _damage(folder: Path, found: Iterable[Part], study: Study, plan: Plan) -> Iterator[Damaged]:
    """Yield each part that is damaged, of another study, or without the parts that were written beside it."""
    whole = []
    for part in found:
        try:
            content = parts.load(part)
            why = why_strange(part, content, study, plan)
            whole.append(Examined(part, joined([]), parts.beside(part, content), {}))
        except DamagedError as error:
            yield error.damaged
        except FileNotFoundError:
            # Set aside by another process, where this one only looks.
            continue
        else:
            if why:
                yield Damaged(part.kind, part.path.name, why)
                whole.pop()
    yield from (one for one in complete(folder, whole) if isinstance(one, Damaged))


def _runs_of(shard: str, found: list[Part]) -> set[str]:
    """Return the ids of the runs of a shard: those of its undamaged parts, and all if its name confirms them."""
    certain, names = set[str](), set[str]()
    for part in found:
        # A damaged part may still be readable; its reader raises errors of many kinds.
        with contextlib.suppress(Exception):
            content = parts.bytes_of(part)
            here = runs_in(parts.rows(part, content, IDENTITY)).distinct().names()
            names.update(here)
            certain.update(here if parts.is_whole(part, content) else ())
    return names if parts.shard_of(names) == shard else certain


def _foreign(folder: Path) -> tuple[str, ...]:
    """Return files among the parts that are neither parts nor drafts nor hidden."""
    found: list[str] = []
    for kind in KINDS:
        with contextlib.suppress(FileNotFoundError):
            found += foreign_parts(folder, kind)
    return tuple(found)
