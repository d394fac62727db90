"""Planned runs: each with the columns that identify it, and the table of what was measured."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.simulate import Progress, run_all

#: The columns that identify a run, and the run.
Planned = tuple[Mapping[str, Any], Run]


def run_rows(
    planned: Iterable[Planned],
    pool: Executor | None = None,
    *,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> pd.DataFrame:
    """Make planned runs and return a table with one row for each, in their order.

    Parameters
    ----------
    planned : iterable of (mapping, Run)
        The columns that identify each run, and the run, whose measure returns a mapping or a NamedTuple.
    pool, progress, checkpoint
        See `run_all`.

    Returns
    -------
    DataFrame
        The columns that identify the runs, then those that were measured.

    Raises
    ------
    ValueError
        If a run measures a column that identifies it.
    JobError
        If a run fails; the message contains its settings.
    """
    listed = list(planned)
    measured = run_all([run for _, run in listed], pool, progress=progress, checkpoint=checkpoint)
    return pd.DataFrame([_row(columns, one) for (columns, _), one in zip(listed, measured, strict=True)])


def _row(columns: Mapping[str, Any], measured: Any) -> dict[str, Any]:
    found = measured if isinstance(measured, Mapping) else measured._asdict()
    for name in found:
        if name in columns:
            raise ValueError(f"measure returned {name!r}: the plan has this column; take another name")
    return {**columns, **found}
