"""δ before any learning: explore, count neighbours, and say how large a ring must be for a stated risk (§4, §10)."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from teamsight.analysis.delta import report, sector_occupancy, team_conditions
from teamsight.analysis.delta.closed_form import Prediction
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.delta.sector_occupancy import Bearings
from teamsight.analysis.delta.team_conditions import Conditions, conditions
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.seeds import model_seed, run_seed
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.model import World

__all__ = ["DeltaReport", "Exploration", "choose_delta", "explore", "runs_for"]

#: Takes a seed and returns a model.
Factory = Callable[[int], "World"]
#: Called with the runs done and the runs in all.
Progress = Callable[[int, int], None]

# How many times in a run the bearings of neighbours are looked at, and at how many robots at most in all runs.
_LOOKS = 10
_MOST_LOOKED_AT = 500_000


class Exploration(NamedTuple):
    """What the exploring runs left behind.

    ``maxima`` has one row a run: run, seed, max_neighbours. ``robots`` is the size of the largest team, the most that
    were counted at once. ``prediction`` is the closed form for one run, or None where the arena is no disc, the robots
    differ in range, come and go, or are of several teams; ``awareness_range`` is None where ranges differ.
    """

    maxima: pd.DataFrame
    bearings: Bearings
    robots: int
    steps: int
    awareness_range: float | None
    prediction: Prediction | None
    notes: tuple[str, ...]


def runs_for(risk: float) -> int:
    """Return a number of runs that pins δ down well: about ten of them exceed the δ sought."""
    return math.ceil(10.0 / checks.number("risk", risk, above=0.0, most=1.0))


def explore(
    model: Factory | Mapping[str, Any],
    *,
    runs: int,
    steps: int = 600,
    rng: int | None = None,
    progress: Progress | None = None,
) -> Exploration:
    """Run a model again and again, and keep the largest degree of each run and samples of the neighbours' bearings.

    Parameters
    ----------
    model : mapping or callable
        Keyword parameters of `CMOMMT` (without rng and seed), or a function that makes a `World` from a seed.
    runs, steps : int
        Number of runs, and the length of each.
    rng : int, optional
        Seed of the whole exploration; without it a fresh one. The runs' own seeds derive from it and are in ``maxima``.
    progress : callable, optional
        Called with the runs done and the runs in all after each run.

    Returns
    -------
    Exploration

    Raises
    ------
    ValueError, TypeError
        If a number is outside its limits, the model's parameters are, a factory makes no `World`, or nobody in it is
        on a team.

    Notes
    -----
    All agents that are on a team count, whatever their group. Steps that a factory has already made do not.

    *Source:* §4, with 5 runs of 600 steps; §10 recommends it "in the beginning of the learning phase (exploration)".
    """
    runs, steps = limits.runs(runs), limits.steps(steps)
    root = secrets.randbits(32) if rng is None else checks.count("rng", rng, least=0)
    make, seed_of = _factory(model, root)
    rows, looks, looked_at, size, met = [], [], 0, 0, set[Conditions]()
    for run in range(runs):
        seed = seed_of(run)
        world = _made(make, seed)
        try:
            made = len(world.recording.history) if world.tick else 0
            met.add(conditions(world))
            if looked_at < _MOST_LOOKED_AT:
                look, most = _run_looking(world, steps)
                looks.append(look)
                looked_at += len(look.degree)
            else:
                world.run(steps)
                most = 0
            largest = _largest(world, made)
            met.add(conditions(world))
        finally:
            world.close()
        rows.append((run, seed, largest))
        size = max(size, most, *(one.robots for one in met), largest + 1 if largest else 0)
        if not size:
            raise ValueError(
                f"model={model!r}: nobody is on a team in the world of seed {seed}, so nobody has neighbours; add a "
                "group of Robot, or of an agent class with a team"
            )
        if progress is not None:
            progress(run + 1, runs)
    maxima = pd.DataFrame(rows, columns=["run", "seed", "max_neighbours"])
    return Exploration(
        maxima,
        sector_occupancy.gather(looks),
        size,
        steps,
        team_conditions.awareness_range(met),
        team_conditions.predict(met, size, steps),
        team_conditions.notes(met, size),
    )


def choose_delta(
    model: Factory | Mapping[str, Any],
    *,
    runs: int | None = None,
    steps: int = 600,
    risk: float = 0.01,
    rng: int | None = None,
    confidence: float = 0.95,
    subject: str | None = None,
    progress: Progress | None = None,
) -> DeltaReport:
    """Choose δ for a stated risk by exploring.

    Parameters
    ----------
    model : mapping or callable
        Keyword parameters of `CMOMMT` (without rng and seed), or a function that makes a `World` from a seed.
    runs : int, optional
        Number of runs; ``runs_for(risk)`` when not given.
    steps : int
        T, the length of a run.
    risk : float
        Accepted probability that in a run of T steps any robot has more than δ neighbours; between 0 and 1.
    rng : int, optional
        Seed of the whole exploration.
    confidence : float
        Of each bound by itself.
    subject : str, optional
        One line that says what was simulated.
    progress : callable, optional
        Called with the runs done and the runs in all after each run.

    Returns
    -------
    DeltaReport
        ``delta`` is the point estimate, ``delta_safe`` the smallest δ whose upper confidence bound is within the risk.

    Raises
    ------
    ValueError, TypeError
        If a number is outside its limits, or the model's parameters are.

    Notes
    -----
    *Source:* §4 takes the largest number of neighbours in 5 runs of 600 steps for δ.

    *Departs:* a largest value grows with the number of runs and steps and has no limit short of N − 1; so δ is chosen
    here for a stated risk in a run of a stated length, and comes with its uncertainty.
    """
    risk = checks.number("risk", risk, above=0.0, most=1.0)
    confidence = checks.number("confidence", confidence, above=0.5, most=0.999999)
    if runs is None and 10 / risk > limits.MOST_RUNS:
        raise ValueError(
            f"risk={risk:g}: asks for {10 / risk:.1e} runs, at most {limits.MOST_RUNS}; give a risk of at least "
            f"{10 / limits.MOST_RUNS:g}, or runs"
        )
    runs = runs_for(risk) if runs is None else runs
    found = explore(model, runs=runs, steps=steps, rng=rng, progress=progress)
    return report.build(
        found.maxima,
        found.bearings,
        robots=found.robots,
        risk=risk,
        confidence=confidence,
        independent=float(len(found.maxima)),
        largest=int(found.maxima["max_neighbours"].max()),
        prediction=found.prediction,
        source="simulation",
        subject=subject or _describe(model, found),
        awareness_range=found.awareness_range,
        length=float(found.steps),
        unit="steps",
        notes=found.notes,
    )


def _factory(model: Factory | Mapping[str, Any], root: int) -> tuple[Factory, Callable[[int], int]]:
    """Return what makes a model from a seed, and what derives the seed of each run."""
    if not isinstance(model, Mapping):
        if not callable(model):
            raise TypeError(
                f"model={model!r}: must be keyword parameters of CMOMMT, or a callable from a seed to a model"
            )
        return model, lambda run: run_seed(root, run)
    from teamsight.agents.cmommt import CMOMMT

    settings = dict(model)
    for name in ("rng", "seed"):
        if name in settings:
            raise ValueError(
                f"{name}={settings[name]!r}: each run gets a seed of its own; give rng to choose_delta instead"
            )
    first = CMOMMT(**settings, rng=0)
    first.close()
    stage = [first.settings[name] for name in ("robots", "targets", "radius")]  # what was given, or its default
    return lambda seed: CMOMMT(**settings, rng=seed), lambda run: model_seed(root, run, *stage)


def _made(make: Factory, seed: int) -> World:
    """Return the world of a seed, once it is known to be one."""
    from teamsight.agents.model import World

    world: Any = make(seed)
    if not isinstance(world, World):
        raise TypeError(f"model({seed}) is {world!r}: must be a World, such as CMOMMT(rng={seed})")
    return world


def _run_looking(world: World, steps: int) -> tuple[Bearings, int]:
    """Run in stretches, which changes nothing in the run; return the bearings after each, and the largest team met."""
    ends = np.linspace(0, steps, min(_LOOKS, steps) + 1).astype(int)
    looks, most = [], 0
    for stretch in np.diff(ends).tolist():
        world.run(stretch)
        members = world.teammates
        most = max(most, members.largest_team)
        looks.append(sector_occupancy.bearings(world.proximity, members.heading))
    return sector_occupancy.gather(looks), most


def _largest(world: World, made: int) -> int:
    """Return the largest degree in the steps after the first that were `made` before."""
    if not made:
        return int(world.max_neighbours)
    return int(world.recording.history["max_neighbours"].to_numpy()[made:].max(initial=0))


def _describe(model: Factory | Mapping[str, Any], found: Exploration) -> str:
    length = f"{len(found.maxima):,} runs of {found.steps:,} steps"
    if isinstance(model, Mapping):
        settings = ", ".join(f"{name}={value}" for name, value in model.items())
        return f"CMOMMT({settings}), {length}"
    return f"{getattr(model, '__name__', type(model).__name__)}, {found.robots} robots, {length}"
