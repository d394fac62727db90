"""Whether parts belong to a study: their settings, steps and seeds are those that it plans."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from teamsight.analysis.studies.definition.model import TASK_PREFIX
from teamsight.analysis.studies.definition.values import hex_of, run_id
from teamsight.analysis.studies.folder import parts
from teamsight.analysis.studies.folder.layout import DONE
from teamsight.analysis.studies.folder.parts import DamagedError, Part
from teamsight.analysis.studies.folder.run_set import IDENTITY, runs_in
from teamsight.core import files, references

if TYPE_CHECKING:
    import pyarrow as pa

    from teamsight.analysis.studies.plan import Plan

#: The columns by which a part is recognised.
RECOGNISED = (*IDENTITY, "seed", "steps")
# Studies of another root or pairing differ in every seed, so a few of each part are computed.
_MOST_SEEDS = 16


class HasSteps(Protocol):
    """What is read of a `Study`."""

    @property
    def steps(self) -> int:
        """Steps of each run."""


def stranger(table: pa.Table, study: HasSteps, plan: Plan) -> str | None:
    """Return why rows are not of a study; None if they are.

    Parameters
    ----------
    table : Table
        Rows with the columns `RECOGNISED`, of which only the identity must be there.
    study, plan : Study, Plan
        The study.
    """
    runs = runs_in(table)
    index = plan.index_of(runs.ids)
    if (index < 0).any():
        return f"belongs to another study (setting {hex_of(runs.ids[index < 0][0])} is not planned)"
    columns: Mapping[str, np.ndarray] = {
        name: table[name].to_numpy() for name in ("seed", "steps") if name in table.column_names
    }
    if "steps" in columns and (columns["steps"] != study.steps).any():
        wrong = int(columns["steps"][columns["steps"] != study.steps][0])
        return f"belongs to another study (runs of {wrong} steps, not {study.steps})"
    # The seeds of a task follow from its scenario, and no module that a study names is imported here.
    task = plan.study.model.partition(TASK_PREFIX)[2]
    if "seed" in columns and not references.is_reference(task):
        chosen = slice(None, None, -(-runs.size // _MOST_SEEDS) or 1)
        seen = (index[chosen].tolist(), runs.replicates[chosen].tolist(), columns["seed"][chosen].tolist())
        for setting, replicate, seed in zip(*seen, strict=True):
            if plan.seed(setting, replicate) != seed:
                return f"belongs to another study (seed {seed} of run {_name(plan, setting, replicate)} is not planned)"
    return None


def why_strange(part: Part, content: bytes, study: HasSteps, plan: Plan) -> str | None:
    """Return why a part is not of a study; None if it is.

    Raises
    ------
    DamagedError
        If it cannot be read.
    """
    table = parts.rows(part, content, RECOGNISED if part.kind in DONE else IDENTITY)
    try:
        return stranger(table, study, plan)
    except ValueError as error:
        raise DamagedError(part, str(error)) from None


def check_belongs(folder: Path, study: HasSteps, plan: Plan) -> None:
    """Raise an error if a folder without a manifest has parts that are not of a study. Damaged parts do not count.

    Raises
    ------
    UnwritableError
        If there are such parts.
    """
    for kind in DONE:
        for part in parts.listed(folder, kind):
            try:
                why = why_strange(part, parts.load(part), study, plan)
            except DamagedError:
                continue
            if why:
                raise files.UnwritableError(f"{part.path}: {why}; move it away, or give another folder")


def _name(plan: Plan, setting: int, replicate: int) -> str:
    return run_id(plan.ids[setting], replicate)
