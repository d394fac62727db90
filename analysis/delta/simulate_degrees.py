"""Degrees in many runs of a model, with samples of the bearings of neighbours."""

from __future__ import annotations

import contextlib
import math
import pickle
import secrets
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd

from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.analysis.delta import sector_occupancy, team_conditions
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.degrees import Degrees, Factory, FromSeed, degrees, degrees_with_bearings
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.run import Run
from teamsight.analysis.runs.seeds import model_seed, run_seed
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.core import checks

#: Called with the runs done and the runs in all.
Progress = Callable[[int, int], None]

# Bearings are sampled until they are known of so many robots and times.
_ENOUGH_SAMPLES = 500_000


class SimulatedDegrees(NamedTuple):
    """Degrees in all runs.

    ``maxima`` has one row a run: run, seed, max_neighbours. ``robots`` is the size of the largest team at any time.
    ``prediction`` is the closed form for one run, or None if the arena is not a disc, the robots differ in range, come
    and go, or are of several teams; ``awareness_range`` is None where ranges differ.
    """

    maxima: pd.DataFrame
    bearings: Bearings
    robots: int
    steps: int
    awareness_range: float | None
    prediction: Prediction | None
    notes: tuple[str, ...]


def simulate_degrees(
    model: Factory | Mapping[str, Any],
    *,
    runs: int,
    steps: int = 600,
    rng: int | None = None,
    pool: WorkerPool | None = None,
    progress: Progress = lambda done, total: None,
) -> SimulatedDegrees:
    """Run a model many times, and return the largest degree of each run and samples of the neighbours' bearings.

    Parameters
    ----------
    model : mapping or callable
        Keyword parameters of `CMOMMT` (without rng and seed), or a function that makes a `World` from a seed.
    runs, steps : int
        Number of runs, and steps of each.
    rng : int, optional
        Root seed; a random one by default. The seeds of the runs derive from it and are in ``maxima``.
    pool : WorkerPool, optional
        Processes that do the work; by default this process. The result does not depend on it.
    progress : callable
        Called with the runs done and the runs in all.

    Returns
    -------
    SimulatedDegrees

    Raises
    ------
    ValueError, TypeError
        If a number is outside its limits, the model's parameters are wrong, a factory does not return a `World` or
        cannot be sent to worker processes, or no agent of the first world is on a team.
    JobError
        If a later run fails.

    Notes
    -----
    All agents that are on a team count, whatever their group. Steps that a factory has already made do not.

    *Source:* §4, with 5 runs of 600 steps; §10 recommends it "in the beginning of the learning phase (exploration)".
    """
    runs, steps = limits.runs(runs), limits.steps(steps)
    root = secrets.randbits(32) if rng is None else checks.count("rng", rng, least=0)
    planned = _planned(model, root, runs, steps)
    if pool is not None and pool.size > 1 and not isinstance(model, Mapping):
        _check_can_be_sent(model)
    found = _within_samples(_measured(planned, pool, progress))
    met = set[team_conditions.Conditions]().union(*(one.met for one in found))
    largest = max(one.max_neighbours for one in found)
    size = max(*(one.largest_team for one in found), *(one.robots for one in met), largest + 1 if largest else 0)
    rows = [(run, planned[run].seed, one.max_neighbours) for run, one in enumerate(found)]
    return SimulatedDegrees(
        pd.DataFrame(rows, columns=["run", "seed", "max_neighbours"]),
        sector_occupancy.gather(one.bearings for one in found if one.bearings is not None),
        size,
        steps,
        team_conditions.awareness_range(met),
        team_conditions.predict(met, size, steps),
        team_conditions.notes(met, size),
    )


def _planned(model: Factory | Mapping[str, Any], root: int, runs: int, steps: int) -> list[Run]:
    """Return the runs of a model, each of which samples bearings."""
    if not isinstance(model, Mapping):
        if not callable(model):
            raise TypeError(
                f"model={model!r}: must be keyword parameters of CMOMMT, or a callable from a seed to a model"
            )
        made = FromSeed(model)
        return [Run({}, run_seed(root, run), steps, degrees_with_bearings, made) for run in range(runs)]
    from teamsight.agents.cmommt import CMOMMT

    settings = dict(model)
    for name in ("rng", "seed"):
        if name in settings:
            raise ValueError(
                f"{name}={settings[name]!r}: each run gets a seed of its own; give rng to choose_delta instead"
            )
    with contextlib.closing(CMOMMT(**settings, rng=0)) as first:
        # Given, or by default.
        scenario = [first.settings[name] for name in ("robots", "targets", "radius")]
    return [Run(settings, model_seed(root, run, *scenario), steps, degrees_with_bearings) for run in range(runs)]


def _check_can_be_sent(model: Factory) -> None:
    try:
        pickle.dumps(model)
    except Exception as error:
        raise TypeError(
            f"model={model!r}: cannot be sent to worker processes; give a function of a module, or leave out pool"
        ) from error


def _measured(planned: Sequence[Run], pool: WorkerPool | None, progress: Progress) -> list[Degrees]:
    """Return the degrees of all runs; those beyond `_ENOUGH_SAMPLES` do not sample bearings."""
    found = [_first(planned[0])]
    progress(1, len(planned))
    while len(found) < len(planned):
        done, samples = len(found), sum(one.samples for one in found)
        some = planned[done:]
        if samples < _ENOUGH_SAMPLES:
            some = some[: math.ceil((_ENOUGH_SAMPLES - samples) * done / max(samples, 1))]
        else:
            some = [replace(run, measure=degrees) for run in some]

        def show(cost: float, total: float, done: int = done, count: int = len(some)) -> None:
            progress(done + round(cost / total * count), len(planned))

        found += run_all(some, pool, progress=show)
    return found


def _first(run: Run) -> Degrees:
    """Make the first run in this process, where its errors keep their types and its kernels are compiled once."""
    with contextlib.closing(ReusedWorlds()) as worlds:
        found: Degrees = run.make(worlds)
        if not (found.max_neighbours or found.largest_team or any(one.robots for one in found.met)):
            raise ValueError(
                f"model={run.model or run.parameters!r}: no agent is on a team in the world of seed {run.seed}, so "
                "none has neighbours; add a group of Robot, or of an agent class with a team"
            )
    return found


def _within_samples(found: Sequence[Degrees]) -> list[Degrees]:
    """Drop the samples of all runs after the one that completes `_ENOUGH_SAMPLES`."""

    def kept() -> Iterator[Degrees]:
        samples = 0
        for one in found:
            yield one if samples < _ENOUGH_SAMPLES else one.without_samples()
            samples += one.samples

    return list(kept())
