"""The checks of a study: of its fields, of what it names before its first run, and against one that it continues."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from teamsight.analysis.runs.run import Run
from teamsight.analysis.studies.definition.model import (
    CMOMMT_NAME,
    Record,
    Until,
    check_measured,
    check_parameters,
    measure_of,
    model_of,
    takes_any,
)
from teamsight.analysis.studies.definition.settings import (
    axis_values,
    blocks_of,
    check_blocks,
    check_names,
    columns_of,
    large,
    sample_of,
    table_of,
)
from teamsight.analysis.studies.definition.values import MOST_LEVELS, Components, Table, frozen, text_of
from teamsight.analysis.studies.shard import declared_columns, failure_of
from teamsight.core import checks, references
from teamsight.core.component import Component, declared
from teamsight.core.files import check_name
from teamsight.tasks.model import TREATMENT, TaskModel
from teamsight.tasks.task import TREATMENTS

if TYPE_CHECKING:
    from teamsight.analysis.studies.plan import Plan
    from teamsight.analysis.studies.study import Study

C = TypeVar("C", bound=Component)

#: Runs of a study, with all replicates that `until` allows.
MOST_RUNS = 100_000_000

# References of the model that has a name.
_CMOMMT = ("teamsight:CMOMMT", "teamsight.agents:CMOMMT", "teamsight.agents.cmommt:CMOMMT")
# Arguments of a model and columns of the table that are not parameters, and what is meant instead.
_PLACES = {
    **dict.fromkeys(("rng", "seed"), "the key seed, from which the seeds of all runs derive"),
    "steps": "the key steps of the study",
    "replicate": "the key replicates of the study",
    **dict.fromkeys(("setting", "run", "error", "traceback"), "the parameter another name"),
}
# Settings of which a world is built: enough for each value of all usual studies; and robots and targets of such a
# world, at most.
_MOST_BUILT, _MOST_AGENTS = 100, 2
# Values of a parameter that a line of a difference names.
_MOST_SHOWN = 5


def resolved(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a study in the form in which it keeps them.

    Raises
    ------
    TypeError, ValueError
        If one is wrong.
    """
    made: dict[str, Any] = {
        name: None if given[name] is None and name in _OPTIONAL else check(name, given[name])
        for name, check in _FIELDS.items()
    }
    for where in ("fixed", "axes", "points", "sample"):
        for name in made[where] or ():
            if name in _PLACES:
                raise ValueError(f"{where}: {name!r} cannot be a parameter; give {_PLACES[name]}")
            parts = name.split(".")
            if len(parts) > MOST_LEVELS or not all(map(str.isidentifier, parts)):
                raise ValueError(f"{where}: {checks.shown(name)} is no name of a parameter; give one such as robots")
    blocks = blocks_of(made["axes"], made["zip"], made["points"], made["sample"])
    settings = check_blocks(blocks, made["fixed"])
    where, replicates, until = "replicates", given["replicates"], made["until"]
    if until is not None:
        if until.limit < replicates:
            raise ValueError(f"until.limit={until.limit}: must be at least replicates={replicates}; raise it")
        where, replicates = "until.limit", until.limit
    if settings * replicates > MOST_RUNS:
        raise ValueError(
            f"{where}={replicates}: {settings:,} settings make {large(settings * replicates)} runs, at most "
            f"{MOST_RUNS:,}; give fewer replicates or settings"
        )
    return made


def _model(name: str, given: object) -> str:
    text = frozen(name, given)
    if not isinstance(text, str) or not text:
        raise TypeError(f"model={checks.shown(given)}: must be 'cmommt', a plug-in or 'package.module:Name'")
    return CMOMMT_NAME if text in _CMOMMT else text


def _parameters(value: Callable[[str, Any], Any]) -> Callable[[str, object], Table]:
    """Return the check of a table of parameters, whose values `value` checks."""

    def checked(where: str, given: object) -> Table:
        if not isinstance(given, Mapping):
            raise TypeError(f"{where}={checks.shown(given)}: must be a table of parameters, as {{robots = …}}")
        check_names(where, given)
        return Table({name: value(name, one) for name, one in given.items()})

    return checked


def _groups(name: str, given: Any) -> tuple[tuple[str, ...], ...]:
    def is_list(value: object) -> bool:
        return isinstance(value, Sequence) and not isinstance(value, str)

    if not is_list(given) or not all(is_list(group) and len(group) > 1 for group in given):
        raise TypeError(
            f"{name}={checks.shown(given)}: must be a list of groups of axes, such as [['robots', 'targets']]"
        )
    return tuple(tuple(frozen(name, group)) for group in given)


def _component(kind: type[C]) -> Callable[[str, Any], C]:
    """Return the check of a table that makes a component; errors name the place."""

    def made(where: str, given: Any) -> C:
        return given if isinstance(given, kind) else kind(**table_of(where, given, declared(kind)))

    return made


def _name(name: str, given: object) -> str:
    if not isinstance(given, str):
        raise TypeError(f"{name}={checks.shown(given)}: must be a text")
    return str(frozen(name, given))


def _folder(name: str, given: object) -> str:
    if not isinstance(given, (str, os.PathLike)):
        raise TypeError(f"{name}={checks.shown(given)}: must be the folder of the study file, or None")
    check_name(given)
    return os.path.abspath(given)


# The check of each field of a study that its annotation does not say; and fields that may be None.
_FIELDS: Mapping[str, Callable[[str, Any], Any]] = {
    "model": _model,
    "fixed": _parameters(lambda name, value: frozen(f"fixed.{name}", value)),
    "axes": _parameters(axis_values),
    "zip": _groups,
    "points": columns_of,
    "sample": lambda _, given: sample_of(given),
    "record": _component(Record),
    "name": _name,
    "path": _folder,
    "until": _component(Until),
}
_OPTIONAL = frozenset({"points", "sample", "name", "path", "until"})


def check_plan(plan: Plan, model: str, measure: str, steps: int, until: Until | None = None) -> None:
    """Import the model, the measure and all components of a plan; of `CMOMMT`, build worlds with each kind of value.

    What `until` names is looked for among the columns of the measure, if its annotation names them.

    Raises
    ------
    TypeError, ValueError
        If one does not load, the model does not have a parameter, or `CMOMMT` refuses a value.
    """
    check_parameters(model, plan.names)
    if TREATMENT in plan.names and isinstance(model_of(model), TaskModel):
        for value in plan.values(TREATMENT):
            if isinstance(value, str):
                checks.choice(TREATMENT, value, TREATMENTS)
    columns = declared_columns(measure_of(measure, model))
    if until is not None and columns is not None:
        check_measured(until, columns)
    components = Components()
    # What the study names settings of, is made with them.
    whole = {name.partition(".")[0] for name in plan.names if "." in name}
    for name in plan.names:
        for value in plan.values(name) if name.partition(".")[0] not in whole else ():
            if isinstance(value, (str, list, dict)):
                with _one_line(name):
                    components.made(name, value)
    for k in _typical(plan) if whole else ():
        with _one_line(", ".join(sorted(whole))):
            components.resolved(plan.parameters(k))
    if takes_any(model):
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
        numbers = [value for value in values if type(value) in (int, float)]
        if numbers:
            rows |= {end: values.index(end) for end in (min(numbers), max(numbers))}  # type: ignore[type-var]
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
            if name == "robots" and not _fits_few(given.get("awareness")):
                continue
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


def _fits_few(awareness: Any) -> bool:
    """Whether a degree of awareness has options that fit a team as small as that of the check."""
    from teamsight.agents.awareness import Awareness

    try:
        if isinstance(awareness, Awareness):
            awareness.check_team(_MOST_AGENTS, _MOST_AGENTS)
    except ValueError:
        return False
    return True


@contextmanager
def _one_line(name: str) -> Iterator[None]:
    """Turn other errors, which a user's component may raise, into one that names the place."""
    try:
        yield
    except (TypeError, ValueError):
        raise
    except (Exception, SystemExit) as error:
        raise ValueError(f"{name}: {references.failure(error)}; correct the component") from error


def difference(old: Study, new: Study) -> list[str]:
    """Return a line for each difference of two studies; none if `new` is equal, or only adds settings or replicates.

    A study may grow: more replicates, more values, and a fixed parameter that becomes an axis with its value among
    others. Until when replicates are added may change freely, since it decides only how many there are. With anything
    else, the results are those of another study. The name and the folder of the study file do not matter.

    Parameters
    ----------
    old : Study
        The study of the folder.
    new : Study
        The study that shall continue it.

    Returns
    -------
    list of str
        Lines such as ``steps: 600 in the folder, 800 now``.
    """
    if old == new:
        return []
    pairs = [(name, getattr(old, name), getattr(new, name)) for name in ("model", "steps", "seed", "pairing")]
    pairs += [(f"record.{name}", getattr(old.record, name), getattr(new.record, name)) for name in declared(Record)]
    lines = [_line(*pair) for pair in pairs if pair[1] != pair[2]]
    if new.replicates < old.replicates:
        lines.append(f"{_line('replicates', old.replicates, new.replicates)}, which is fewer")
    before, now = old.plan(), new.plan()
    settings: list[str] = []
    for name in dict.fromkeys((*before.names, *now.names)):
        mine, its = (plan.values(name) if name in plan.names else None for plan in (before, now))
        if mine is None or its is None:
            settings.append(f"{name}: {_shown(mine)} in the folder, {_shown(its)} now")
        else:
            settings.extend(_changed_values(name, mine, its))
    gone = int((now.index_of(before.ids) < 0).sum())
    if gone and not settings:
        settings.append(f"settings: {gone:,} of {before.settings:,} in the folder are not planned now")
    return lines + settings


def _line(name: str, old: object, new: object) -> str:
    return f"{name}: {checks.shown(old)} in the folder, {checks.shown(new)} now"


def _changed_values(name: str, old: list[object], new: list[object]) -> Iterator[str]:
    """Yield lines about values of a parameter that are gone, or of another type than before."""
    planned = set(map(text_of, new))
    words = []
    for values in (old, new):
        kinds = set(map(type, values))
        words.append("numbers" if kinds <= {int, float} else "booleans" if kinds == {bool} else "texts")
    if gone := [value for value in old if text_of(value) not in planned]:
        yield f"{name}: {_shown(gone)} in the folder, not among {_shown(new)} now"
    elif words[0] != words[1]:
        yield f"{name}: {words[0]} in the folder, {words[1]} now; a column has one type"


def _shown(values: list[object] | None) -> str:
    if values is None:
        return "not given"
    shown = [checks.shown(value) for value in values[:_MOST_SHOWN]]
    return ", ".join(shown) + (f" and {len(values) - _MOST_SHOWN} more" if len(values) > _MOST_SHOWN else "")
