"""Further policies of a group: those that single robots have instead of the group's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.state_rows import put_rows, take_rows
from teamsight.agents.policy_state import first_state, state_of_more
from teamsight.policies.interface import PolicyState

if TYPE_CHECKING:
    from teamsight.agents.group import Group


@dataclass
class OtherPolicy:
    """A policy that some robots of a group have, or have had.

    Attributes
    ----------
    policy : Policy or callable
        The policy.
    state : object
        Its state for all robots of the group, of which those of robots with this policy are in use.
    """

    policy: Any
    state: Any

    def rows(self, keep: npt.NDArray[Any], size: int) -> OtherPolicy:
        """Return it for some of the `size` robots."""
        return OtherPolicy(self.policy, take_rows(self.state, keep, size))

    def extended(self, size: int, total: int) -> OtherPolicy:
        """Return it for `total` robots, of which the first `size` go on."""
        return OtherPolicy(self.policy, state_of_more(self.policy, self.state, size, total))


def index_of(group: Group, policy: Any) -> int:
    """Return the index of a policy among those of a group; −1 if it is not known to the group."""
    for index, known in enumerate(group.policies):
        if known is policy or (type(known) is type(policy) and _is_equal(known, policy)):
            return index
    return -1


def _is_equal(one: Any, other: Any) -> bool:
    # Only dataclasses, such as those of the package, compare by their options.
    return bool(hasattr(type(one), "__dataclass_fields__") and one == other)


def start_again(group: Group, index: int, row: int) -> None:
    """Set the state of one robot to that before the first decision of a policy."""
    size, rows = len(group), np.array([row])
    policy, state = group.policies[index], group.states[index]
    fresh = take_rows(first_state(policy, size), rows, size)
    if isinstance(state, PolicyState):
        # In place, because kernels read it.
        for array, part in zip(state, fresh, strict=True):
            array[rows] = part
    else:
        group.set_state(index, put_rows(state, rows, fresh, size))
