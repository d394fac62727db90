"""Controls from the signature of a class or function that builds a world."""

from __future__ import annotations

import enum
import inspect
from collections.abc import Callable, Mapping
from typing import Any, Literal, get_args, get_origin, get_type_hints

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.agents.cmommt import LiveSetting
from teamsight.core import checks
from teamsight.live.controls import Control
from teamsight.policies.registry import POLICIES

#: The names of the parameter that is the seed.
SEEDS = ("seed", "rng")
# Larger numbers are never what somebody at a page wants, and a model may take them literally.
_MOST_INTEGER, _MOST_NUMBER = 10**6, 10.0**9


def has_signature(model: object) -> bool:
    """Return whether something can be called, and says with what."""
    try:
        return callable(model) and inspect.signature(model) is not None
    except (TypeError, ValueError):
        return False


def seed_name(model: Callable[..., Any]) -> str | None:
    """Return the name of the parameter that is the seed; None if there is none."""
    names = inspect.signature(model).parameters
    return next((name for name in SEEDS if name in names), None)


def check_parameters(model: Callable[..., Any], parameters: Mapping[str, Any]) -> None:
    """Refuse parameters that a model does not have, and missing ones.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter.
    """
    found = inspect.signature(model).parameters.values()
    names = [one.name for one in found if one.kind in (one.POSITIONAL_OR_KEYWORD, one.KEYWORD_ONLY)]
    if not any(one.kind is one.VAR_KEYWORD for one in found):
        for name in parameters:
            checks.choice("parameter", name, names)
    for one in found:
        is_missing = one.default is one.empty and one.name in names and one.name not in (*parameters, *SEEDS)
        if is_missing or (one.kind is one.POSITIONAL_ONLY and one.default is one.empty):
            raise TypeError(
                f"{model_name(model)}: needs a value for its parameter {one.name!r}; give it, as in "
                f"--set {one.name}=… or parameters={{{one.name!r}: …}}"
            )


def model_name(model: Callable[..., Any]) -> str:
    """Return the name of a class or function, for titles and errors."""
    return str(getattr(model, "__name__", type(model).__name__))


def controls_of(model: Callable[..., Any], parameters: Mapping[str, Any], section: str = "") -> list[Control]:
    """Return a control for each parameter that a page can set: numbers, truth values, and choices.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    parameters : mapping of str to object
        The values that are given.
    section : str
        The heading of the controls; by default the name of the model.

    Notes
    -----
    Choices are values of a ``Literal`` or an ``Enum``, and names of policies and degrees of awareness as the default of
    parameters that are called so. Other texts are no controls, since they may name files or code.
    """
    try:
        hints = get_type_hints(vars(model).get("__init__", model) if isinstance(model, type) else model)
    except Exception:  # whatever names the annotations of a user use
        hints = {}
    found = []
    for name, one in inspect.signature(model).parameters.items():
        if name in SEEDS or one.kind in (one.VAR_KEYWORD, one.VAR_POSITIONAL, one.POSITIONAL_ONLY):
            continue
        default = getattr(one.default, "value", one.default) if not isinstance(one.default, enum.Enum) else one.default
        value = parameters.get(name, default)
        hint = hints.get(name, one.annotation)
        control = _control(name, value, hint, section or model_name(model), _is_live(model, name))
        if control is not None:
            found.append(control)
    return found


def value_of(model: Callable[..., Any], name: str) -> Any:
    """Return the default of a parameter."""
    default = inspect.signature(model).parameters[name].default
    # Defaults of CMOMMT are wrapped, so that a preset can tell them apart.
    return default if isinstance(default, enum.Enum) else getattr(default, "value", default)


def _control(name: str, value: Any, hint: Any, section: str, live: bool) -> Control | None:
    if get_origin(hint) is Literal:
        return _choice(name, {str(one): one for one in get_args(hint)}, value, section, live)
    if isinstance(value, enum.Enum):
        return _choice(name, {one.name: one for one in type(value)}, value, section, live)
    if isinstance(value, bool):
        return Control(name, "flag", section=section, live=live)
    if isinstance(value, int):
        largest = max(_MOST_INTEGER, abs(value))
        return Control(name, "integer", section=section, least=0 if value >= 0 else -largest, most=largest, live=live)
    if isinstance(value, float):
        most = max(_MOST_NUMBER, abs(value))
        return Control(name, "number", section=section, least=-most, most=most, live=live)
    for ending, names in (("policy", POLICIES), ("awareness", AWARENESS)):
        if (name == ending or name.endswith(f"_{ending}")) and isinstance(value, str) and value in names:
            return _choice(name, {one: one for one in names}, value, section, live)
    return None


def _choice(name: str, choices: Mapping[str, Any], value: Any, section: str, live: bool) -> Control:
    return Control(name, "choice", section=section, choices=with_given(choices, value), live=live)


def with_given(choices: Mapping[str, Any], value: Any) -> dict[str, Any]:
    """Return choices to which the value that was given from Python is added, if it is none of them."""
    if any(one is value or one == value for one in choices.values()):
        return dict(choices)
    return {**choices, f"{getattr(value, 'name', '') or type(value).__name__} (given)": value}


def _is_live(model: Any, name: str) -> bool:
    return isinstance(model, type) and isinstance(inspect.getattr_static(model, name, None), LiveSetting)
