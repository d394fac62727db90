"""The defaults of `CMOMMT`, and how a parameter that is not given differs from its default given by a user."""

from __future__ import annotations

from typing import Any

from teamsight.agents.decisions.cycle import EVERY_STEP

#: The defaults of all parameters.
DEFAULTS: dict[str, Any] = {
    "robots": 10,
    "targets": 15,
    "radius": 5.0,
    "policy": "a-cmommt",
    "awareness": "pairwise",
    "delta": 16,
    "sensing_range": 1.0,
    "awareness_range": 1.0,
    "range_shape": "disc",
    "sensor": None,
    "robot_speed": 0.1,
    "target_speed": 0.075,
    "cycle": EVERY_STEP,
    "uniform_target_speed": False,
    "target_policy": "random-walk",
    "policy_options": {},
    "target_policy_options": {},
    "events": None,
}


class Default:
    """A default value, told apart from the same value given by a user: a preset replaces what is not given."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return repr(self.value)


#: The defaults of the signature.
DEFAULT: dict[str, Any] = {name: Default(value) for name, value in DEFAULTS.items()}
