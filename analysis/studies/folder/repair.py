"""Which runs are made again after damaged parts were set aside."""

from __future__ import annotations

import os
from collections import defaultdict

import numpy as np

from teamsight.analysis.studies.folder.progress import Progress
from teamsight.analysis.studies.folder.run_set import RunSet
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.folder.verify import Verification


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
