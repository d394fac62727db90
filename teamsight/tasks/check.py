"""`check_task`: tests whether a task keeps its contract."""

from __future__ import annotations

import contextlib
import inspect
import warnings
from collections.abc import Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any, get_args

from teamsight.core import checks
from teamsight.core.references import failure
from teamsight.tasks.named import task_of
from teamsight.tasks.task import TREATMENTS, Better, Objective, Task, Treatment

if TYPE_CHECKING:
    from teamsight.agents.world import World

# Enough steps for errors in perception, decisions and movement to show.
_STEPS = 20
# Without a difference between the teams, one is worse in all of these runs with a probability of 1 / 256.
_COMPARED = 8


def check_task(task: Task | str, *, steps: int = _STEPS, rng: int = 0) -> None:
    """Run worlds of a task and raise an error if it breaks the contract.

    Each of its teams is run twice under one seed, and all metrics are measured. A team that has to learn does so, which
    may take its time. At last both teams make whole runs under the same seeds, until the one with skill is not the
    worse one.

    Parameters
    ----------
    task : Task or str
        A task, or the name of one.
    steps : int
        Steps of each run.
    rng : int
        The seed of the runs.

    Raises
    ------
    TypeError, ValueError
        If a declaration is wrong or missing; a world does not take the parameters; the team has another size than the
        scenario says; a metric raises, or returns no number; or two runs under one seed differ.

    Warns
    -----
    UserWarning
        If the team with skill is worse than the one that explores in all of 8 whole runs. Then the gathering index, and
        whatever else compares the teams, says nothing of skill.
    """
    task = task_of(task)
    _check_declarations(task)
    _check_takes(task)
    for treatment in TREATMENTS:
        if treatment == "skilled" and task.skilled is None:
            continue
        found = [_tried(task, treatment, steps, rng) for _ in range(2)]
        for name, value in found[0].items():
            if value != found[1][name]:
                raise ValueError(
                    f"{treatment} team of {task.name}: {name} is {value} in one run and {found[1][name]} in another of "
                    "the same seed; let all noise come from rng"
                )
    if task.skilled is not None:
        _compare(task, rng)


def _compare(task: Task, rng: int) -> None:
    """Warn if the team with skill is worse than the one that explores under each of some seeds."""
    teams = [task.parameters(treatment, rng=rng) for treatment in TREATMENTS]
    for seed in range(rng, rng + _COMPARED):
        explored, skilled = (_objective(task, team, seed) for team in teams)
        if task.objective.sign * (skilled - explored) >= 0:
            return
    objective = task.objective
    warnings.warn(
        f"skilled: the team of {task.name} is worse than the one that explores in {_COMPARED} of {_COMPARED} runs of "
        f"{task.steps} steps: {objective.metric} is {skilled:.3g} against {explored:.3g} in the last, and "
        f"{objective.better} is better; give it a better team, more steps, or the other direction to objective",
        stacklevel=3,
    )


def _objective(task: Task, team: Mapping[str, Any], seed: int) -> float:
    """Return the objective of a team after a whole run, that of a censored run as it is counted."""
    with contextlib.closing(task.world(**team, rng=seed)) as world:
        world.run(task.steps, progress=False)
        return task.objective.counted(_metric(task, task.objective.metric, world), task.steps)


def _check_declarations(task: Task) -> None:
    """Check all fields but the world's signature."""
    for field in ("name", "title"):
        if not getattr(task, field):
            raise TypeError(f"{field}='': must be a text")
    if task.explore is None:
        raise ValueError(
            f"explore: the task {task.name} has no exploration treatment, from which δ is chosen; give the parameters "
            "of a world whose robots act at random, as in Task(…, explore={'policy': 'random-walk'})"
        )
    for name, value in task.scenario.items():
        if value is not None and not isinstance(value, (str, bool, Real)):
            raise TypeError(
                f"scenario: {name}={checks.shown(value)}: must be a number, a text, True or False; put objects, such "
                "as policies, into explore and skilled"
            )
    if task.size not in task.scenario:
        raise ValueError(
            f"size={task.size!r}: is no parameter of the scenario; {checks.suggestion(task.size, task.scenario)}they "
            f"are {', '.join(task.scenario)}"
        )
    checks.count(task.size, task.scenario[task.size])
    if not isinstance(task.objective, Objective):
        raise TypeError(
            f"objective={checks.shown(task.objective)}: must be the name of a metric and 'more' or 'less', as in "
            "Objective('observed_fraction', 'more')"
        )
    checks.choice("objective", task.objective.metric, task.metrics)
    checks.choice("better", task.objective.better, get_args(Better))
    for name, metric in task.metrics.items():
        if not callable(metric):
            raise TypeError(f"metrics: {name}={checks.shown(metric)}: must be a function (world) -> float")


def _check_takes(task: Task) -> None:
    """Check that the world takes the scenario, the parameters of the teams, and a seed."""
    try:
        parameters = inspect.signature(task.world).parameters
    except (TypeError, ValueError):
        return
    if any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
        return
    world = checks.shown(task.world)
    for where in ("scenario", *TREATMENTS):
        given = getattr(task, where)
        for name in given if isinstance(given, Mapping) else ():
            if name not in parameters:
                hint = checks.suggestion(name, parameters)
                raise ValueError(
                    f"{where}: {name!r} is no parameter of {world}; {hint}they are {', '.join(parameters)}"
                )
    if "rng" not in parameters:
        raise TypeError(
            f"world={world}: takes no rng; add rng=None to its parameters and pass it on, as in "
            "super().__init__(arena, rng=rng)"
        )


def _tried(task: Task, treatment: Treatment, steps: int, rng: int) -> dict[str, float]:
    """Run a team and return its metrics."""
    from teamsight.agents.world import World

    made: Any = task.build(treatment, rng=rng)
    if not isinstance(made, World):
        raise TypeError(f"world of {task.name} is {checks.shown(made)}: must be a World, such as CMOMMT")
    with contextlib.closing(made) as world:
        _check_team(task, world)
        world.run(steps)
        return {name: _metric(task, name, world) for name in task.metrics}


def _check_team(task: Task, world: World) -> None:
    """Check that the team is there, and has the size that the scenario says."""
    from teamsight.agents.teammates import of_team, team_names

    names = team_names(world.groups)
    if task.team is not None:
        checks.choice("team", task.team, names)
    sizes = {name: sum(len(group) for group in of_team(world.groups, name)) for name in names}
    found = sizes[task.team] if task.team is not None else max(sizes.values(), default=0)
    if found != task.scenario[task.size]:
        which = "the largest team" if task.team is None else f"team {task.team!r}"
        raise ValueError(
            f"size={task.size!r}: the scenario has {task.size}={task.scenario[task.size]}, but {which} has {found} "
            "agents; name the parameter that is their number"
        )


def _metric(task: Task, name: str, world: World) -> float:
    """Return one metric; an error of its own is named."""
    try:
        found = task.metrics[name](world)
    except Exception as error:
        raise ValueError(
            f"the metric {name!r} of {task.name} raised {failure(error)}; it must return a number of every world that "
            "has made its steps"
        ) from error
    return task.objective.checked(name, found)
