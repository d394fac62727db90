"""Experiments: a treatment over team sizes and arena radii, and the tables that its runs give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple, TypeAlias

import pandas as pd

from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.grid import Grid
from teamsight.analysis.runs.run import Outcome, Run
from teamsight.analysis.runs.seeds import model_seed
from teamsight.analysis.runs.simulate import Progress, run_all

#: Keyword parameters of CMOMMT.
Parameters: TypeAlias = Mapping[str, Any]
#: Team sizes and arena radii.
Cells: TypeAlias = tuple[tuple[int, float], ...]
#: The grid of experiments whose cells do not depend on one.
NO_GRID = Grid((), ())
#: One row a run, by name of the experiment.
Tables: TypeAlias = Mapping[str, pd.DataFrame]


class Variant(NamedTuple):
    """The treatment of one replicate of every cell, and the columns of the table that describe it."""

    treatment: Parameters
    columns: Mapping[str, Any] = {}


@dataclass(frozen=True)
class Experiment:
    """A treatment over cells (robots, radius); each replicate of a cell is one run.

    Parameters
    ----------
    name : str
        Name of the resulting table.
    treatment : mapping or callable
        Keyword parameters of CMOMMT; or a function that takes the setting and the number of a replicate and returns its
        `Variant`.
    cells : tuple of (int, float), or callable
        Team size and arena radius of each cell; or a function of both that says which cells of a grid are meant, by
        default all.
    targets : int
        Number of targets.
    sweep : mapping of str to tuple
        Further keyword parameters with their values. All combinations are run; each parameter becomes a column.
    replicates : int
        Factor on the number of replicates.
    choose : callable, optional
        Takes the tables of the other experiments and returns the cells, which are measured again: replicates begin with
        the one after those of an experiment with the factor 1, in worlds that no surface contains.
    """

    name: str
    treatment: Parameters | Callable[[Parameters, int], Variant]
    cells: Cells | Callable[[int, float], bool] = lambda robots, radius: True
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    replicates: int = 1
    choose: Callable[[Tables], Cells] | None = None

    def cells_of(self, grid: Grid, tables: Tables) -> Cells:
        """Return the cells (robots, radius)."""
        if self.choose is not None:
            return self.choose(tables)
        return tuple(one for one in grid.cells if self.cells(*one)) if callable(self.cells) else self.cells

    def variant(self, setting: Parameters, replicate: int = 0) -> Variant:
        """Return the treatment of a replicate, with the columns that describe it."""
        return self.treatment(setting, replicate) if callable(self.treatment) else Variant(self.treatment)

    def parameters(self, setting: Parameters, replicate: int = 0) -> dict[str, Any]:
        """Return the treatment of a replicate under `setting`, without what has no effect on it.

        That is policy options which its policy does not have, and values of the setting that are the defaults. Runs
        that differ only in these have equal keys, and are made once.
        """
        from teamsight.agents.cmommt import DEFAULTS
        from teamsight.agents.resolve import shared_options

        treatment = self.variant(setting, replicate).treatment
        unusual = {name: value for name, value in setting.items() if value != DEFAULTS.get(name)}
        found = {**unusual, **treatment}
        options = shared_options(treatment["policy"], found.pop("policy_options", {}))
        return found | ({"policy_options": options} if options else {})

    def rows(
        self, setting: Parameters, root: int, runs: int, steps: int, grid: Grid = NO_GRID, tables: Tables | None = None
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
        grid : Grid
            Team sizes and radii of the surfaces.
        tables : mapping of str to DataFrame
            The tables of the other experiments, for one that measures cells again.
        """
        count, first = runs * self.replicates, runs if self.choose else 0
        # One mapping for all replicates of one treatment, by which runs recognise each other.
        distinct = range(first, first + (count if callable(self.treatment) else 1))
        common = [self.parameters(setting, replicate) for replicate in distinct]
        columns = [self.variant(setting, replicate).columns for replicate in distinct]
        sweeps = [dict(zip(self.sweep, values, strict=True)) for values in product(*self.sweep.values())]
        for robots, radius in self.cells_of(grid, tables or {}):
            scenario = {"robots": robots, "targets": self.targets, "radius": radius}
            for swept in sweeps:
                parameters = [each | scenario | swept for each in common]
                for replicate in range(first, first + count):
                    variant = (replicate - first) % len(distinct)
                    seed = model_seed(root, replicate, robots, self.targets, radius)
                    named = {**scenario, **swept, **columns[variant], "replicate": replicate, "seed": seed}
                    yield named, Run(parameters[variant], seed, steps)


def make_tables(
    asked: Sequence[tuple[Parameters, Sequence[Experiment]]],
    pool: Executor | None = None,
    *,
    grid: Grid = NO_GRID,
    progress: Progress = lambda done, total: None,
    later: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
    **how: int,
) -> list[dict[str, pd.DataFrame]]:
    """Run experiments, then those that measure cells again, and return for each setting their tables by name.

    Parameters
    ----------
    asked : sequence of (mapping, sequence of Experiment)
        Settings, and what is made under each. A run that several experiments need is made once.
    pool : Executor, optional
        Processes that do the work; by default this process. The tables do not depend on it.
    grid : Grid
        Team sizes and radii of the surfaces.
    progress, checkpoint
        See `run_all`.
    later : callable
        As `progress`, for the experiments that measure again.
    **how
        root, the root seed; runs and steps: replicates of each cell, and steps of each run.

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
    tables: list[dict[str, pd.DataFrame]] = [{} for _ in asked]
    for is_again, watch in ((False, progress), (True, later)):
        planned = [
            ((number, experiment.name), columns, run)
            for number, (setting, experiments) in enumerate(asked)
            for experiment in experiments
            if (experiment.choose is not None) == is_again
            for columns, run in experiment.rows(setting, grid=grid, tables=tables[number], **how)
        ]
        outcomes = run_all([run for *_, run in planned], pool, progress=watch, checkpoint=checkpoint) if planned else []
        rows: dict[tuple[int, str], list[dict[str, Any]]] = {}
        for (place, columns, _), outcome in zip(planned, outcomes, strict=True):
            rows.setdefault(place, []).append(columns | Outcome(*outcome)._asdict())
        for (number, name), table in rows.items():
            tables[number][name] = pd.DataFrame(table)
            tables[number][name].attrs["measures"] = list(Outcome._fields)
    return tables
