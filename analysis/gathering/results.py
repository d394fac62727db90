"""The gathering index from runs to files: three tables, a picture and a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from teamsight.analysis.gathering.cells import Cell, cell, delta_of, frame
from teamsight.analysis.gathering.claims import Verdict, judge
from teamsight.analysis.gathering.figure import draw
from teamsight.analysis.gathering.iterate import Iteration, iterate
from teamsight.analysis.gathering.page import page
from teamsight.analysis.gathering.plan import Plan, deltas
from teamsight.analysis.gathering.simulate import Team, both_teams, simulate
from teamsight.analysis.runs import files
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch
from teamsight.tasks.task import Task

#: The files that are written.
RUNS, INDEX, ROUNDS = "gathering.parquet", "gathering-index.parquet", "gathering-rounds.parquet"
PAGE, PICTURE = "gathering.md", "gathering"


class Gathering(NamedTuple):
    """What was found.

    Attributes
    ----------
    runs : DataFrame
        One row for each run; see `simulate`.
    cells : list of Cell
        One for each task and team size.
    verdicts : list of Verdict
        On G1 to G4.
    iterations : dict of (str, int) to Iteration
        The rounds of `iterate_delta` for each task and team size.
    """

    runs: pd.DataFrame
    cells: list[Cell]
    verdicts: list[Verdict]
    iterations: Mapping[tuple[str, int], Iteration]

    @property
    def frame(self) -> pd.DataFrame:
        """The cells as a table."""
        return frame(self.cells)

    @property
    def rounds(self) -> pd.DataFrame:
        """The rounds of all iterations as a table."""
        tables = [one.rounds.assign(task=task, size=size) for (task, size), one in self.iterations.items()]
        return pd.concat(tables, ignore_index=True)


def gather(
    plan: Plan,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    checkpoint: Checkpoint | None = None,
    runs: pd.DataFrame | None = None,
) -> Gathering:
    """Simulate, and judge the claims.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    pool : WorkerPool, optional
        Processes that do the work. The result does not depend on it.
    watch : callable
        Called with the phase, the work done in it and its work in all.
    checkpoint : Checkpoint, optional
        File of finished runs.
    runs : DataFrame, optional
        Runs of this plan that were made before, as in `Gathering.runs`: they are not made again.
    """
    made = _Runs(plan, pool, checkpoint, runs)
    teams = made.of(both_teams(plan), watch, "both teams")
    curves = [
        Team(task, size, "skilled", delta)
        for task in plan.all_tasks
        for size in plan.sizes
        for delta in deltas(plan, size, _proposed(plan, teams, task, size))
    ]
    made.of(curves, watch, "against δ")
    iterations = {
        (task.name, size): iterate(plan, task, size, lambda team: made.of([team], watch, "measured again"))
        for task in plan.all_tasks
        for size in plan.sizes
    }
    cells = [cell(plan, made.table, task, size) for task in plan.all_tasks for size in plan.sizes]
    return Gathering(made.table, cells, judge(cells), iterations)


def _proposed(plan: Plan, teams: pd.DataFrame, task: Task, size: int) -> list[int]:
    """Return the δ of both teams, and that which the runs of the exploration support."""
    explore, skilled = (delta_of(plan, teams, task, size, one) for one in ("explore", "skilled"))
    return [explore.delta, explore.high, skilled.delta]


class _Runs:
    """The runs of a plan, each made once."""

    def __init__(
        self, plan: Plan, pool: WorkerPool | None, checkpoint: Checkpoint | None, runs: pd.DataFrame | None
    ) -> None:
        self._plan, self._pool, self._checkpoint = plan, pool, checkpoint
        self.table = pd.DataFrame() if runs is None else runs

    def of(self, teams: Sequence[Team], watch: Watch, phase: str) -> pd.DataFrame:
        """Return the runs of teams; make those that are missing."""
        missing = [team for team in teams if self._has(team).empty]
        if missing:
            more = simulate(
                self._plan, missing, self._pool, progress=lambda *done: watch(phase, *done), checkpoint=self._checkpoint
            )
            self.table = pd.concat([self.table, more], ignore_index=True)
        return pd.concat([self._has(team) for team in teams], ignore_index=True)

    def _has(self, team: Team) -> pd.DataFrame:
        if self.table.empty:
            return self.table
        columns = {"task": team.task.name, "size": team.size, "treatment": team.treatment, "delta": team.delta}
        return self.table[(self.table[list(columns)] == pd.Series(columns)).all(axis=1)]


def check_results(plan: Plan, folder: Path, formats: Sequence[str] = ("png",), *, force: bool = False) -> None:
    """Raise an error if a file in the folder must not be replaced by a result or by the checkpoint.

    Parameters
    ----------
    plan : Plan
        What to simulate.
    folder : Path
        Where to write.
    formats : sequence of str
        Formats of the picture.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If there is such a file.
    """
    names = [RUNS, INDEX, ROUNDS, PAGE, *(f"{PICTURE}.{kind}" for kind in formats)]
    about = {"gathering": plan.conditions()}
    files.check_results(folder, names, about, checkpoint=checkpoint_in(folder), force=force)


def make_results(
    plan: Plan,
    folder: Path,
    pool: WorkerPool | None = None,
    watch: Watch = lambda phase, done, total: None,
    formats: Sequence[str] = ("png",),
    *,
    force: bool = False,
) -> Gathering:
    """Simulate, draw and write all results to a folder. After an interruption, the same call resumes.

    Parameters
    ----------
    plan, pool, watch
        See `gather`.
    folder : Path
        An existing folder.
    formats : sequence of str
        Formats of the picture.
    force : bool
        Replace any regular file by a result.

    Raises
    ------
    ValueError
        If a file must not be replaced; see `check_results`.
    """
    check_results(plan, folder, formats, force=force)
    checkpoint = checkpoint_in(folder)
    found = gather(plan, pool, watch, checkpoint)
    pictures = {f"{PICTURE}.{kind}": draw(found.cells, plan, kind) for kind in formats}
    tables = {RUNS: found.runs, INDEX: found.frame, ROUNDS: found.rounds}
    text = page(found.cells, found.verdicts, found.iterations, plan)
    written: dict[str, files.Content] = {**tables, **pictures, PAGE: text}
    files.write_results(folder, written, {"gathering": plan.conditions()}, force=force)
    checkpoint.forget()
    return found


def checkpoint_in(folder: Path) -> Checkpoint:
    """Return the runs that an interrupted command left in a folder of results."""
    return Checkpoint(folder / "gathering.checkpoint")
