"""Further policies of a group: those that single robots have instead of the group's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.policy_state import state_of_more, take_rows


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

    def extended(self, size: int, members: npt.NDArray[np.int64], members_so_far: int) -> OtherPolicy:
        """Return it for more robots, of which the first `size` go on; see `state_of_more`."""
        return OtherPolicy(self.policy, state_of_more(self.policy, self.state, size, members, members_so_far))
