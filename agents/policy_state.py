"""The state of a policy for a group: before its first decision, and with rows for agents that join."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.state_rows import take_rows, with_more_rows
from teamsight.policies.compiled import CompiledPolicy, check_state
from teamsight.policies.interface import Policy
from teamsight.policies.registry import label

Integers = npt.NDArray[np.int64]


def first_state(policy: Any, size: int) -> Any:
    """Return the state of a policy for `size` agents before their first decision.

    Raises
    ------
    TypeError, ValueError
        If the policy has a kernel that cannot read the state.
    """
    state = policy.start(size) if isinstance(policy, Policy) else None
    if isinstance(policy, CompiledPolicy):
        check_state(policy, state, size)
    return state


def first_state_of_members(policy: Any, members: Integers, members_so_far: int) -> Any:
    """Return the state before their first decision of those that are in a group, of all that have been.

    A policy may have a state for each: with tables per robot, those that stay keep their own.

    Raises
    ------
    TypeError, ValueError
        As `first_state`.
    """
    if len(members) == members_so_far:
        return first_state(policy, members_so_far)
    state = take_rows(first_state(policy, members_so_far), members, members_so_far)
    if isinstance(policy, CompiledPolicy):
        check_state(policy, state, len(members))
    return state


def state_of_more(policy: Any, state: Any, size: int, members: Integers, members_so_far: int) -> Any:
    """Return the state of `size` robots with first states for more; `members` are all, those before them included.

    Raises
    ------
    TypeError, ValueError
        If the policy's ``start`` returns none that fit.
    """
    total = len(members)
    fresh = first_state_of_members(policy, members, members_so_far)
    more = with_more_rows(state, fresh, size, total, f"policy={label(policy)}: start({members_so_far})")
    if isinstance(policy, CompiledPolicy):
        check_state(policy, more, total)
    return more
