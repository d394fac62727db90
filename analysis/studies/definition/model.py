"""What a study runs and records: the model and the measure, found by name, and until when replicates are added."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from teamsight.analysis.runs.run import TaskMeasure, check_takes_rng
from teamsight.analysis.studies.definition.values import frozen
from teamsight.core import checks, plugins, references
from teamsight.core.component import Allowed, Component, Flag, Positive

if TYPE_CHECKING:
    from teamsight.agents.world import World
    from teamsight.tasks.task import Task

#: The name of `CMOMMT` in a study.
CMOMMT_NAME = "cmommt"
#: What stands before the name of a task: "task:cmommt".
TASK_PREFIX = "task:"
#: The measures of teamsight by name, as references; "summary" is that of `run_many`.
MEASURES = {
    "summary": "teamsight.analysis.runs.run_many:summary",
    "evenness": "teamsight.analysis.runs.run_many:evenness",
}


def _measure(name: str, given: Any) -> str:
    measure = given if isinstance(given, str) else frozen(name, given)
    if not isinstance(measure, str) or not measure:
        shown = checks.shown(measure)
        raise TypeError(f"{name}={shown}: must be a text, such as 'summary' or 'package.module:function'")
    return str(measure)


@dataclass(frozen=True)
class Record(Component):
    """What is recorded of each run.

    Parameters
    ----------
    measure : str
        What is measured of a whole run: "summary", "evenness", a plug-in, or the function "package.module:name", which
        is called as ``measure(world, steps)`` and returns a NamedTuple or a mapping.
    steps : bool
        Whether one row for each step is recorded.
    trajectories : int
        Record positions at every so many steps; 0 for never.
    events : bool
        Whether the log of events is recorded.
    """

    measure: Annotated[str, Allowed(check=_measure)] = "summary"
    steps: Flag = False
    trajectories: Annotated[int, Allowed(least=0, cure="0 records none")] = 0
    events: Flag = False


@dataclass(frozen=True)
class Until(Component):
    """Until when replicates are added to a setting.

    Parameters
    ----------
    interval : float
        The largest width of the 95 % interval of the mean, from its low to its high end, in the unit of the measure.
    measure : str
        The column of results whose mean it is.
    limit : int
        The most replicates of a setting.

    Notes
    -----
    The interval is Student's; for True and False it is Wilson's. A setting has at least 38 replicates, or the limit;
    see `teamsight.analysis.studies.standing` for what the intervals are worth.
    """

    interval: Positive
    measure: Annotated[str, Allowed(check=_measure)] = "observed_fraction"
    limit: Annotated[int, Allowed(least=2)] = 1000


def check_measured(until: Until, kinds: Mapping[str, str | None]) -> None:
    """Check that what decides how many replicates there are is a number.

    Parameters
    ----------
    until : Until
        Its measure is looked for.
    kinds : mapping of str to str or None
        What each measured column holds: "text" or another; None where it is not known.

    Raises
    ------
    ValueError
        If it is not measured, or a text.
    """
    shown = f"until.measure={checks.shown(until.measure)}"
    if until.measure not in kinds:
        hint = checks.suggestion(until.measure, kinds)
        raise ValueError(f"{shown}: is not measured; {hint}give one of {', '.join(kinds)}")
    if kinds[until.measure] == "text":
        raise ValueError(f"{shown}: holds texts; give a measure that is a number")


def model_of(model: str) -> Callable[..., World]:
    """Return the class or function of a model; its module is imported.

    Parameters
    ----------
    model : str
        "cmommt", "task:NAME", "package.module:Name" of a model or a `Task`, or the name of a plug-in.

    Raises
    ------
    TypeError, ValueError
        If there is none of this name, or it cannot be called.
    """
    if model == CMOMMT_NAME:
        from teamsight.agents.cmommt import CMOMMT

        return CMOMMT
    if (task := task_named(in_full(model))) is not None:
        from teamsight.tasks.model import TaskModel

        return TaskModel(task)
    from teamsight.tasks.registry import TASKS

    tasks = (f"{TASK_PREFIX}{name}" for name in TASKS)
    return _callable("model", model, (CMOMMT_NAME, *tasks), "a class, a function with rng, or a teamsight.Task")


def task_named(model: str) -> Task | None:
    """Return the task that is the model of a study; None if it is no task.

    Raises
    ------
    TypeError, ValueError
        If there is no task of this name.
    """
    if not model.startswith(TASK_PREFIX):
        return None
    from teamsight.tasks.named import task_of

    return task_of(model.removeprefix(TASK_PREFIX))


def in_full(model: str) -> str:
    """Return the name of a model by which a task is known without an import: "task:" and what refers to a `Task`.

    The module of a reference is imported.

    Raises
    ------
    ValueError
        If a reference does not load.
    """
    from teamsight.tasks.task import Task

    if model.startswith(TASK_PREFIX) or not references.is_reference(model):
        return model
    return f"{TASK_PREFIX}{model}" if isinstance(references.load(model, "model"), Task) else model


def measure_of(measure: str, model: str = CMOMMT_NAME) -> Callable[[World, int], Any]:
    """Return the function that measures a run; its module is imported.

    Parameters
    ----------
    measure : str
        "summary", "evenness", "package.module:name" or the name of a plug-in. The summary of a task has its metrics.
    model : str
        The model.

    Raises
    ------
    TypeError, ValueError
        If there is none of this name, or it cannot be called.
    """
    if measure == "summary" and (task := task_named(in_full(model))) is not None:
        return TaskMeasure(task)
    return _callable("record.measure", MEASURES.get(measure, measure), tuple(MEASURES), "a function (world, steps)")


def _callable(key: str, value: str, own: tuple[str, ...], cure: str) -> Callable[..., Any]:
    """Return what a reference or a plug-in names; errors call it `key`, and teamsight's `own` is known, too."""
    group = f"teamsight.{key.rpartition('.')[2]}s"
    if references.is_reference(value):
        found = references.load(value, key)
    else:
        if not plugins.has(group, value):
            checks.choice(key, value, (*own, *plugins.names(group), "package.module:Name"))
        found = plugins.find(group, value, key)
    if not callable(found):
        raise TypeError(f"{key}={checks.shown(value)}: cannot be called; give {cure}")
    return found


def parameters_of(model: str) -> Mapping[str, inspect.Parameter] | None:
    """Return the parameters of a model by name; None if its signature cannot be read. Imports its module."""
    try:
        return inspect.signature(model_of(model)).parameters
    except ValueError as error:  # a class written in C
        if str(error).startswith("no signature"):
            return None
        raise


def integers_of(model: str) -> frozenset[str]:
    """Return the parameters that the signature of a model declares as integers. Imports its module."""
    return frozenset(name for name, one in (parameters_of(model) or {}).items() if one.annotation in (int, "int"))


def takes_any(model: str) -> bool:
    """Whether a model takes any parameter, by ``**kwargs``."""
    return any(one.kind is one.VAR_KEYWORD for one in (parameters_of(model) or {}).values())


def check_parameters(model: str, names: Iterable[str]) -> None:
    """Refuse parameters that a model does not have, and a model to which a seed cannot be given.

    Raises
    ------
    TypeError, ValueError
        If there is such a parameter; the message suggests the nearest.
    """
    parameters = parameters_of(model)
    if parameters is None or takes_any(model):
        return
    check_takes_rng(model, parameters)
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    # Two names for the seed, which the study gives.
    known = {name: one for name, one in parameters.items() if one.kind in kinds and name not in ("rng", "seed")}
    # "policy.gain" is a setting of the component that is the parameter policy.
    given = {name.partition(".")[0] for name in names}
    for name in sorted(given - known.keys()):
        raise ValueError(
            f"{name}: is no parameter of {model}; {checks.suggestion(name, known)}its parameters are {', '.join(known)}"
        )
    for name, one in known.items():
        if one.default is one.empty and name not in given:
            raise ValueError(f"{name}: {model} needs this parameter; give it under fixed or axes")
