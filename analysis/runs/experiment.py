"""Experiments: a treatment over team sizes and arena radii, and the tables that its runs give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

import pandas as pd

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import Progress, run_all


class Variant(NamedTuple):
    """The treatment of one replicate of every cell, and the columns of the table that describe it."""

    treatment: Mapping[str, Any]
    columns: Mapping[str, Any]


@dataclass(frozen=True)
class Experiment:
    """A treatment over cells (robots, radius); each replicate of a cell is one run.

    Parameters
    ----------
    name : str
        Name of the resulting table.
    treatment : mapping or callable
        Keyword parameters of CMOMMT; or a function that takes the number of a replicate and returns its `Variant`.
    cells : tuple of (int, float)
        Team size and arena radius of each cell.
    targets : int
        Number of targets.
    sweep : mapping of str to tuple
        Further keyword parameters with their values. All combinations are run; each parameter becomes a column.
    replicates : int
        Factor on the number of replicates.
    fresh : bool
        Begin with the replicate after those of an experiment with the factor 1: worlds that no surface contains.
    """

    name: str
    treatment: Mapping[str, Any] | Callable[[int], Variant]
    cells: tuple[tuple[int, float], ...]
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    replicates: int = 1
    fresh: bool = False

    def variant(self, replicate: int) -> Variant:
        """Return the treatment of a replicate, with the columns that describe it."""
        return self.treatment(replicate) if callable(self.treatment) else Variant(self.treatment, {})

    def parameters(self, setting: Mapping[str, Any], replicate: int = 0) -> dict[str, Any]:
        """Return the treatment of a replicate under `setting`, without what has no effect on it.

        That is policy options which its policy does not have, and values of the setting that are the defaults. Runs
        that differ only in these have equal keys, and are made once.
        """
        from teamsight.agents.cmommt import DEFAULTS
        from teamsight.agents.resolve import shared_options

        treatment = self.variant(replicate).treatment
        unusual = {name: value for name, value in setting.items() if value != DEFAULTS.get(name)}
        found = {**unusual, **treatment}
        options = shared_options(treatment["policy"], found.pop("policy_options", {}))
        return found | ({"policy_options": options} if options else {})

    def rows(
        self, setting: Mapping[str, Any], root: int, runs: int, steps: int
    ) -> Iterator[tuple[dict[str, Any], Run]]:
        """Yield each run with the columns of the table that identify it.

        Parameters
        ----------
        setting : mapping
            Keyword parameters of CMOMMT that hold throughout.
        root : int
            Root seed.
        runs, steps : int
            Replicates of each cell, and steps of each run.
        """
        count, first = runs * self.replicates, runs if self.fresh else 0
        # One mapping for all replicates of one treatment, by which runs recognise each other.
        distinct = range(first, first + (count if callable(self.treatment) else 1))
        common = [self.parameters(setting, replicate) for replicate in distinct]
        columns = [self.variant(replicate).columns for replicate in distinct]
        sweeps = [dict(zip(self.sweep, values, strict=True)) for values in product(*self.sweep.values())]
        for robots, radius in self.cells:
            scenario = {"robots": robots, "targets": self.targets, "radius": radius}
            for swept in sweeps:
                parameters = [each | scenario | swept for each in common]
                for replicate in range(first, first + count):
                    variant = (replicate - first) % len(distinct)
                    seed = model_seed(root, replicate, robots, self.targets, radius)
                    named = {**scenario, **swept, **columns[variant], "replicate": replicate, "seed": seed}
                    yield named, Run(parameters[variant], seed, steps)


class Request(NamedTuple):
    """Experiments to be made under one setting."""

    setting: Mapping[str, Any]
    experiments: Sequence[Experiment]


def make_tables(
    requests: Sequence[Request],
    pool: Executor | None = None,
    *,
    root: int,
    runs: int,
    steps: int,
    progress: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
) -> list[dict[str, pd.DataFrame]]:
    """Run experiments and return, for each request, a table for each experiment by name.

    Parameters
    ----------
    requests : sequence of Request
        The experiments. A run that several of them need is made once.
    pool : Executor, optional
        Processes that do the work; by default this process. The tables do not depend on it.
    root : int
        Root seed.
    runs, steps : int
        Replicates of each cell, and steps of each run.
    progress, checkpoint
        See `run_all`.

    Returns
    -------
    list of dict of str to DataFrame
        One row a run, in the order of the cells: robots, targets, radius, the parameters that are swept, the columns
        of the variant, replicate, seed, observed_fraction, max_neighbours.

    Raises
    ------
    JobError
        If a run fails; the message contains its settings.
    """
    planned = [
        (experiment.name, number, columns, run)
        for number, request in enumerate(requests)
        for experiment in request.experiments
        for columns, run in experiment.rows(request.setting, root, runs, steps)
    ]
    outcomes = run_all([run for *_, run in planned], pool, progress=progress, checkpoint=checkpoint)
    rows: list[dict[str, list[dict[str, Any]]]] = [{} for _ in requests]
    for (name, number, columns, _), outcome in zip(planned, outcomes, strict=True):
        rows[number].setdefault(name, []).append(columns | outcome._asdict())
    return [{name: pd.DataFrame(table) for name, table in tables.items()} for tables in rows]
