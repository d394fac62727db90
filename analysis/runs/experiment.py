"""Experiments: a treatment over team sizes and arena radii, and the tables that its runs give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
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


class Extent(NamedTuple):
    """How much is run.

    Attributes
    ----------
    grid : Grid
        Team sizes and radii of the surfaces.
    runs : int
        Replicates of each cell.
    interval : float
        The width of an interval [percentage points] from which on it is narrow enough, for experiments whose number of
        replicates depends on it; 0 if they shall have as many as they can.
    """

    grid: Grid
    runs: int
    interval: float = 0.0


#: Takes the tables that are made, and how much is run, and returns the replicates of each cell.
Choice: TypeAlias = Callable[[Tables, Extent], Mapping[tuple[int, float], Sequence[int]]]


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
        Returns the replicates of each cell, which depend on results: on `cells` and `replicates` they then do not
        depend. It is asked again after all that it asked for is made, until it asks for nothing more.
    reads : tuple of str
        Names of the experiments whose tables it reads.
    """

    name: str
    treatment: Parameters | Callable[[Parameters, int], Variant]
    cells: Cells | Callable[[int, float], bool] = lambda robots, radius: True
    targets: int = 15
    sweep: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    replicates: int = 1
    choose: Choice | None = None
    reads: tuple[str, ...] = ()

    def wanted(self, extent: Extent, tables: Tables) -> Mapping[tuple[int, float], Sequence[int]]:
        """Return the replicates of each cell (robots, radius)."""
        if self.choose is not None:
            return self.choose(tables, extent)
        cells = [one for one in extent.grid.cells if self.cells(*one)] if callable(self.cells) else self.cells
        return dict.fromkeys(cells, range(extent.runs * self.replicates))

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
        self, setting: Parameters, root: int, runs: int, steps: int, grid: Grid = NO_GRID,
        tables: Tables | None = None, interval: float = 0.0,
    ) -> Iterator[tuple[dict[str, Any], Run]]:  # fmt: skip
        """Yield each run with the columns of the table that identify it.

        Parameters
        ----------
        setting : mapping
            Keyword parameters of CMOMMT that hold throughout.
        root : int
            Root seed.
        steps : int
            Steps of each run.
        runs, grid, interval
            See `Extent`.
        tables : mapping of str to DataFrame
            The tables of the experiments that this one reads.
        """
        extent = Extent(grid, runs, interval)
        # One mapping for all replicates of one treatment, by which runs recognise each other.
        kind = (lambda replicate: replicate) if callable(self.treatment) else lambda replicate: 0
        parameters = cache(lambda number: self.parameters(setting, number))
        columns = cache(lambda number: self.variant(setting, number).columns)
        sweeps = [dict(zip(self.sweep, values, strict=True)) for values in product(*self.sweep.values())]
        for (robots, radius), replicates in self.wanted(extent, tables or {}).items():
            scenario = {"robots": robots, "targets": self.targets, "radius": radius}
            for swept in sweeps:
                in_world = cache(lambda number, more=scenario | swept: parameters(number) | more)
                for replicate in replicates:
                    number = kind(replicate)
                    seed = model_seed(root, replicate, robots, self.targets, radius)
                    named = {**scenario, **swept, **columns(number), "replicate": replicate, "seed": seed}
                    yield named, Run(in_world(number), seed, steps)


def make_tables(
    asked: Sequence[tuple[Parameters, Sequence[Experiment]]],
    pool: Executor | None = None,
    *,
    grid: Grid = NO_GRID,
    interval: float = 0.0,
    progress: Progress = lambda done, total: None,
    later: Progress = lambda done, total: None,
    checkpoint: Checkpoint | None = None,
    **how: int,
) -> list[dict[str, pd.DataFrame]]:
    """Run experiments, then those that depend on results, and return for each setting their tables by name.

    Parameters
    ----------
    asked : sequence of (mapping, sequence of Experiment)
        Settings, and what is made under each. A run that several experiments need is made once.
    pool : Executor, optional
        Processes that do the work; by default this process. The tables do not depend on it.
    grid, interval
        See `Extent`.
    progress, checkpoint
        See `run_all`.
    later : callable
        As `progress`, for what is run because of results.
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
    watch = progress
    tables: list[dict[str, pd.DataFrame]] = [{} for _ in asked]
    found: dict[tuple[Any, ...], Outcome] = {}
    pending = [(number, setting, one) for number, (setting, several) in enumerate(asked) for one in several]
    while True:
        planned = [
            (number, one.name, [
                ((number, one.name, *(columns[name] for name in one.sweep), run.seed), columns, run)
                for columns, run in one.rows(setting, grid=grid, tables=tables[number], interval=interval, **how)
            ])
            for number, setting, one in pending
        ]  # fmt: skip
        new = {place: run for *_, rows in planned for place, _, run in rows if place not in found}
        if not new:
            return tables
        found |= zip(new, run_all(new.values(), pool, progress=watch, checkpoint=checkpoint), strict=True)
        for number, name, rows in planned:
            if rows:
                table = pd.DataFrame([columns | Outcome(*found[place])._asdict() for place, columns, _ in rows])
                table.attrs["measures"] = list(Outcome._fields)
                tables[number][name] = table
        pending, watch = [one for one in pending if one[2].choose is not None], later
