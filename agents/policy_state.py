"""The state of a policy for a group: before its first decision, and with rows for agents that join."""

from __future__ import annotations

from typing import Any

from teamsight.agents.engine.state_rows import with_more_rows
from teamsight.policies.compiled import CompiledPolicy, check_state
from teamsight.policies.interface import Policy
from teamsight.policies.registry import label


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


def state_of_more(policy: Any, state: Any, size: int, total: int) -> Any:
    """Return the state of `size` agents with first states for more, `total` in all.

    Raises
    ------
    TypeError, ValueError
        If the policy's ``start`` returns none that fit.
    """
    more = with_more_rows(state, first_state(policy, total), size, total, f"policy={label(policy)}: start({total})")
    if isinstance(policy, CompiledPolicy):
        check_state(policy, more, total)
    return more
