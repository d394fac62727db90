"""`verify`: read every part of a study, set damaged ones aside, and say which runs must be made again."""

from __future__ import annotations

import contextlib
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.parts import (
    IDENTITY,
    KINDS,
    Damaged,
    DamagedError,
    Examined,
    Part,
    RunSet,
    complete,
    drafts,
    foreign_parts,
    joined,
    remove_drafts,
    runs_in,
    set_aside,
)
from teamsight.analysis.studies.folder.progress import Progress
from teamsight.analysis.studies.folder.study_folder import StudyFolder, why_strange

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


def runs_to_repeat(folder: str | os.PathLike[str], found: Verification) -> RunSet | None:
    """Return the runs that were in damaged parts and are missing now; None for all that are missing.

    All are meant if some are not known by name, and none was missing before: the last sweeps had ended with all made.

    Parameters
    ----------
    folder : path
        The folder of the study.
    found : Verification
        What `verify` has set aside.
    """
    place = StudyFolder(folder)
    if found.unnamed and _were_complete(place):
        return None
    ids = np.array([int(run.partition("-")[0], 16) for run in found.runs], np.uint64)
    replicates = np.array([int(run.partition("-")[2]) for run in found.runs], np.int64)
    return RunSet(ids, replicates).without(place.done()).without(place.failed())


def _were_complete(place: StudyFolder) -> bool:
    """Return whether the last sweep of all, or the last one of every shard of a job array, has left nothing missing."""
    study, last = place.study, place.progress
    # Each shard of a job array knows of its own runs; of an adaptive study, as far as it has found out.
    totals: defaultdict[str, int] = defaultdict(int)
    for each in last:
        totals[each.shard.partition("/")[2]] += each.total
    planned = max(study.settings * study.replicates, *totals.values(), 0)
    groups: dict[str, list[Progress]] = {}
    for each in last:
        if each.has_ended and each.done + each.failed == each.total:
            groups.setdefault(each.shard.partition("/")[2], []).append(each)
    return any(
        len(group) == int(count or 1) and sum(each.total for each in group) >= planned
        for count, group in groups.items()
    )
