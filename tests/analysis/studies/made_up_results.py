"""Results of studies whose runs are made up, without simulating."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from teamsight.analysis.studies.folder.parts import RunSet, joined
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.plan import Plan
from teamsight.analysis.studies.results import StudyResults, open_study, run_ids
from teamsight.analysis.studies.study import Study

# Runs of a shard.
_SHARD = 5

Value = Callable[[Mapping[str, Any], np.random.Generator], float]


class Folder:
    """Stands for the folder of a study."""

    def __init__(self, name: str, tables: Mapping[str, pa.Table]) -> None:
        self.path = Path(name)
        self.tables = tables

    def read(self, kind: str) -> pa.Table:
        return self.tables.get(kind, pa.table({}))

    def lost(self) -> RunSet:
        return joined([])


def noisy(parameters: Mapping[str, Any], rng: np.random.Generator) -> float:
    """Return a value between 0 and 1 that grows with each number."""
    numbers = [float(one) for one in parameters.values() if isinstance(one, int | float)]
    return float(np.clip(0.3 + 0.02 * sum(numbers) + rng.normal(0, 0.05), 0, 1))


def results(
    study: Study,
    value: Value = noisy,
    *,
    share: float = 1.0,
    failing: float = 0.0,
    name: str = "made-up",
    seed: int = 1,
) -> StudyResults:
    """Return results without a folder; see `tables_of`."""
    tables = tables_of(study, value, share, failing, seed)
    return StudyResults(cast(StudyFolder, Folder(name, tables)), study, tables["runs"], tables["failed"])


def filled(
    path: Path, study: Study, value: Value = noisy, *, share: float = 1.0, failing: float = 0.0, seed: int = 1
) -> StudyResults:
    """Write the runs to a folder in shards of five, and return what `open_study` reads there."""
    folder = StudyFolder(path)
    folder.prepare(study, study.plan(), code="0" * 16, sources={})
    tables = tables_of(study, value, share, failing, seed)
    ids = {kind: run_ids(table).tolist() for kind, table in tables.items()}
    for start in range(0, max(map(len, ids.values())), _SHARD):
        part = {kind: table.slice(start, _SHARD) for kind, table in tables.items() if start < len(ids[kind])}
        names = [name for kind in part for name in ids[kind][start : start + _SHARD]]
        folder.write({kind: content_of(table) for kind, table in part.items()}, names)
    return open_study(path)


def content_of(table: pa.Table) -> bytes:
    """Return a table as a Parquet file."""
    buffer = io.BytesIO()
    pq.write_table(table, buffer)
    return buffer.getvalue()


def tables_of(study: Study, value: Value, share: float, failing: float, seed: int) -> dict[str, pa.Table]:
    """Return rows of runs that are done and of runs that failed, in any order.

    Parameters
    ----------
    study : Study
        The study.
    value : callable
        The measure of a run from its parameters and random numbers of the run's own.
    share, failing : float
        The share of runs that are made, and of these the share that fails.
    seed : int
        Decides which runs are made, and which of them fail.
    """
    plan = study.plan()
    rng = np.random.default_rng(seed)
    done: list[dict[str, Any]] = []
    failed: list[dict[str, Any]] = []
    runs = rng.permutation([(k, r) for k in range(plan.settings) for r in range(study.replicates)]).tolist()
    made = math.ceil(share * len(runs))
    for number, (k, replicate) in enumerate(runs[:made]):
        row = row_of(plan, k, replicate)
        noise = np.random.default_rng(row["seed"])
        if number < failing * made:
            name = f"{row['setting']}-{replicate}"
            failed.append({"run": name, **row, "error": "ValueError: made up", "traceback": "made up"})
        else:
            measured = {"observed_fraction": value(plan.parameters(k), noise), "max_neighbours": int(noise.integers(9))}
            done.append(row | measured)
    return {"runs": table_of(done), "failed": table_of(failed)}


def row_of(plan: Plan, k: int, replicate: int) -> dict[str, Any]:
    """Return what the row of a run begins with."""
    study = cast(Study, plan.study)
    parameters = {name: str(one) if isinstance(one, dict) else one for name, one in plan.parameters(k).items()}
    about = {"replicate": replicate, "seed": plan.seed(k, replicate), "steps": study.steps}
    return {"setting": f"{int(plan.ids[k]):016x}", **parameters, **about}


def table_of(rows: list[dict[str, Any]]) -> pa.Table:
    """Return rows as a table, without columns if there are none."""
    return pa.Table.from_pylist(rows) if rows else pa.table({})
