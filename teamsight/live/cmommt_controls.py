"""The controls of `CMOMMT`, with limits that suit a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from teamsight.agents.awareness.registry import AWARENESS
from teamsight.agents.cmommt import CMOMMT
from teamsight.agents.decisions import Cycle
from teamsight.live.controls import Control
from teamsight.live.signature_controls import controls_of, value_of, with_given
from teamsight.policies.registry import POLICIES

_TEAM, _TARGETS, _WORLD = "Robots", "Targets", "World"

_CONTROLS = (
    Control("policy", "choice", "policy", _TEAM, "How robots decide.", choices={one: one for one in POLICIES},
            live=True),
    Control("awareness", "choice", "awareness", _TEAM, "What robots perceive of teammates.",
            choices={one: one for one in AWARENESS}, live=True),
    Control("delta", "integer", "δ", _TEAM, "Number of sectors of the ring, or of the nearest teammates.",
            1, 360, 1, live=True, only="awareness=ring,nearest", reach=64),
    Control("robots", "integer", "robots", _TEAM, "Their number.", 1, 2000, 1, reach=100),
    Control("awareness_range", "number", "awareness range", _TEAM,
            "Distance within which robots are neighbours.", 0.01, 100, 0.1, live=True, reach=5),
    Control("sensing_range", "number", "sensing range", _TEAM,
            "Distance within which robots sense targets.", 0.01, 100, 0.1, live=True, reach=5),
    Control("robot_speed", "number", "speed", _TEAM, "Largest distance of a step.", 0.001, 10, 0.005, live=True,
            reach=0.5),
    Control("cycle", "integer", "decide every", _TEAM, "Steps from one decision to the next.", 1, 1000, 1, live=True,
            reach=50),
    Control("targets", "integer", "targets", _TARGETS, "Their number.", 1, 2000, 1, reach=100),
    Control("target_policy", "choice", "policy", _TARGETS, "How targets move.",
            choices={one: one for one in ("random-walk", "evasive", "stationary")}, live=True),
    Control("target_speed", "number", "speed", _TARGETS, "Largest distance of a step.", 0.001, 10, 0.005, live=True,
            reach=0.5),
    Control("uniform_target_speed", "flag", "own speeds", _TARGETS,
            "Whether each target has a speed of its own, uniform between 0 and the speed."),
    Control("radius", "number", "radius", _WORLD, "Radius of the arena.", 0.5, 200, 0.5, reach=30),
)  # fmt: skip


def controls_for(model: Callable[..., Any], parameters: Mapping[str, Any]) -> list[Control]:
    """Return the controls of a model: those of `CMOMMT` for it and its subclasses, and those of its own parameters.

    Parameters
    ----------
    model : callable
        A class or function that builds a world.
    parameters : mapping of str to object
        The values that are given. Limits are extended to hold them.
    """
    if not (isinstance(model, type) and issubclass(model, CMOMMT)):
        return controls_of(model, parameters)
    own = {control.name: control for control in controls_of(model, parameters)}
    known = {control.name for control in _CONTROLS}
    shown = []
    for control in _CONTROLS:
        try:
            value = parameters.get(control.name, value_of(model, control.name))
        except KeyError:  # a parameter that a subclass has dropped
            continue
        fitted = _fitted(control, value)
        if fitted is not None:
            shown.append(replace(fitted, live=fitted.live and _stays_live(model, control.name)))
    return shown + [control for name, control in own.items() if name not in known]


def _stays_live(model: type[CMOMMT], name: str) -> bool:
    """Whether a setting of `CMOMMT` has not been replaced by the subclass; δ belongs to the degree of awareness."""
    return name == "delta" or getattr(model, name, None) is getattr(CMOMMT, name)


def _fitted(control: Control, value: Any) -> Control | None:
    """Return the control with limits, or choices, that hold a value; None if it cannot."""
    if control.kind == "choice":
        return replace(control, choices=with_given(control.choices, value))
    if control.kind == "flag":
        return control if isinstance(value, bool) else None
    if isinstance(value, Cycle) and value == Cycle(value.period):
        value = value.period
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        # A cycle as an object, or a range for each robot.
        return None
    is_whole = float(value).is_integer()
    if control.kind == "integer" and not is_whole:
        return replace(control, kind="number", least=min(control.least or 0, value), most=max(control.most or 0, value))
    least, most = min(control.least or 0, value), max(control.most or 0, value)
    return replace(control, least=least, most=most)
