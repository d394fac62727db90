"""Studies and parts whose numbers are made up: no world is built."""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from teamsight.analysis.studies.folder import parts as part_files
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.plan import Plan
from teamsight.analysis.studies.study import Study

CODE = "0123456789abcdef"


def study(replicates: int = 4, steps: int = 9, robots: Iterable[int] = (2, 3, 4), **further: object) -> Study:
    return Study(fixed={"targets": 3}, axes={"robots": list(robots)}, replicates=replicates, steps=steps, **further)  # type: ignore[arg-type]


def prepared(path: Path, one: Study | None = None) -> StudyFolder:
    one = one or study()
    folder = StudyFolder(path)
    folder.prepare(one, one.plan(), code=CODE, sources={})
    return folder


def runs_of(plan: Plan) -> list[tuple[int, int]]:
    return [(setting, replicate) for setting in range(plan.settings) for replicate in range(plan.study.replicates)]


def names(plan: Plan, runs: Iterable[tuple[int, int]]) -> list[str]:
    return [f"{int(plan.ids[setting]):016x}-{replicate}" for setting, replicate in runs]


def table(plan: Plan, runs: Iterable[tuple[int, int]], rows: int = 1) -> pa.Table:
    """Return rows whose numbers depend on the run alone."""
    each = [(setting, replicate, row) for setting, replicate in runs for row in range(rows)]
    columns = {
        "setting": [f"{int(plan.ids[setting]):016x}" for setting, _, _ in each],
        "targets": [3 for _ in each],
        "robots": [int(plan.parameters(setting)["robots"]) for setting, _, _ in each],  # type: ignore[call-overload]
        "replicate": [replicate for _, replicate, _ in each],
        "seed": [plan.seed(setting, replicate) for setting, replicate, _ in each],
        "steps": [plan.study.steps for _ in each],
        "observed_fraction": [setting + replicate / 100 for setting, replicate, _ in each],
    }
    if rows > 1:
        columns["step"] = [row for _, _, row in each]
    return pa.table(columns)


def content(rows: pa.Table) -> bytes:
    stream = io.BytesIO()
    pq.write_table(rows, stream)
    return stream.getvalue()


def part(plan: Plan, runs: Iterable[tuple[int, int]], rows: int = 1) -> bytes:
    return content(table(plan, runs, rows))


def failed_part(plan: Plan, runs: Iterable[tuple[int, int]]) -> bytes:
    runs = list(runs)
    made = table(plan, runs).drop_columns(["observed_fraction"])
    return content(
        made.append_column("run", [names(plan, runs)])
        .append_column("error", [["no more batteries"] * len(runs)])
        .append_column("traceback", [["…"] * len(runs)])
    )


def shards(plan: Plan, size: int = 3) -> Iterator[list[tuple[int, int]]]:
    runs = runs_of(plan)
    for first in range(0, len(runs), size):
        yield runs[first : first + size]


def fill(folder: StudyFolder, plan: Plan, size: int = 3, *, steps: bool = False) -> None:
    """Write all parts of a study."""
    for runs in shards(plan, size):
        parts = {"runs": part(plan, runs)}
        if steps:
            parts = with_steps(plan, runs, part(plan, runs, 5))
        folder.write(parts, names(plan, runs))


def with_steps(plan: Plan, runs: Iterable[tuple[int, int]], steps: bytes) -> dict[str, bytes]:
    """Return a part of runs that names the part of steps beside it, and that part."""
    beside = {part_files.BESIDE: json.dumps({"steps": part_files.digest(steps)})}
    return {"steps": steps, "runs": content(table(plan, runs).replace_schema_metadata(beside))}
