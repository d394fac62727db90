"""`run_many`: many runs from a script, in a table with one row for each run."""

from __future__ import annotations

import contextlib
import copy
import inspect
import math
import secrets
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.runs import limits
from teamsight.analysis.runs.executor import error_text
from teamsight.analysis.runs.processes import WorkerPool, check_workers
from teamsight.analysis.runs.progress_line import check_progress
from teamsight.analysis.runs.run import (
    Model,
    Run,
    TaskMeasure,
    check_takes_rng,
    columns_of,
    expect_world,
    is_cmommt,
    task_seed,
)
from teamsight.analysis.runs.seeds import seeds_of
from teamsight.analysis.runs.simulate import Progress, run_all
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.reused_worlds import ReusedWorlds
    from teamsight.agents.world import World
    from teamsight.tasks.model import TaskModel
    from teamsight.tasks.task import Task

Settings = Mapping[str, Any] | Iterable[Mapping[str, Any]] | pd.DataFrame

# Columns of the table that are not parameters of the model.
_OWN = ("replicate", "seed", "steps")


class Summary(NamedTuple):
    """What `run_many` measures unless it is given another function.

    Attributes
    ----------
    observed_fraction : float
        Mean over the steps of the fraction of targets that at least one robot senses, in [0, 1]; NaN without targets.
        What else counts is declared by `World.senses`.
    max_neighbours : int
        Largest number of teammates within the awareness range of any robot of any team at any step.
    mean_neighbours : float
        Mean of that number over robots and steps; NaN without robots.
    """

    observed_fraction: float
    max_neighbours: int
    mean_neighbours: float


def summary(world: World, steps: int) -> Summary:
    """Run a world and return its `Summary`."""
    world.run(steps)
    return Summary(float(world.observed_fraction), int(world.max_neighbours), world.recording.mean_neighbours)


def run_many(
    settings: Settings,
    *,
    task: Task | str | None = None,
    steps: int | None = None,
    replicates: int | None = None,
    seeds: Iterable[int] | None = None,
    rng: int | None = None,
    model: Model | None = None,
    measure: Callable[[World, int], Any] | None = None,
    workers: int = 1,
    on_error: Literal["stop", "continue"] = "stop",
    progress: Progress | bool = True,
) -> pd.DataFrame:
    """Run a model many times and return a table with one row for each run.

    Runs that differ in their seed only, and those of `CMOMMT` also in radius, ranges and speeds, share one built world,
    which makes short runs several times as fast as building each. The results are those of ``model(**setting,
    rng=seed)`` to the last bit, for any number of workers.

    Parameters
    ----------
    settings : mapping, iterable of mapping, or DataFrame
        Keyword parameters of the model. In a mapping, each list, tuple, range or array holds values to be combined: all
        combinations are run. An iterable of mappings, or the rows of a table, are run as they are.
    task : Task or str, optional
        A task, or the name of one. Settings then have values of its scenario, ``treatment`` ("skilled", the default, or
        "explore"), and other parameters of its world.
    steps : int, optional
        Steps of each run; by default those of the task, or 600.
    replicates : int, optional
        Runs of each setting, whose seeds derive from `rng`; 1 by default. Settings with the same robots, targets and
        radius, of a task those with the same scenario, and with a `model` of your own all settings, get the same seeds:
        their differences are paired.
    seeds : iterable of int, optional
        Seeds under which each setting is run, in place of `replicates` and `rng`.
    rng : int, optional
        The seed from which those of the runs derive; by default a new one is drawn.
    model : callable, optional
        A class or function that is called as ``model(**setting, rng=seed)``; `CMOMMT` by default. Worlds of your
        own classes are built for each run.
    measure : callable, optional
        ``measure(world, steps)`` runs the world and returns a NamedTuple or a mapping: columns of the table, which are
        copied. The world is valid until `measure` returns.
    workers : int
        Number of processes; with 1 all runs are made in this one. With more, `model` and `measure` must be functions or
        classes of a module, and a script must start the runs under ``if __name__ == "__main__":``.
    on_error : {"stop", "continue"}
        What to do after a run that fails: raise its error; or go on, with a column ``error`` that says why, and that is
        None for other runs. A run that fails has no value in the columns of the measure.
    progress : callable or bool
        Called as ``progress(done, total)`` whenever some of the work is done. With True, a terminal or a notebook shows
        after two seconds how far it is; with False it does not.

    Returns
    -------
    DataFrame
        The settings, replicate, seed and steps of each run, and what was measured: by default observed_fraction,
        or the metrics of the task, max_neighbours and mean_neighbours. Rows are in the order of the settings.

    Raises
    ------
    TypeError, ValueError
        If an argument is of the wrong type or outside its limits.
    JobError
        If a run fails and `on_error` is "stop", for example because a parameter is wrong or `measure` returns no
        columns; the message contains its settings.

    Examples
    --------
    >>> table = run_many({"robots": [5, 10], "radius": [2.0, 4.0]}, steps=100, replicates=3, rng=1)
    >>> table.groupby(["robots", "radius"])["observed_fraction"].mean()  # doctest: +SKIP
    """
    for name, function, form in (
        ("model", model, "model(**setting, rng=seed)"), ("measure", measure, "measure(world, steps)"),
    ):  # fmt: skip
        if not callable(function) and function is not None:
            raise TypeError(f"{name}={checks.shown(function)}: must be a function that is called as {form}")
    check_progress(progress)
    if model is not None:
        with contextlib.suppress(ValueError):  # a class written in C has no signature
            check_takes_rng(model, inspect.signature(model).parameters)
    made = _made_by(task, model)
    steps = limits.steps(steps if steps is not None else 600 if made is None else made.task.steps)
    workers = check_workers(workers)
    goes_on = checks.choice("on_error", on_error, ("stop", "continue")) == "continue"
    measure = measure or (summary if made is None else TaskMeasure(made.task))
    listed, (count, seeds_of) = _listed(settings), _seeding(replicates, seeds, rng, model, made)
    limits.runs(len(listed) * count)
    planned = [(setting, *one) for setting in listed for one in enumerate(seeds_of(setting))]
    columns = Columns(measure, frozenset(_OWN).union(*listed, ("error",) * goes_on))
    given = listed if made is None else [made.parameters(setting) for setting in listed]
    called = model if made is None or is_cmommt(made.task) else made.task.world
    runs = [
        _Row(given[row // count], seed, steps, columns, called, row, goes_on)
        for row, (_, _, seed) in enumerate(planned)
    ]  # fmt: skip
    with WorkerPool(workers) as pool:
        found = run_all(runs, pool, progress=progress)
    rows = [
        {**setting, "replicate": replicate, "seed": seed, "steps": steps, **one}
        for (setting, replicate, seed), one in zip(planned, found, strict=True)
    ]
    table = pd.DataFrame(rows)
    if goes_on:
        # pandas would make NaN of None.
        table["error"] = pd.Series([one["error"] for one in found], dtype=object)
    return table


def _made_by(task: Task | str | None, model: Model | None) -> TaskModel | None:
    """Return a task as a model."""
    if task is None:
        return None
    from teamsight.tasks.model import TaskModel
    from teamsight.tasks.named import task_of

    if model is not None:
        raise ValueError(f"model={checks.shown(model)}: a task has worlds of its own; give either")
    return TaskModel(task_of(task))


@dataclass(frozen=True)
class _Row(Run):
    """The run of one row. No two rows share a run, because settings whose reprs are equal may differ."""

    row: int = 0
    goes_on: bool = False

    @property
    def key(self) -> tuple[str, ...]:
        return (str(self.row),)

    def make(self, worlds: ReusedWorlds) -> Any:
        if not self.goes_on:
            return super().make(worlds)
        try:
            return {**super().make(worlds), "error": None}
        except Exception as error:  # whatever the code of a user raises
            return {"error": error_text(error)}


@dataclass(frozen=True)
class Columns:
    """Runs a world, and returns copies of the columns that a function measures.

    Parameters
    ----------
    measure : callable
        See `run_many`.
    taken : frozenset of str
        The other columns of the table.
    """

    measure: Callable[[World, int], Any]
    taken: frozenset[str]

    def __call__(self, world: World, steps: int) -> dict[str, Any]:
        """Run the world and return the columns."""
        measured = columns_of(self.measure(expect_world(world), steps), self.taken)
        # The next run may write into the arrays of this world.
        return {name: copy.deepcopy(value) for name, value in measured.items()}


def _listed(settings: Any) -> list[dict[str, Any]]:
    """Return the settings one by one."""
    if isinstance(settings, pd.DataFrame):
        if not settings.columns.is_unique:
            twice = settings.columns[settings.columns.duplicated()][0]
            raise ValueError(f"settings: the table has the column {twice!r} twice; keep one")
        # By columns, because a row of mixed types would turn integers into floats.
        columns = {name: settings[name].tolist() for name in settings.columns}
        listed = [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]
    elif isinstance(settings, Mapping):
        swept = [_values(value) for value in settings.values()]
        if combinations := math.prod(map(len, swept)):
            limits.runs(combinations)
        listed = [dict(zip(settings, values, strict=True)) for values in product(*swept)]
    else:
        if isinstance(settings, str) or not isinstance(settings, Iterable):
            raise TypeError(_WHAT.format(checks.shown(settings)))
        listed = list(islice(settings, limits.MOST_RUNS + 1))
        for setting in listed:
            if not isinstance(setting, Mapping):
                raise TypeError(_WHAT.format(checks.shown(setting)))
        listed = [dict(setting) for setting in listed]
    if not listed:
        raise ValueError("settings: there are none to run; give at least one, such as {} for the defaults")
    for setting in listed:
        for name in setting:
            if not isinstance(name, str):
                raise TypeError(f"settings: the name {checks.shown(name)} must be a text, such as 'robots'")
            if name == "rng" or name in _OWN:
                raise ValueError(f"settings: {name!r} is not a setting; give it as {_PLACES.get(name, 'an argument')}")
    return listed


_WHAT = "settings={}: must be a mapping of parameters, an iterable of mappings, or a DataFrame"
_PLACES = {"rng": "seeds=[…], or rng=… with replicates", "seed": "seeds=[…]", "replicate": "replicates=…"}


def _values(value: Any) -> Sequence[Any]:
    """Return the values of one parameter."""
    if isinstance(value, (list, tuple, range)):
        return value
    return value.tolist() if isinstance(value, np.ndarray) and value.ndim else [value]


def _seeding(
    replicates: int | None,
    seeds: Iterable[int] | None,
    rng: int | None,
    model: Model | None,
    made: TaskModel | None,
) -> tuple[int, Callable[[Mapping[str, Any]], list[int]]]:
    """Return how many runs each setting has, and the function that returns their seeds."""
    if seeds is not None:
        if replicates is not None or rng is not None:
            raise ValueError("seeds: cannot be combined with replicates or rng; give either")
        if isinstance(seeds, str) or not isinstance(seeds, Iterable):
            raise TypeError(f"seeds={checks.shown(seeds)}: must be several whole numbers, such as [1, 2] or range(10)")
        given = [checks.count("seeds", seed, least=0) for seed in islice(seeds, limits.MOST_RUNS + 1)]
        if not given:
            raise ValueError("seeds: there are none; give at least one, or replicates=…")
        return len(given), lambda setting: given
    count = limits.runs(1 if replicates is None else replicates, "replicates")
    root = secrets.randbits(32) if rng is None else checks.count("rng", rng, least=0)
    if made is not None:
        task = made.task
        return count, lambda setting: [task_seed(task, root, run, made.scenario(setting)) for run in range(count)]
    return count, lambda setting: [*map(seeds_of(root, setting, model is None), range(count))]


class Evenness(NamedTuple):
    """The columns of `evenness`: those of the summary, and three more.

    Attributes
    ----------
    observed_fraction, max_neighbours, mean_neighbours
        As in the summary of `run_many`.
    spread : float
        Standard deviation over the targets of the share of its steps in which each is observed; 0 if it is the same.
    entropy : float
        Entropy of the targets' shares of all observation [nat]: at most the logarithm of their number.
    redundancy : float
        Mean number of robots that sense an observed target, at least 1.
    """

    observed_fraction: float
    spread: float
    entropy: float
    redundancy: float
    max_neighbours: int
    mean_neighbours: float


def evenness(world: World, steps: int) -> Evenness:
    """Run a world and return its `Evenness`: a measure for `run_many`, and "evenness" for studies.

    Parameters
    ----------
    world : World
        The world; it counts observations during these steps only, unless it counts them already.
    steps : int
        The number of steps.
    """
    before = world.sources
    counts = world.count_observations()
    found = summary(world, steps)
    measured = Evenness(
        found.observed_fraction, counts.spread, counts.entropy, counts.redundancy, found.max_neighbours,
        found.mean_neighbours,
    )  # fmt: skip
    if not any(counts is source for source in before):
        # So that the next run can use the world again.
        world.detach(counts)
    return measured
