"""How the robots of a group decide: by which policies, in kernels or in Python, and when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.decisions.cycle import EVERY_STEP, Cycle
from teamsight.agents.fixed import Kept
from teamsight.agents.settings import Settings
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Action, Policy

if TYPE_CHECKING:
    from teamsight.agents.decisions.other_policies import OtherPolicy
    from teamsight.agents.decisions.timetable import Timetable
    from teamsight.agents.engine.due import DueArrays

Integers = npt.NDArray[np.int64]


class Deciding(Settings):
    """What a group says of its decisions; `Group` derives from it.

    Attributes
    ----------
    rules : tuple
        The policy and the degree of awareness; `World.adjust` changes them.
    policy_state : object
        The state of the policy; rows as in `agents`.
    others : tuple of OtherPolicy
        Further policies, which single robots have or have had.
    timetable : Timetable or None
        When robots decide and by which policy, if not all at every step and by the group's.
    due : DueArrays or None
        The arrays with the robots that are due, once they are bound.
    first_cycle : Cycle
        The cycle with which the group was added.
    arrived_at : ndarray, shape (members,), int64
        The tick at which each agent came, by member.
    time : ndarray, shape (1,), float64
        The present tick, which percepts show: an array of the world.
    """

    rules: tuple[Any, Any] = Kept("set the policy or the degree, as in robots.policy = 'centroid'")  # type: ignore[assignment]
    policy_state: Any
    action: Action
    decides_alone: bool
    has_conditions: bool
    others: tuple[OtherPolicy, ...] = Kept("set that of one robot, as in robots[0].policy = 'centroid'")  # type: ignore[assignment]
    timetable: Timetable | None = Kept("set the cycle, as in robots.cycle = Cycle(5)")  # type: ignore[assignment]
    due: DueArrays | None
    first_cycle: Cycle = EVERY_STEP
    arrived_at: Integers
    time: npt.NDArray[np.float64]

    @property
    def policies(self) -> list[Any]:
        """All policies of the group's robots; that of the group is the first."""
        return [self.rules[0], *(other.policy for other in self.others)]

    @property
    def states(self) -> list[Any]:
        """The states of `policies`."""
        return [self.policy_state, *(other.state for other in self.others)]

    def set_state(self, index: int, state: Any) -> None:
        """Replace the state of a policy, given by its index in `policies`."""
        if getattr(self.policies[index], "shows", ()):
            # Others read its arrays.
            for kept, new in zip(self.states[index], state, strict=True):
                kept[...] = new
        elif index == 0:
            self.policy_state = state
        else:
            self.others[index - 1].state = state

    @property
    def needs_timetable(self) -> bool:
        """Whether at some step not all robots decide, or not all by the policy of the group."""
        return self.timetable is not None or self.has_conditions

    def policy_of(self, row: int) -> Any:
        """Return the policy of one robot."""
        return self.rules[0] if self.timetable is None else self.policies[self.timetable.policy[row]]

    @property
    def decided_at(self) -> Integers:
        """The tick at which each robot last decided, shape (n,); −1 before its first decision."""
        if self.timetable is not None:
            return self.timetable.decided_at.copy()
        tick = int(self.time[0])
        return np.where(self.arrived_at[self.bodies.member] < tick, tick - 1, -1)

    @property
    def is_compiled(self) -> bool:
        """Whether the group decides in kernels, without Python."""
        if self.decides_alone or not _has_kernel(self.rules[0]):
            return False
        return not self.others or all(_has_kernel(other.policy) for other in self.others)

    @property
    def is_sound(self) -> bool:
        """Whether the actions of all policies need no check."""
        return self.is_compiled and all(policy.is_sound for policy in self.policies)

    @property
    def draws(self) -> int:
        """The most random numbers that a policy needs per decision."""
        return max(policy.draws if isinstance(policy, Policy) else 0 for policy in self.policies)

    @property
    def inputs(self) -> int:
        """The width of the situation vector that policies read; 0 for none."""
        return max(policy.inputs if isinstance(policy, Policy) else 0 for policy in self.policies)

    @property
    def reads_teammates(self) -> bool:
        """Whether a decision reads the lists of teammates or of relayed targets."""
        return not self.is_compiled or any(policy.reads_teammates for policy in self.policies)


def _has_kernel(policy: Any) -> bool:
    return isinstance(policy, CompiledPolicy) and type(policy).decide is CompiledPolicy.decide
