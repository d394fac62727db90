"""Arguments: what `add` passes on to the ``__init__`` of an agent class, and to the columns of a group."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from teamsight.core import checks

#: The parameters of `World.add` and `Group.add` that are not arguments of agents.
OWN_OF_WORLD = (
    "policy", "policy_options", "awareness", "team", "sensing_range", "awareness_range", "range_shape", "speed",
    "turn_limit", "placement", "position", "heading", "cycle", "name",
)  # fmt: skip
OWN_OF_GROUP = ("sensing_range", "awareness_range", "speed", "turn_limit", "placement", "position", "heading", "cycle")


class Arguments(NamedTuple):
    """The further keyword arguments of `add`.

    Attributes
    ----------
    each : list of dict
        For each agent, the arguments of its ``__init__``.
    columns : dict of str to object
        Values of columns.
    """

    each: list[dict[str, Any]]
    columns: dict[str, Any]


def check_names(made: Any, given: Mapping[str, Any]) -> None:
    """Refuse keyword arguments that the ``__init__`` of a class of worlds does not take, with the nearest that it does.

    Raises
    ------
    TypeError
        Naming the argument.
    """
    taken, _, is_open = _parameters(made.__init__, 1)
    for name in given:
        if name not in taken and not is_open:
            raise TypeError(
                f"{name}={checks.shown(given[name])}: unknown; {checks.suggestion(name, taken)}{made.__name__} takes "
                f"{', '.join(taken) or 'no arguments'}"
            )


def divided(
    agent_class: Any, size: int, given: Mapping[str, Any], own: Iterable[str], columns: Iterable[str] = ()
) -> Arguments:
    """Divide arguments among the agents: lists, tuples and arrays of length `size` by element, others as they are.

    Parameters
    ----------
    agent_class : type
        The class of the agents.
    size : int
        The number of agents.
    given : mapping of str to object
        The arguments.
    own : iterable of str
        The parameters of `add` itself.
    columns : iterable of str
        The columns of the group; an argument that ``__init__`` does not take sets one.

    Raises
    ------
    TypeError
        If neither takes an argument, if one is missing, or if a parameter of ``__init__`` is also one of `add`.
    """
    if not given and not _parameters(agent_class.__init__)[0]:
        return Arguments([{}] * size, {})
    taken, needed, is_open = _parameters(agent_class.__init__)
    name, own, columns = f"{agent_class.__name__}.__init__", tuple(own), tuple(columns)
    for parameter in taken:
        if parameter in own:
            raise TypeError(
                f"{parameter}: is a parameter of add and of {name}; rename that of {name}, or leave it out if it is "
                "meant for add, which sets it before the agents are made"
            )
    of_columns = {key: value for key, value in given.items() if key not in taken and key in columns}
    of_init = {key: value for key, value in given.items() if key not in of_columns}
    for key in of_init:
        if key not in taken and not is_open:
            known = f"{name} takes {', '.join(taken)}" if taken else f"{name} takes no arguments of its own"
            known += f", and the columns are {', '.join(columns)}" if columns else ""
            raise TypeError(
                f"{key}={checks.shown(of_init[key])}: unknown; {checks.suggestion(key, (*taken, *columns, *own))}"
                f"{known}; add itself takes {', '.join(own)}"
            )
    missing = [key for key in needed if key not in of_init]
    if missing:
        raise TypeError(f"{name} needs {', '.join(missing)}; give it to add, as in add(…, {missing[0]}=…)")
    if not of_init:
        return Arguments([{}] * size, of_columns)
    each = [{key: _part(value, row, size) for key, value in of_init.items()} for row in range(size)]
    return Arguments(each, of_columns)


@lru_cache(maxsize=64)
def _parameters(init: Callable[..., None], first: int = 2) -> tuple[tuple[str, ...], tuple[str, ...], bool]:
    """Return the names of an ``__init__``'s parameters from the first, those without a default, and whether it has **.

    That of an agent has the agent and the model before.
    """
    try:
        parameters = list(inspect.signature(init).parameters.values())[first:]
    except ValueError:
        # Some classes written in C have no signature.
        return (), (), True
    named = [one for one in parameters if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)]
    is_open = any(one.kind is one.VAR_KEYWORD for one in parameters)
    return tuple(one.name for one in named), tuple(one.name for one in named if one.default is one.empty), is_open


def _part(value: Any, row: int, size: int) -> Any:
    """Return the part of a value for one agent, divided as by mesa's ``create_agents``."""
    is_sequence = isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)
    return value[row] if is_sequence and len(value) == size else value
