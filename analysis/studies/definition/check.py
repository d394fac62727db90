"""The check of a study before its first run: all that it names is imported, and worlds are built."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Any

from teamsight.analysis.runs.run import Run
from teamsight.analysis.studies.definition.components import Components
from teamsight.analysis.studies.definition.model import (
    CMOMMT_NAME,
    check_parameters,
    measure_of,
    model_of,
    signature_of,
)
from teamsight.analysis.studies.definition.recording import check_measured
from teamsight.analysis.studies.definition.values import text_of
from teamsight.analysis.studies.shard import declared_columns, failure_of
from teamsight.core import checks, references
from teamsight.tasks.model import TREATMENT, TaskModel

if TYPE_CHECKING:
    from teamsight.analysis.studies.definition.recording import Until
    from teamsight.analysis.studies.plan import Plan

# Settings of which a world is built: enough for each value of all usual studies.
_MOST_BUILT = 100
# Robots and targets of such a world, at most.
_MOST_AGENTS = 2


def check_plan(plan: Plan, model: str, measure: str, steps: int, until: Until | None = None) -> None:
    """Import the model, the measure and all components of a plan; of `CMOMMT`, build worlds with each kind of value.

    What `until` names is looked for among the columns of the measure, if its annotation names them.

    Raises
    ------
    TypeError, ValueError
        If one does not load, the model does not have a parameter, or `CMOMMT` refuses a value.
    """
    check_parameters(model, plan.names)
    columns = declared_columns(measure_of(measure, model))
    if until is not None and columns is not None:
        check_measured(until, columns)
    components = Components()
    for name in plan.names:
        for value in plan.values(name):
            if isinstance(value, (str, list, dict)):
                with _one_line(name):
                    components.made(name, value)
    if any(one.kind is one.VAR_KEYWORD for one in (signature_of(model) or {}).values()):
        _pass_on(plan, model, components)
    if model == CMOMMT_NAME:
        for k in _typical(plan):
            _build(plan, k, steps)


def _pass_on(plan: Plan, model: str, components: Components) -> None:
    """Refuse a parameter that a model which takes any one passes on to what does not have it; build one world."""
    try:
        given = components.resolved(plan.parameters(0))
        made = model_of(model)
        # A team with skill may have to learn, which takes long.
        team = {TREATMENT: "explore"} if isinstance(made, TaskModel) and made.task.explore is not None else {}
        made(**{**given, **team}, rng=0)
    except TypeError as error:
        # As Python says it, or a class of worlds.
        found = re.search(r"unexpected keyword argument '(\w+)'|^(\w+)=.*: unknown;", str(error))
        if found and (name := found[1] or found[2]) in plan.names:
            raise ValueError(
                f"{name}: is no parameter of {model} ({error}); correct the name, or leave it out"
            ) from error
    except BaseException as error:
        failure_of(error)  # raises an interrupt of this process again; others are left to the runs


def _typical(plan: Plan) -> list[int]:
    """Return settings in which each value occurs that is no number, and the smallest and the largest numbers."""
    found = {0: None}
    for name in plan.swept:
        values = plan.values(name)
        rows: dict[object, int] = {}
        for row, value in enumerate(values):
            if type(value) not in (int, float):
                rows.setdefault(text_of(value), row)
        numbers = [value for value in values if isinstance(value, (int, float)) and not isinstance(value, bool)]
        if numbers:
            rows |= {end: values.index(end) for end in (min(numbers), max(numbers))}
        found |= dict.fromkeys(row * plan.stride(name) for row in list(rows.values())[:_MOST_BUILT])
    return list(found)[:_MOST_BUILT]


def _build(plan: Plan, k: int, steps: int) -> None:
    from teamsight.agents.cmommt import CMOMMT
    from teamsight.agents.settings import MOST_AGENTS

    with _one_line("model"):
        given: dict[str, Any] = plan.components(k)
    if "events" not in given:  # which may need all agents
        for name in ("robots", "targets"):
            value = given.get(name, _MOST_AGENTS)
            # More than there may be is left for the model to refuse.
            is_allowed = type(value) is int and value <= MOST_AGENTS
            given[name] = min(value, _MOST_AGENTS) if is_allowed else value
    try:
        # A world of two robots may warn of what is true of it alone.
        with _one_line("model"), warnings.catch_warnings(action="ignore"), closing(CMOMMT(**given, rng=0)):
            Run(given, 0, steps).check()
    except (TypeError, ValueError) as error:
        setting = ", ".join(f"{name}={checks.shown(plan.parameters(k)[name])}" for name in plan.swept[:4])
        kind = TypeError if isinstance(error, TypeError) else ValueError
        raise kind(f"{error} (in the setting {setting})" if setting else str(error)) from error


@contextmanager
def _one_line(name: str) -> Iterator[None]:
    """Turn other errors, which a user's component may raise, into one that names the place."""
    try:
        yield
    except (TypeError, ValueError):
        raise
    except (Exception, SystemExit) as error:
        raise ValueError(f"{name}: {references.failure(error)}; correct the component") from error
