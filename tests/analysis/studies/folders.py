"""What tests of sweeps share: small studies, the rows of a folder, and an executor that misbehaves on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

import pandas as pd

from teamsight.analysis.runs.executor import Outcome, attempt
from teamsight.analysis.studies.folder.study_folder import StudyFolder
from teamsight.analysis.studies.shard import Shard
from teamsight.analysis.studies.study import Record, Study

HERE = Path(__file__).parent
GRID: dict[str, Any] = {"robots": [2, 5], "radius": [2.0, 3.5]}
FIXED: dict[str, Any] = {"targets": 3, "policy": "a-cmommt"}


def small(**given: Any) -> Study:
    """Return a study of 4 settings and 3 replicates."""
    return Study(**{"fixed": FIXED, "axes": GRID, "replicates": 3, "steps": 5, **given})


def odd(model: str, measure: str = "summary", **given: Any) -> Study:
    """Return a study of a model and a measure of `odd_models`."""
    return Study(
        **{
            "model": model if model == "cmommt" else f"odd_models:{model}", "steps": 5, "path": HERE,
            "record": Record(measure if measure == "summary" else f"odd_models:{measure}"), **given,
        }
    )  # fmt: skip


def rows(folder: Path, kind: str = "runs") -> pd.DataFrame:
    """Return the rows of a kind, in one order."""
    table = StudyFolder(folder).read(kind).to_pandas()
    if not len(table):
        return table
    keys = [name for name in ("setting", "replicate", "step", "time") if name in table]
    return table.sort_values(keys, ignore_index=True, kind="stable")


def same_rows(folder: Path, other: Path, kind: str = "runs") -> None:
    """Check that two folders have the same rows, to the last bit."""
    found, expected = rows(folder, kind), rows(other, kind)
    assert len(expected)
    pd.testing.assert_frame_equal(found[[*expected]], expected, check_exact=True)


def parts(folder: Path) -> dict[str, bytes]:
    """Return the files of all parts."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*.parquet"))}


class Engine:
    """An executor in this process, in which jobs can die or fail.

    Parameters
    ----------
    dies : callable
        Whether the worker of a shard dies.
    code : str
        The version of teamsight's code that jobs want; that of the sweep if it is empty.
    size : int
        The number of workers that it claims to have.
    """

    def __init__(self, dies: Callable[[Shard], bool] = lambda shard: False, code: str = "", size: int = 1) -> None:
        self.dies, self.code, self.size = dies, code, size
        self.jobs: list[Shard] = []

    def __enter__(self) -> Engine:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def outcomes(self, function: Callable[[Any], Any], jobs: Iterable[Any]) -> Iterator[Outcome]:
        """Yield the outcome of each job; the last one of each four first, as jobs end in any order."""
        held: list[tuple[int, Shard]] = []
        for index, job in enumerate(jobs):
            self.jobs.append(job)
            held.append((index, job))
            if len(held) == 4:
                yield from self._ended(function, held)
        yield from self._ended(function, held)

    def _ended(self, function: Callable[[Any], Any], held: list[tuple[int, Shard]]) -> Iterator[Outcome]:
        while held:
            index, job = held.pop()
            if self.code:
                job = job._replace(common=job.common._replace(code=self.code))
            if self.dies(job):
                yield Outcome(index, "died", 7)
            else:
                yield Outcome(index, *attempt(function, job))
