"""Choose δ before any learning: simulate, count neighbours, and find the ring size for a stated risk (§4, §10)."""

from __future__ import annotations

import contextlib
import inspect
import math
import pickle
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import pandas as pd

from teamsight.analysis.delta import sector_occupancy
from teamsight.analysis.delta.degrees import Conditions, CountDegrees, degrees_of, notes, predict
from teamsight.analysis.delta.report import DeltaReport
from teamsight.analysis.runs import limits
from teamsight.analysis.runs.executor import Executor
from teamsight.analysis.runs.run import Measure, Run, task_run, task_seed
from teamsight.analysis.runs.seeds import model_seed, run_seed
from teamsight.analysis.runs.simulate import Progress
from teamsight.core import checks

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.tasks.task import Task, Treatment

#: Takes a seed, as ``rng``, as ``seed`` or as its first argument, and returns a model.
Factory = Callable[..., "World"]

# T where nothing else says it (§4).
_STEPS = 600
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
    pool: Executor | None = None,
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
    pool : Executor, optional
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
    worlds = _worlds_of(model, treatment, scenario)
    team = worlds.team if team is None else team
    runs = limits.runs(math.ceil(10 / risk) if runs is None else runs)
    steps = limits.steps(worlds.steps if steps is None else steps)
    root = secrets.randbits(32) if rng is None else checks.count("rng", rng, least=0)
    planned = worlds.runs(root, runs, steps, CountDegrees(team, perceived=checks.flag("perceived", perceived)))
    if pool is not None and pool.size > 1:
        try:
            pickle.dumps(worlds.sent)
        except Exception as error:
            raise TypeError(
                f"model={model!r}: cannot be sent to worker processes; give a function of a module, or leave out pool"
            ) from error
    found = degrees_of(planned, pool, progress)
    met = set[Conditions]().union(*(one.met for one in found))
    reaches = {one.awareness_range for one in met if one.robots}
    largest = max(one.max_neighbours for one in found)
    size = max(*(one.largest_team for one in found), *(one.robots for one in met), largest + 1 if largest else 0)
    rows = [(run, planned[run].seed, one.max_neighbours) for run, one in enumerate(found)]
    # A group that is not in all runs has no neighbours in the others.
    of_groups = [
        (run, planned[run].seed, one.group, one.team, max(one.robots, one.max_neighbours + 1), one.max_neighbours)
        for run, degrees in enumerate(found)
        for one in degrees.groups
    ]
    groups = pd.DataFrame(of_groups, columns=["run", "seed", "group", "team", "robots", "max_neighbours"])
    said = [*notes(met, size), *[_PERCEIVED] * perceived]
    if short := [one.steps for one in found if one.steps < steps]:
        said.append(
            f"{len(short):,} of {runs:,} runs ended before step {steps:,}, the first after {min(short):,} steps: the "
            "stated probability is that of runs that may end so."
        )
    of_team = "" if team is None else f" of team {team}"
    return DeltaReport(
        maxima=pd.DataFrame(rows, columns=["run", "seed", "max_neighbours"]),
        bearings=sector_occupancy.gather(one.bearings for one in found if one.bearings is not None),
        robots=size,
        risk=risk,
        confidence=confidence,
        independent=float(runs),
        largest=largest,
        prediction=None if perceived else predict(met, size, steps),
        group_maxima=groups if groups["group"].nunique() > 1 else None,
        source="simulation",
        subject=subject or f"{worlds.name(size)}{of_team}, {runs:,} runs of {steps:,} steps",
        awareness_range=reaches.pop() if len(reaches) == 1 else None,
        length=float(steps),
        unit="steps",
        notes=tuple(said),
    )


class _Worlds(NamedTuple):
    """Worlds in which neighbours are counted: the usual length of a run, and the team; both may be given otherwise.

    ``runs(root, runs, steps, measure)`` returns the runs, ``name(robots)`` says in words what is simulated, and
    ``sent`` is what goes to other processes.
    """

    runs: Callable[[int, int, int, Measure], list[Run]]
    name: Callable[[int], str]
    sent: Any = None
    steps: int = _STEPS
    team: str | None = None


def _worlds_of(
    model: Task | str | Factory | Mapping[str, Any], treatment: Treatment | None, scenario: Mapping[str, Any] | None
) -> _Worlds:
    from teamsight.tasks.named import task_of
    from teamsight.tasks.task import Task

    if isinstance(model, (Task, str)):
        return _of_task(task_of(model), treatment or "explore", dict(scenario or {}))
    for name, value in (("treatment", treatment), ("scenario", scenario)):
        if value is not None:
            raise ValueError(f"{name}={checks.shown(value)}: is for a task; give one, such as 'cmommt', or omit it")
    if isinstance(model, Mapping):
        return _of_cmommt(dict(model))
    if not callable(model):
        raise TypeError(
            f"model={model!r}: must be a task, keyword parameters of CMOMMT, or a callable from a seed to a model"
        )
    return _of_factory(model)


def _of_task(task: Task, treatment: Treatment, scenario: Mapping[str, Any]) -> _Worlds:
    """Return the worlds of a task under one treatment; the runs share what a team has learned."""

    def planned(root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        parameters = task.parameters(treatment, scenario, rng=root)
        seeds = (task_seed(task, root, run, scenario) for run in range(runs))
        return [task_run(task, parameters, seed, steps, measure) for seed in seeds]

    def name(robots: int) -> str:
        team = treatment if isinstance(treatment, str) else checks.shown(treatment)
        given = "".join(f", {key}={value}" for key, value in scenario.items())
        return f"task {task.name}, {team}{given}, {robots} robots"

    return _Worlds(planned, name, task.world, task.steps, task.team)


def _of_cmommt(settings: Mapping[str, Any]) -> _Worlds:
    """Return the worlds of `CMOMMT` with these keyword parameters."""

    def planned(root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        from teamsight.agents.cmommt import CMOMMT

        for name in settings.keys() & {"rng", "seed"}:
            raise ValueError(
                f"{name}={settings[name]!r}: each run gets a seed of its own; give rng to choose_delta instead"
            )
        with contextlib.closing(CMOMMT(**settings, rng=0)) as first:
            # Given, or by default.
            scenario = [first.settings[name] for name in ("robots", "targets", "radius")]
        return [Run(settings, model_seed(root, run, *scenario), steps, measure) for run in range(runs)]

    given = ", ".join(f"{name}={value}" for name, value in settings.items())
    return _Worlds(planned, lambda robots: f"CMOMMT({given})")


def _of_factory(factory: Factory) -> _Worlds:
    """Return the worlds that a class or function makes from a seed."""

    def planned(root: int, runs: int, steps: int, measure: Measure) -> list[Run]:
        return [Run({}, run_seed(root, run), steps, measure, FromSeed(factory)) for run in range(runs)]

    model: Any = factory
    given = ""
    if isinstance(model, partial):
        named = (f"{name}={value!r}" for name, value in model.keywords.items())
        given, model = f"({', '.join([*map(repr, model.args), *named])})", model.func
    called = f"{getattr(model, '__name__', type(model).__name__)}{given}"
    return _Worlds(planned, lambda robots: f"{called}, {robots} robots", factory)


@dataclass(frozen=True)
class FromSeed:
    """A factory as a model of a `Run`."""

    factory: Factory

    def __call__(self, *, rng: int) -> World:
        """Return the world of a seed, after checking that it is one."""
        from teamsight.agents.world import World

        world: Any = self._made(rng)
        if not isinstance(world, World):
            raise TypeError(f"model({rng}) is {checks.shown(world)}: must be a World, such as CMOMMT(rng={rng})")
        return world

    def _made(self, seed: int) -> Any:
        """Call the factory with a seed: as ``rng`` or ``seed`` if it has a parameter of that name."""
        factory = self.factory
        try:
            parameters = inspect.signature(factory).parameters
        except (TypeError, ValueError):
            return factory(seed)
        for name in ("rng", "seed"):
            if name in parameters and parameters[name].kind is not inspect.Parameter.POSITIONAL_ONLY:
                return factory(**{name: seed})
        first = next(iter(parameters.values()), None)
        if isinstance(factory, type) and first is not None and first.default is not first.empty:
            raise TypeError(
                f"model={factory.__name__}: takes no seed: it has neither rng nor seed, and "
                f"{first.name}={first.default!r} is another parameter; add rng=None to __init__ and pass it on: "
                "super().__init__(arena, rng=rng)"
            )
        return factory(seed)
