"""Simulate many worlds on a pool of workers and gather what they observed in tidy tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any, NamedTuple

import pandas as pd

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.experiment import Experiment, Run
from teamsight.analysis.runs.workers import JobError, WorkerPool, tell

#: What a worker imports before its first run.
IMPORTS = ("teamsight.agents.cmommt",)
# Steps of a middling world in a chunk: about a quarter of a second, so that progress moves and messages cost nothing.
_CHUNK = 200_000.0


class Outcome(NamedTuple):
    """What a run leaves behind."""

    observed_fraction: float
    max_neighbours: int


class Request(NamedTuple):
    """Experiments to be made under one setting."""

    setting: Mapping[str, Any]
    experiments: Sequence[Experiment]


def simulate(run: Run) -> Outcome:
    """Make one run in this process."""
    from teamsight.agents.cmommt import CMOMMT

    model = CMOMMT(**run.parameters, rng=run.seed)
    try:
        model.run(run.steps)
        return Outcome(float(model.observed_fraction), int(model.max_neighbours))
    finally:
        model.close()


def compile_kinds(runs: Sequence[Run]) -> None:
    """Make a step of one run of each kind, so that all that has to be compiled is, once and by one process alone."""
    from teamsight.core.kernel import entry as kernel_entry

    told: list[str] = []

    def announce(name: str) -> None:
        if not told:
            tell("compiling the simulation: this happens once per machine and takes under a minute")
        told.append(name)

    before, kernel_entry.announce = kernel_entry.announce, announce
    try:
        for run in runs:
            _simulate_or_tell(run)
    finally:
        kernel_entry.announce = before


def make_tables(
    pool: WorkerPool,
    requests: Sequence[Request],
    *,
    root: int,
    runs: int,
    steps: int,
    progress: Callable[[float, float], None] = lambda done, total: None,
    unfinished: Checkpoint | None = None,
) -> list[dict[str, pd.DataFrame]]:
    """Return for each request its tables by name of the experiment; a run that several need is made once.

    Parameters
    ----------
    pool : WorkerPool
        Who does the work; the tables do not depend on it.
    requests : sequence of Request
        What is asked for.
    root : int
        Seed of the whole study.
    runs, steps : int
        Replicates of each cell, and steps of each run.
    progress : callable
        Called with the work done and the work in all, in arbitrary units, whenever some is done.
    unfinished : Checkpoint, optional
        Where outcomes are kept meanwhile; runs that are there are not made again.

    Returns
    -------
    list of dict of str to DataFrame
        One row a run, columns robots, targets, radius, whatever is swept, replicate, seed, observed_fraction,
        max_neighbours; rows in the order of the experiment's cells.

    Raises
    ------
    JobError
        If a run fails; the message tells its settings.
    """
    planned = [
        (experiment.name, number, columns, run)
        for number, request in enumerate(requests)
        for experiment in request.experiments
        for columns, run in experiment.rows(request.setting, root, runs, steps)
    ]
    outcomes = run_all(pool, [run for *_, run in planned], progress, unfinished)
    rows: list[dict[str, list[dict[str, Any]]]] = [{} for _ in requests]
    for name, number, columns, run in planned:
        rows[number].setdefault(name, []).append(columns | outcomes[run.key]._asdict())
    return [{name: pd.DataFrame(table) for name, table in tables.items()} for tables in rows]


def run_all(
    pool: WorkerPool,
    runs: Iterable[Run],
    progress: Callable[[float, float], None] = lambda done, total: None,
    unfinished: Checkpoint | None = None,
) -> dict[tuple[str, ...], Outcome]:
    """Make each distinct run once and return its outcome under its key; see `make_tables`."""
    distinct = {run.key: run for run in runs}
    outcomes = {key: Outcome(*found) for key, found in unfinished.outcomes(distinct).items()} if unfinished else {}
    missing = [run for key, run in distinct.items() if key not in outcomes]
    total = sum(run.cost for run in distinct.values())
    done = total - sum(run.cost for run in missing)
    progress(done, total)
    pool.map(compile_kinds, [_one_of_each_kind(missing)], describe=lambda runs: "compiling the simulation")
    chunks = _chunks(missing)

    def keep(index: int, found: list[Outcome]) -> None:
        made = {run.key: outcome for run, outcome in zip(chunks[index], found, strict=True)}
        if unfinished:
            unfinished.add(made)
        outcomes.update(made)

    def count(index: int) -> None:
        nonlocal done
        done += sum(run.cost for run in chunks[index])
        progress(done, total)

    def describe(chunk: Sequence[Run]) -> str:
        return f"the {len(chunk)} runs from {chunk[0].describe()}"

    pool.map(_simulate_chunk, chunks, count, describe, keep)
    return outcomes


def _chunks(runs: Sequence[Run]) -> list[list[Run]]:
    chunks: list[list[Run]] = []
    room = 0.0
    for run in runs:
        if room <= 0:
            chunks.append([])
            room = _CHUNK
        chunks[-1].append(run)
        room -= run.cost
    return chunks


def _one_of_each_kind(runs: Sequence[Run]) -> list[Run]:
    """Return a short run for each combination of components; numbers do not change what is compiled."""
    kinds: dict[tuple[str, ...], Run] = {}
    for run in runs:
        kind = tuple(
            f"{k}={v!r}" for k, v in sorted(run.parameters.items()) if isinstance(v, bool) or not isinstance(v, Real)
        )
        kinds.setdefault(kind, replace(run, steps=1))
    return list(kinds.values())


def _simulate_chunk(chunk: Sequence[Run]) -> list[Outcome]:
    return [_simulate_or_tell(run) for run in chunk]


def _simulate_or_tell(run: Run) -> Outcome:
    try:
        return simulate(run)
    except Exception as error:
        raise JobError(f"{error} (in the run {run.describe()})") from error
