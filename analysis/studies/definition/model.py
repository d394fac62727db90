"""The model of a study: a class or function, found by name, and its parameters."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from teamsight.core import checks, plugins, references

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

# Two names for the seed, which the study gives.
_SEEDS = ("rng", "seed")


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
        from teamsight.analysis.runs.run import TaskMeasure

        return TaskMeasure(task)
    return _callable("record.measure", MEASURES.get(measure, measure), tuple(MEASURES), "a function (world, steps)")


def _callable(key: str, value: str, own: tuple[str, ...], cure: str) -> Callable[..., Any]:
    """Return what a reference or a plug-in names; errors call it `key`, and teamsight's `own` is known, too."""
    if references.is_reference(value):
        found = references.load(value, key)
    else:
        found = plug_in(key, f"teamsight.{key.rpartition('.')[2]}s", value, own)
    if not callable(found):
        raise TypeError(f"{key}={checks.shown(value)}: cannot be called; give {cure}")
    return found


def plug_in(name: str, group: str, value: str, own: tuple[str, ...]) -> object:
    """Return a plug-in; the error for an unknown one also names those that are no plug-ins."""
    if not plugins.has(group, value):
        checks.choice(name, value, (*own, *plugins.names(group), "package.module:Name"))
    return plugins.find(group, value, name)


def signature_of(model: str) -> Mapping[str, inspect.Parameter] | None:
    """Return the parameters of a model by name; None if its signature cannot be read. Imports its module."""
    try:
        return inspect.signature(model_of(model)).parameters
    except ValueError as error:  # a class written in C
        if str(error).startswith("no signature"):
            return None
        raise


def integers_of(model: str) -> frozenset[str]:
    """Return the parameters that the signature of a model declares as integers. Imports its module."""
    return frozenset(name for name, one in (signature_of(model) or {}).items() if one.annotation in (int, "int"))


def check_parameters(model: str, names: Iterable[str]) -> None:
    """Refuse parameters that a model does not have, and a model to which a seed cannot be given.

    Raises
    ------
    TypeError, ValueError
        If there is such a parameter; the message suggests the nearest.
    """
    parameters = signature_of(model)
    if parameters is None or any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
        return
    known = {
        name: one
        for name, one in parameters.items()
        if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY) and name not in _SEEDS
    }
    if "rng" not in parameters:
        raise TypeError(
            f"model={checks.shown(model)}: takes no rng; add rng=None to its parameters and pass it on to the world, "
            "as in super().__init__(arena, rng=rng)"
        )
    # "policy.gain" is a setting of the component that is the parameter policy.
    given = {name.partition(".")[0] for name in names}
    for name in sorted(given - known.keys()):
        raise ValueError(
            f"{name}: is no parameter of {model}; {checks.suggestion(name, known)}its parameters are {', '.join(known)}"
        )
    for name, one in known.items():
        if one.default is one.empty and name not in given:
            raise ValueError(f"{name}: {model} needs this parameter; give it under fixed or axes")
