"""`rerun`: repeat one run of a study in this process, and compare it with what is stored."""

from __future__ import annotations

import contextlib
import os
import re
import struct
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.shard import OWN_COLUMNS, ShardRun, common_of, end_recording, recording
from teamsight.core import checks, references

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

_RUN = re.compile(r"([0-9a-f]{16})-(0|[1-9]\d{0,8})")


class Rerun(NamedTuple):
    """A run that was repeated.

    Attributes
    ----------
    run : str
        Its id.
    seed, steps : int
        Its seed and steps.
    parameters : dict of str to object
        Its parameters.
    measures : dict of str to object
        What was measured now.
    stored : dict of str to object, or None
        What is stored; None if the run is missing or has failed.
    error : str or None
        The stored error, if the run has failed.
    differing : tuple of str
        Names of the measures that are not the same to the last bit.
    """

    run: str
    seed: int
    steps: int
    parameters: dict[str, object]
    measures: dict[str, object]
    stored: dict[str, object] | None
    error: str | None
    differing: tuple[str, ...]


class PlannedRun(NamedTuple):
    """One run of a study that has a folder, and what is stored of it; see `Rerun`.

    `changed` names what is not as it was in the sweep: teamsight itself, or modules that the study names.
    """

    study: Study
    plan: Plan
    run: str
    setting: int
    seed: int
    parameters: dict[str, object]
    stored: dict[str, object] | None
    error: str | None
    changed: tuple[str, ...]

    def recipe(self) -> tuple[Callable[..., World], dict[str, Any]]:
        """Return what builds the world of the run, and its arguments without the seed, which it takes as ``rng``."""
        with contextlib.ExitStack() as stack:
            stack.callback(end_recording)
            recorder = stack.enter_context(recording(common_of(self.study, self.plan.types)))
            return recorder.model, dict(recorder.parameters(self.parameters))

    def make(self) -> Rerun:
        """Make the run in this process, and compare it. An error of the run is raised as it is."""
        common = common_of(self.study, self.plan.types)
        with contextlib.ExitStack() as stack:
            stack.callback(end_recording)
            recorder = stack.enter_context(recording(common))
            setting, _, replicate = self.run.partition("-")
            run = ShardRun(setting, int(replicate), self.seed, self.parameters)
            found, _ = recorder.make(run, recorder.parameters(self.parameters))
            measures = recorder.measured(found).values
        names = dict.fromkeys([*measures, *(self.stored or {})])
        stored = measures if self.stored is None else self.stored
        differing = tuple(name for name in names if not _is_same(measures.get(name), stored.get(name)))
        return Rerun(
            self.run, self.seed, common.steps, self.parameters, measures, self.stored, self.error, differing
        )  # fmt: skip


def rerun(folder: str | os.PathLike[str], run: str) -> Rerun:
    """Repeat one run of a study in this process.

    An error of the run is raised as it is, so that a debugger shows where it arose.

    Parameters
    ----------
    folder : path
        The folder of the study.
    run : str
        The id of the run, such as ``"0123456789abcdef-7"``.

    Raises
    ------
    ValueError
        If the folder is not that of a study, or the study has no such run.
    """
    return planned_run(folder, run).make()


def planned_run(folder: str | os.PathLike[str], run: str) -> PlannedRun:
    """Return a run of a study by its id; see `rerun`."""
    found = _RUN.fullmatch(run)
    if found is None:
        raise ValueError(
            f"run={checks.shown(run)}: is no run id; copy one from the table, such as 0123456789abcdef-7"
        )
    place = StudyFolder(folder)
    study = place.study
    plan = study.plan()
    # Before anything of the study is imported.
    references.search_in([] if study.path is None else [os.fspath(study.path)])
    with contextlib.suppress(Exception):
        # The error of a study that cannot be checked any more is that of the run.
        study.check()
    replicate = int(found[2])
    most = study.replicates if study.until is None else max(study.until.limit, study.replicates)
    setting = int(plan.index_of(np.array([int(found[1], 16)], np.uint64))[0])
    if setting < 0:
        raise ValueError(f"run={checks.shown(run)}: {place.path} has no such setting; copy the id from its table")
    row = _row(place, "runs", found[1], replicate)
    stored = None if row is None else {k: v for k, v in row.items() if k not in OWN_COLUMNS.union(plan.types)}
    failed = None if stored is not None else _row(place, "failed", found[1], replicate)
    error = None if failed is None else str(failed["error"])
    # Runs that an earlier version of the study wanted are there.
    if replicate >= most and stored is None and failed is None:
        raise ValueError(f"run={checks.shown(run)}: replicates are numbered from 0 to {most - 1}; give one of them")
    now, then = common_of(study, plan.types), place.manifest
    changed = ["teamsight"] if now.code != then.code else []
    changed += sorted(name for name, old in then.sources.items() if now.sources.get(name, old) != old)
    return PlannedRun(
        study, plan, run, setting, plan.seed(setting, replicate), plan.parameters(setting), stored, error,
        tuple(changed),
    )  # fmt: skip


def _row(folder: StudyFolder, kind: str, setting: str, replicate: int) -> Mapping[str, object] | None:
    """Return the stored row of a run, if there is one."""
    import pyarrow.compute as pc

    table = folder.read(kind)
    if not table.num_rows:
        return None
    rows = table.filter((pc.field("setting") == setting) & (pc.field("replicate") == replicate)).to_pylist()
    return rows[0] if rows else None


def _is_same(one: object, other: object) -> bool:
    """Whether two values are the same to the last bit; any NaN is the same as any other."""
    if isinstance(one, float) and isinstance(other, float):
        return struct.pack("d", one) == struct.pack("d", other) or (one != one and other != other)
    return one == other
