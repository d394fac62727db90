"""Robots that are steered from outside: they carry out actions that are written into their state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from teamsight.core.component import Allowed
from teamsight.core.kernel import inlined
from teamsight.policies.actions import act, act_along
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState

#: How an action is written: as rotation and share of the speed, as the heading and distance of `Action`, or as the way
#: ahead and to the left in speeds.
FORMS = ("rotation", "heading", "vector")
_ROTATION, _HEADING, _VECTOR = range(3)


@inlined
def _carry_out(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    given = arrays.state.floats
    for i in range(percept.heading.shape[0]):
        if arrays.parameters[0] == _ROTATION:
            act(given[i, 0, 0], given[i, 0, 1], i, percept, action)
        elif arrays.parameters[0] == _VECTOR:
            act_along(given[i, 0, 0], given[i, 0, 1], i, percept, action)
        else:
            action.heading[i, 0] = given[i, 0, 0]
            action.heading[i, 1] = given[i, 0, 1]
            action.distance[i] = given[i, 0, 2]


@dataclass(frozen=True)
class Steered(CompiledPolicy):
    """Carry out the action that was written into the state of each robot, at each decision; at first, stay.

    Environments for reinforcement learning give it to their robots. The state is of shape (n, 1, 3), float64: rotation
    [rad] and distance [share of the speed], as the learners' actions; heading x, y and distance [length], as in
    `Action`, which are carried out to the last bit; or the way ahead and to the left [speed], see `act_along`.

    Parameters
    ----------
    form : {"rotation", "heading", "vector"}
        How actions are written.

    Raises
    ------
    ValueError
        If the form is unknown.
    """

    form: Annotated[str, Allowed(choices=FORMS)] = "rotation"

    kernel = _carry_out

    @property
    def reads_teammates(self) -> bool:
        return False

    @property
    def parameters(self) -> tuple[float, ...]:
        return (float(FORMS.index(self.form)),)

    def start(self, size: int) -> PolicyState:
        """Return the state in which all robots stay where they are."""
        return PolicyState(np.zeros((size, 1, 3)), np.zeros((size, 0, 0), np.int64))
