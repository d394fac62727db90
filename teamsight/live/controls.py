"""Controls: what a page can set, each with its check. Nothing else can be set from a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from teamsight.core import checks


@dataclass(frozen=True)
class Control:
    """One parameter of a model that a page can set.

    Attributes
    ----------
    name : str
        The name of the parameter.
    kind : {"choice", "integer", "number", "flag", "digits"}
        What it is; digits are a whole number as a text, since scripts hold only those below 2⁵³ exactly.
    label, section, help : str
        What stands beside it, under which heading, and what it means.
    least, most : float, optional
        The limits of numbers.
    step, reach : float, optional
        The step of the slider of a number, without which it is a field, and the largest value of the slider; by default
        `most`. Larger ones can be typed.
    choices : mapping of str to object
        The values of a choice by what the page shows; a page can only name them.
    live : bool
        Whether a new value acts on the running world; otherwise the world starts again.
    only : str
        A condition under which it matters, as in ``awareness=ring,nearest``; the page greys it otherwise.
    """

    name: str
    kind: str
    label: str = ""
    section: str = ""
    help: str = ""
    least: float | None = None
    most: float | None = None
    step: float | None = None
    choices: Mapping[str, Any] = field(default_factory=dict)
    live: bool = False
    only: str = ""
    reach: float | None = None

    def checked(self, value: Any) -> Any:
        """Return the value of the parameter for what a page has sent.

        Raises
        ------
        TypeError, ValueError
            If it is of another kind, outside the limits, or none of the choices.
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
            return checks.count(self.name, value, least=least, most=most)
        return checks.number(self.name, value, least=self.least, most=self.most)

    def shown(self, value: Any) -> Any:
        """Return what the page shows for a value of the parameter."""
        if self.kind == "digits":
            return str(value)
        if self.kind != "choice":
            # Of a cycle, its period.
            return getattr(value, "period", value)
        return next((text for text, one in self.choices.items() if one is value or _equal(one, value)), str(value))

    def as_json(self) -> dict[str, Any]:
        """Return the control as values of JSON."""
        return {
            "name": self.name, "kind": self.kind, "label": self.label or self.name.replace("_", " "),
            "section": self.section, "help": self.help, "step": self.step, "least": self.least,
            "most": None if self.kind == "digits" else self.most,
            "reach": self.most if self.reach is None else self.reach,
            "choices": list(self.choices), "live": self.live, "only": self.only,
        }  # fmt: skip


def _equal(one: Any, other: Any) -> bool:
    return type(one) is type(other) and isinstance(one, (str, int, float, bool)) and one == other


def control_named(controls: list[Control], name: str) -> Control:
    """Return a control by name.

    Raises
    ------
    ValueError
        If there is none; the error suggests the nearest.
    """
    known = {control.name: control for control in controls}
    return known[checks.choice("name", name, tuple(known))]
