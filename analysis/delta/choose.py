"""Choose δ before any learning: simulate, count neighbours, and find the ring size for a stated risk (§4, §10)."""

from __future__ import annotations

import math
import secrets
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import pandas as pd

from teamsight.analysis.delta import by_group, sector_occupancy, team_conditions
from teamsight.analysis.delta.degrees import CountDegrees, Factory, degrees_of
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.delta.simulated import simulated
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.simulate import Progress
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.tasks.task import Task, Treatment

_PERCEIVED = (
    "Neighbours count when a robot decides: between two decisions it may have more, which it does not perceive."
)


def choose_delta(
    model: Task | str | Factory | Mapping[str, Any],
    *,
    treatment: Treatment | None = None,
    scenario: Mapping[str, Any] | None = None,
    runs: int | None = None,
    steps: int | None = None,
    risk: float = 0.01,
    rng: int | None = None,
    team: str | None = None,
    perceived: bool = False,
    confidence: float = 0.95,
    subject: str | None = None,
    pool: WorkerPool | None = None,
    progress: Progress = lambda done, total: None,
) -> DeltaReport:
    """Choose δ for a stated risk by simulation.

    Parameters
    ----------
    model : Task, str, mapping or callable
        A task, or the name of one; keyword parameters of `CMOMMT` (without rng and seed); or a class or function that
        makes a `World` from a seed, which it is given as ``rng`` or ``seed`` if it has a parameter of that name,
        otherwise as its first argument.
    treatment : "explore", "skilled" or mapping, optional
        Of a task, whose neighbours count: those of the team that explores (the default), of the one with skill, or of
        one with these parameters.
    scenario : mapping, optional
        Of a task, values of its scenario; the others are its defaults.
    runs : int, optional
        Number of runs; 10 / risk when not given, of which about ten exceed δ.
    steps : int, optional
        T, the length of a run; by default that of the task, or 600.
    risk : float
        Maximum probability that any robot has more than δ neighbours during a run of T steps; between 0 and 1.
    rng : int, optional
        Root seed; a random one by default. The seeds of the runs derive from it and are in ``maxima``.
    team : str, optional
        The only team whose robots count; by default that of the task, or all.
    perceived : bool
        Count the neighbours of a robot only when it decides; by default at every step. They differ for robots that
        sense now and then, see `Cycle`. Steps are then made one by one.
    confidence : float
        Confidence of each bound by itself.
    subject : str, optional
        Description of what was simulated, in one line.
    pool : WorkerPool, optional
        Processes that do the work; by default this process. The report does not depend on it.
    progress : callable
        Called with the runs done and the runs in all.

    Returns
    -------
    DeltaReport
        ``delta`` is the point estimate, ``delta_safe`` the smallest δ whose upper confidence bound is within the risk.
        If there are several groups, ``groups`` has both for each group and each team.

    Raises
    ------
    ValueError, TypeError
        If a number is outside its limits, the model's parameters are wrong, a factory does not return a `World` or
        cannot be sent to worker processes, or no agent of the first world is on a team, or on the given one.
    JobError
        If a later run fails.

    Notes
    -----
    All agents that are on a team count, whatever their group. Steps that a factory has already made do not. Neighbours
    of a robot are all active teammates within its awareness range, whether or not its sensor detects them. A robot has
    none while it is inactive or its sensor for teammates is out of order: then it senses nobody.

    *Source:* §4 takes the largest number of neighbours in 5 runs of 600 steps for δ; §10 recommends to choose δ "in the
    beginning of the learning phase (exploration)".

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
    worlds = simulated(model, treatment, scenario)
    team = worlds.team if team is None else team
    runs = limits.runs(math.ceil(10 / risk) if runs is None else runs)
    steps = limits.steps(worlds.steps if steps is None else steps)
    root = secrets.randbits(32) if rng is None else checks.count("rng", rng, least=0)
    measure = CountDegrees(team, perceived=checks.flag("perceived", perceived))
    planned = worlds.runs(root, runs, steps, measure)
    worlds.check_pool(pool)
    found = degrees_of(planned, pool, progress)
    met = set[team_conditions.Conditions]().union(*(one.met for one in found))
    largest = max(one.max_neighbours for one in found)
    size = max(*(one.largest_team for one in found), *(one.robots for one in met), largest + 1 if largest else 0)
    rows = [(run, planned[run].seed, one.max_neighbours) for run, one in enumerate(found)]
    return DeltaReport(
        maxima=pd.DataFrame(rows, columns=["run", "seed", "max_neighbours"]),
        bearings=sector_occupancy.gather(one.bearings for one in found if one.bearings is not None),
        robots=size,
        risk=risk,
        confidence=confidence,
        independent=float(runs),
        largest=largest,
        prediction=None if perceived else team_conditions.predict(met, size, steps),
        group_maxima=by_group.group_maxima((one.groups for one in found), [run.seed for run in planned]),
        source="simulation",
        subject=subject or f"{worlds.name(size)}{_of_team(team)}, {runs:,} runs of {steps:,} steps",
        awareness_range=team_conditions.awareness_range(met),
        length=float(steps),
        unit="steps",
        notes=(
            *team_conditions.notes(met, size),
            *[_PERCEIVED] * perceived,
            *_of_short_runs([one.steps for one in found], steps),
        ),
    )


def _of_team(team: str | None) -> str:
    return "" if team is None else f" of team {team}"


def _of_short_runs(made: Sequence[int], steps: int) -> tuple[str, ...]:
    """Return a note on runs that a model ended before the last step."""
    short = [number for number in made if number < steps]
    if not short:
        return ()
    return (
        f"{len(short):,} of {len(made):,} runs ended before step {steps:,}, the first after {min(short):,} steps: the "
        "stated probability is that of runs that may end so.",
    )
