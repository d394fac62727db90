"""The bookkeeping of a study of many runs, one part of it in this process; prints its time and memory.

python benchmarks/study_books.py write|plan|status|resume RUNS FOLDER
"""

from __future__ import annotations

import io
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from teamsight.analysis.studies.study import Study

# Replicates of a setting, and runs of a part: about a second's work at the paper's size on an older machine.
REPLICATES, PART = 10, 400


class Nothing:
    """A model in which nothing happens; it is what the last part, which `resume` makes, costs least with."""

    def __init__(self, a: int, b: float, rng: int) -> None:
        self.a, self.b, self.rng = a, b, rng


def measure(world: Nothing, steps: int) -> dict[str, float]:
    """Return one column."""
    return {"value": 0.5}


def study_of(runs: int) -> Study:
    """Return a study of so many runs."""
    return Study(
        model="study_books:Nothing",
        axes={"a": list(range(runs // REPLICATES // 20)), "b": [number / 8 for number in range(20)]},
        replicates=REPLICATES, steps=1, record={"measure": "study_books:measure"},
        path=Path(__file__).resolve().parent,
    )  # fmt: skip


def write(study: Study, folder: Path) -> dict[str, Any]:
    """Write all parts but the last, as a sweep does."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    from teamsight.analysis.studies.folder.study_folder import StudyFolder
    from teamsight.analysis.studies.sweep import common_of

    plan, place = study.plan(), StudyFolder(folder)
    common = common_of(study, plan.types)
    place.prepare(study, plan, code=common.code, sources=common.sources)
    names = [f"{one:016x}" for one in plan.ids.tolist()]
    values = [plan.parameters(number) for number in range(plan.settings)]
    parts = 0
    for first in range(0, plan.runs - PART, PART):
        setting, replicate = np.divmod(np.arange(first, first + PART), study.replicates)
        chosen = setting.tolist()
        table = pa.table(
            {
                "setting": pa.array([names[one] for one in chosen]),
                "a": pa.array([values[one]["a"] for one in chosen], pa.int64()),
                "b": pa.array([values[one]["b"] for one in chosen], pa.float64()),
                "replicate": replicate, "seed": np.arange(first, first + PART), "steps": np.ones(PART, np.int64),
                "value": np.full(PART, 0.5),
            }
        )  # fmt: skip
        target = io.BytesIO()
        pq.write_table(table, target, compression="zstd")
        runs = [f"{names[one]}-{number}" for one, number in zip(chosen, replicate.tolist(), strict=True)]
        place.write({"runs": target.getvalue()}, runs)
        parts += 1
    return {"parts": parts}


def plan(study: Study, folder: Path) -> dict[str, Any]:
    """Plan all runs."""
    found = study.plan()
    assert len(np.unique(found.ids)) == len(found.order) == found.settings
    return {"runs": found.runs}


def status(study: Study, folder: Path) -> dict[str, Any]:
    """Count what is done."""
    from teamsight.analysis.studies.folder.status import status as status_of

    return {"missing": status_of(folder).missing}


def resume(study: Study, folder: Path) -> dict[str, Any]:
    """Make what is missing."""
    from teamsight.analysis.studies.sweep import sweep

    return {"made": sweep(study, folder).made}


def main() -> None:
    """Do one part, and print what it took."""
    kind, runs, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]) / "study"
    parts: dict[str, Callable[[Study, Path], dict[str, Any]]]
    parts = {"write": write, "plan": plan, "status": status, "resume": resume}
    begin = time.perf_counter()
    facts = parts[kind](study_of(runs), folder)
    seconds = time.perf_counter() - begin
    assert facts.get("made", PART) == facts.get("missing", PART) == PART, facts
    # Not ru_maxrss, which begins with the memory of the process that started this one.
    lines = Path("/proc/self/status").read_text().splitlines()
    peak = next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024
    print(json.dumps({"kind": kind, "seconds": seconds, "mebibytes": peak, **facts}))


if __name__ == "__main__":
    main()
