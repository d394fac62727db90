"""Choose δ before any learning: simulate, count neighbours, and find the ring size for a stated risk (§4, §10)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from teamsight.analysis.delta import report
from teamsight.analysis.delta.degrees import Factory
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.delta.simulate_degrees import Progress, SimulatedDegrees, simulate_degrees
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.workers import WorkerPool
from teamsight.core import checks


def runs_for(risk: float) -> int:
    """Return a number of runs that determines δ well: about ten of them exceed it."""
    return math.ceil(10.0 / checks.number("risk", risk, above=0.0, most=1.0))


def choose_delta(
    model: Factory | Mapping[str, Any],
    *,
    runs: int | None = None,
    steps: int = 600,
    risk: float = 0.01,
    rng: int | None = None,
    confidence: float = 0.95,
    subject: str | None = None,
    pool: WorkerPool | None = None,
    progress: Progress = lambda done, total: None,
) -> DeltaReport:
    """Choose δ for a stated risk by simulation.

    Parameters
    ----------
    model : mapping or callable
        Keyword parameters of `CMOMMT` (without rng and seed), or a function that makes a `World` from a seed.
    runs : int, optional
        Number of runs; ``runs_for(risk)`` when not given.
    steps : int
        T, the length of a run.
    risk : float
        Maximum probability that any robot has more than δ neighbours during a run of T steps; between 0 and 1.
    rng : int, optional
        Root seed; a random one by default.
    confidence : float
        Confidence of each bound by itself.
    subject : str, optional
        Description of what was simulated, in one line.
    pool : WorkerPool, optional
        Processes that do the work; by default this process.
    progress : callable
        Called with the runs done and the runs in all.

    Returns
    -------
    DeltaReport
        ``delta`` is the point estimate, ``delta_safe`` the smallest δ whose upper confidence bound is within the risk.

    Raises
    ------
    ValueError, TypeError
        See `simulate_degrees`.

    Notes
    -----
    *Source:* §4 takes the largest number of neighbours in 5 runs of 600 steps for δ.

    *Departs:* the largest value grows with the number of runs and steps up to N − 1. Here δ is chosen for a stated
    risk in a run of a stated length, and has confidence bounds.
    """
    risk = checks.number("risk", risk, above=0.0, most=1.0)
    confidence = checks.number("confidence", confidence, above=0.5, most=0.999999)
    if runs is None and 10 / risk > limits.MOST_RUNS:
        raise ValueError(
            f"risk={risk:g}: needs {10 / risk:.1e} runs, at most {limits.MOST_RUNS}; give a risk of at least "
            f"{10 / limits.MOST_RUNS:g}, or runs"
        )
    runs = runs_for(risk) if runs is None else runs
    found = simulate_degrees(model, runs=runs, steps=steps, rng=rng, pool=pool, progress=progress)
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


def _describe(model: Factory | Mapping[str, Any], found: SimulatedDegrees) -> str:
    length = f"{len(found.maxima):,} runs of {found.steps:,} steps"
    if isinstance(model, Mapping):
        settings = ", ".join(f"{name}={value}" for name, value in model.items())
        return f"CMOMMT({settings}), {length}"
    return f"{getattr(model, '__name__', type(model).__name__)}, {found.robots} robots, {length}"
