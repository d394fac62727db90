"""Candidates are simulated, judged by the paper's claims, scored and ranked.

All root seeds are below 0, which no command accepts, so that the ledger never judges constants on the worlds with which
they were chosen. Results are reported on further worlds, because the best of many candidates is partly the luckiest.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import pandas as pd

from teamsight.analysis.paper.claims import Claim, Tables, Verdict, judge, needed
from teamsight.analysis.paper.experiments import make_chosen
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.experiment import Grid, Request
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Watch

T = TypeVar("T")

# Limit of a claim's distance in the score, so that one claim cannot outweigh all others.
_FARTHEST = 5.0
# Candidates whose runs are made together. Runs that several candidates share are made once.
_BATCH = 36


class Phase(NamedTuple):
    """One pass over candidates.

    Attributes
    ----------
    name : str
        Value of the column `phase`.
    grid : Grid
        Team sizes and radii.
    roots : tuple of int
        Root seeds; each candidate is judged on each of them.
    claims : mapping of str to Claim
        The claims that are judged.
    runs, steps : int
        Runs of each cell, and steps of each run.
    """

    name: str
    grid: Grid
    roots: tuple[int, ...]
    claims: Mapping[str, Claim]
    runs: int
    steps: int = 600


class Candidate(NamedTuple):
    """Constants to be judged.

    Attributes
    ----------
    columns : mapping
        Columns of the table that describe the candidate.
    request : Request
        The experiments that the claims read.
    """

    columns: Mapping[str, Any]
    request: Request


class Simulator(NamedTuple):
    """How runs are made. The rows of a search do not depend on it.

    Attributes
    ----------
    pool : WorkerPool or None
        Processes that do the work; None: this process.
    watch : callable
        Called with a phase, the candidates done in it and all its candidates.
    checkpoint : Checkpoint or None
        File of finished runs, which are not made again.
    """

    pool: WorkerPool | None = None
    watch: Watch = lambda phase, done, total: None
    checkpoint: Checkpoint | None = None


#: Makes all runs in this process.
HERE = Simulator()


def score(verdicts: Mapping[str, Verdict]) -> tuple[int, float]:
    """Return the number of claims that hold, and their mean distance from the paper's figures, in tolerances."""
    holding = sum(verdict.holds is True for verdict in verdicts.values())
    return holding, sum(min(verdict.distance, _FARTHEST) for verdict in verdicts.values()) / len(verdicts)


def assess(
    phase: Phase,
    candidates: Sequence[T],
    prepare: Callable[[T, Phase], Candidate],
    simulator: Simulator = HERE,
    *,
    measure: Callable[[Tables], Mapping[str, float]] = lambda tables: {},
) -> list[dict[str, Any]]:
    """Return one row for each candidate and root seed.

    Parameters
    ----------
    phase : Phase
        Worlds and claims.
    candidates : sequence
        What is tried.
    prepare : callable
        Takes one of them and the phase, and returns the candidate; called when its batch begins.
    simulator : Simulator
        How the runs are made.
    measure : callable
        Takes the tables of a candidate and returns further columns.

    Returns
    -------
    list of dict
        Columns phase, those of the candidate, root, those of `measure`, holding, distance_from_paper, and one for
        each claim: whether it holds.
    """
    rows = []
    for first in range(0, len(candidates), _BATCH):
        batch = [prepare(one, phase) for one in candidates[first : first + _BATCH]]

        def show(share: float, first: int = first, size: int = len(batch)) -> None:
            simulator.watch(phase.name, first + size * share, len(candidates))

        made = _tables(phase, [candidate.request for candidate in batch], simulator, show)
        for number, candidate in enumerate(batch):
            rows += [_row(phase, candidate, root, of[number], measure(of[number])) for root, of in made.items()]
    return rows


def ranking(table: pd.DataFrame, by: Sequence[str], claims: Sequence[str] = ()) -> pd.DataFrame:
    """Return one row for each candidate, best first: most claims hold, then the least distance from the paper.

    Parameters
    ----------
    table : DataFrame
        Rows of `assess`.
    by : sequence of str
        Columns that identify a candidate.
    claims : sequence of str
        Claims whose share of root seeds is returned too.

    Returns
    -------
    DataFrame
        Columns `by`, means over the root seeds of holding, distance_from_paper and `claims`, and the smallest and
        largest holding in fewest and most.
    """
    scores = table[[*by, "holding", "distance_from_paper", *claims]].astype(dict.fromkeys(claims, float))
    grouped = scores.groupby(list(by), sort=False)
    extremes = grouped.agg(fewest=("holding", "min"), most=("holding", "max"))
    means = grouped.mean().join(extremes).reset_index()
    return means.sort_values(
        ["holding", "distance_from_paper"], ascending=[False, True], kind="stable", ignore_index=True
    )


def _tables(
    phase: Phase, requests: Sequence[Request], simulator: Simulator, show: Callable[[float], None]
) -> dict[int, list[dict[str, pd.DataFrame]]]:
    """Return the tables of each request by root seed; `show` is called with the share that is done."""
    made = {}
    for number, root in enumerate(phase.roots):

        def progress(done: float, total: float, before: int = number) -> None:
            show((before + done / max(total, 1.0)) / len(phase.roots))

        made[root] = make_chosen(
            requests, needed(phase.claims, beside=False), simulator.pool, root=root, runs=phase.runs,
            steps=phase.steps, progress=progress, checkpoint=simulator.checkpoint,
        )  # fmt: skip
    return made


def _row(
    phase: Phase, candidate: Candidate, root: int, tables: Tables, measured: Mapping[str, float]
) -> dict[str, Any]:
    verdicts = judge(tables, phase.claims)
    holding, distance = score(verdicts)
    return {
        "phase": phase.name, **candidate.columns, "root": root, **measured,
        "holding": holding, "distance_from_paper": distance,
        **{name: verdict.holds for name, verdict in verdicts.items()},
    }  # fmt: skip
