"""Controls: what a page can set of a model, each with its check. Nothing else can be set from a page.

They follow from what the model declares; see `teamsight.core.component`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, replace
from typing import Any

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.agents.decisions import Cycle
from teamsight.core import checks
from teamsight.core.component import Component, Declared, Panel, declared
from teamsight.policies.registry import POLICIES

#: The names of the parameter that is the seed.
SEEDS = ("seed", "rng")
# Larger numbers are never what somebody at a page wants, and a model may take them literally.
_MOST_INTEGER, _MOST_NUMBER = 10**6, 10.0**9
_NO_PANEL = Panel()
# Over a wider range a slider is too coarse.
_WIDEST = 1000
# The largest whole number that is an option without a limit of its own: tables of each robot may have as many rows.
_MOST_OPTION = 1000
#: What ends the name of a choice that stands for an object which was given from Python.
GIVEN = " (given)"


@dataclass(frozen=True)
class Control:
    """One parameter of a model that a page can set.

    Attributes
    ----------
    declared : Declared
        What the model declares.
    kind : {"choice", "integer", "number", "flag", "digits"}
        What it is; digits are a whole number as a text, since scripts hold only those below 2⁵³ exactly.
    section : str
        The heading under which it stands.
    least, most : float, optional
        The limits of numbers on a page.
    choices : mapping of str to object
        The values of a choice by what the page shows; a page can only name them.
    live : bool
        Whether a new value acts on the running world; otherwise the world starts again.
    """

    declared: Declared
    kind: str
    section: str = ""
    least: float | None = None
    most: float | None = None
    choices: Mapping[str, Any] = field(default_factory=dict)
    live: bool = False

    @property
    def name(self) -> str:
        """The name of the parameter."""
        return self.declared.name

    @property
    def label(self) -> str:
        """What stands beside it."""
        return self.declared.allowed.label or self.name.rpartition(".")[2].replace("_", " ")

    def checked(self, value: Any) -> Any:
        """Return the value of the parameter for what a page has sent.

        Raises
        ------
        TypeError, ValueError
            As in Python; and if it is of another kind, outside the limits of pages, or none of the choices.
        """
        if self.kind == "flag":
            return checks.flag(self.name, value)
        if self.kind == "choice":
            return self.choices[checks.choice(self.name, value, tuple(self.choices))]
        if self.kind == "digits" and isinstance(value, str) and value.isdecimal():
            value = int(value)
        if self.kind in ("integer", "digits"):
            least = 0 if self.least is None else int(self.least)
            most = None if self.most is None else int(self.most)
            value = checks.count(self.name, value, least=least, most=most)
        else:
            value = checks.number(self.name, value, least=self.least, most=self.most)
        return self.declared.checked(value) if self.declared.is_checked else value

    def shown(self, value: Any) -> Any:
        """Return what the page shows for a value of the parameter."""
        if self.kind == "digits":
            return str(value)
        if self.kind != "choice":
            # Of a cycle, its period.
            return getattr(value, "period", value)
        for text, one in self.choices.items():
            # A component may have other settings.
            is_like = isinstance(one, Component) or (isinstance(one, (str, int, float, bool)) and one == value)
            if one is value or (type(one) is type(value) and is_like):
                return text
        return str(value)

    def as_json(self) -> dict[str, Any]:
        """Return the control as values of JSON; a number with two limits has a step, that of its slider."""
        allowed = self.declared.allowed
        panel, least = allowed.panel or _NO_PANEL, allowed.above if allowed.least is None else allowed.least
        step = panel.step
        if not step and self.kind in ("integer", "number") and least is not None and allowed.most is not None:
            width = allowed.most - least
            step = None if width > _WIDEST else 1 if self.kind == "integer" else width / 100
        default = self.declared.default
        return {
            "default": None if default is MISSING else self.shown(default),
            "name": self.name, "kind": self.kind, "label": self.label, "section": self.section,
            "help": self.declared.meaning.replace("`", ""), "step": step, "least": self.least,
            "most": None if self.kind == "digits" else self.most,
            "reach": self.most if panel.reach is None else panel.reach,
            "choices": list(self.choices), "live": self.live, "only": panel.only,
        }  # fmt: skip


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


def controls_of(model: Callable[..., Any], parameters: Mapping[str, Any]) -> list[Control]:
    """Return a control for each parameter that a page can set: numbers, truth values, and choices.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    parameters : mapping of str to object
        The values that are given. Limits are extended to hold them.

    Notes
    -----
    Choices are values of a ``Literal`` or an ``Enum``, and names of policies and degrees of awareness as the default of
    parameters that are called so. Other texts are no controls, since they may name files or code. A component that is
    given as an object brings controls for its own settings: ``policy.gain``.
    """
    found = []
    for name, one in declared(model).items():
        if name in SEEDS:
            continue
        value, live = parameters.get(name, one.default), _is_live(model, one)
        found.append(_control(one, value, one.allowed.section or model_name(model), live))
        if one.kind == "component" and isinstance(value, Component):
            for inner, its in declared(type(value)).items():
                panel = replace(its.allowed.panel or _NO_PANEL, only=f"{name}={_label(value)}")
                its = replace(its, name=f"{name}.{inner}", allowed=replace(its.allowed, panel=panel))
                found.append(_control(its, getattr(value, inner), type(value).__name__, live))
    return [one for one in found if one is not None]


def unset_choices(model: Callable[..., Any]) -> dict[str, Control]:
    """Return what checks the choices of a model that may be left out, such as ``preset``: no control until given."""
    unset = [one for one in declared(model).values() if one.kind == "choice" and one.is_optional]
    found = [_control(one, MISSING, one.allowed.section or model_name(model), live=False) for one in unset]
    return {one.name: one for one in found if one is not None}


def control_of_option(control: Control, kind: Any, option: str) -> Control | None:
    """Return what checks an option of a component, such as ``policy.gain``; None if a page cannot set it.

    Parameters
    ----------
    control : Control
        That of the component.
    kind : type or callable
        What makes the component.
    option : str
        The name of the option.
    """
    its = declared(kind)[option]
    value = its.default
    if value in (None, MISSING) and its.kind in ("integer", "number"):
        # Any number: only the limits count here.
        value = 1
    allowed = its.allowed
    if its.kind == "integer" and allowed.most is None:
        allowed = replace(allowed, panel=replace(allowed.panel or _NO_PANEL, most=_MOST_OPTION))
    its = replace(its, name=f"{control.name}.{option}", allowed=allowed)
    return _control(its, value, control.section, control.live)


def _control(one: Declared, value: Any, section: str, live: bool) -> Control | None:
    """Return a control with limits, or choices, that hold a value; None if a page cannot set it."""
    allowed, kind = one.allowed, one.kind
    panel = allowed.panel or _NO_PANEL
    if kind in ("choice", "component"):
        if one.is_optional and value is None:
            return None
        choices = dict(one.names or {name: name for name in panel.names or one.choices})
        if value is not MISSING and not any(each is value or each == value for each in choices.values()):
            # What was given from Python can be chosen again.
            choices[_label(value)] = value
        return Control(one, "choice", section, choices=choices, live=live)
    if kind in ("text", "object") and isinstance(value, str):
        # A text is a choice only if the parameter is called what it names; no other text may come from a page.
        for ending, known in (("policy", POLICIES), ("awareness", AWARENESS)):
            if (one.name == ending or one.name.endswith(f"_{ending}")) and value in known:
                return Control(one, "choice", section, choices={name: name for name in known}, live=live)
        return None
    if kind == "flag":
        return Control(one, "flag", section, live=live) if isinstance(value, bool) else None
    if isinstance(value, Cycle) and value == Cycle(value.period):
        value = value.period
    if kind not in ("integer", "number") or isinstance(value, bool) or not isinstance(value, (int, float)):
        # Missing, or a number for each robot.
        return None
    if kind == "integer" and not float(value).is_integer():
        kind = "number"
    largest = max(_MOST_INTEGER if kind == "integer" else _MOST_NUMBER, abs(value))
    lowest = 0 if kind == "integer" and value >= 0 else -largest
    lows, highs = (panel.least, allowed.least, allowed.above, lowest), (panel.most, allowed.most, largest)
    least, most = (next(limit for limit in limits if limit is not None) for limits in (lows, highs))
    return Control(one, kind, section, min(least, value), max(most, value), live=live)


def _label(given: Any) -> str:
    return f"{getattr(given, 'name', '') or type(given).__name__}{GIVEN}"


def _is_live(model: Any, one: Declared) -> bool:
    """Whether a new value acts on a running world: as declared, unless a subclass has replaced the attribute."""
    if not isinstance(model, type):
        return False
    home = next((kind for kind in model.__mro__ if one.name in vars(kind)), None)
    return bool(one.allowed.live) and home is not None and home.__module__.startswith("teamsight.")
