"""The check of what a policy declares."""

from __future__ import annotations

from teamsight.core import checks
from teamsight.core.contracts import check_names
from teamsight.policies.channels import OWN_FIELDS, checked_channel
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import IDENTITIES, Policy, PolicyState


def check_declarations(name: str, policy: Policy) -> None:
    """Refuse a policy whose declarations have a wrong type; see `Policy`.

    Parameters
    ----------
    name : str
        The policy, for error messages.
    policy : Policy
        The policy.

    Raises
    ------
    TypeError, ValueError
        Naming the attribute.
    """
    decides_in_kernel = isinstance(policy, CompiledPolicy) and type(policy).decide is CompiledPolicy.decide
    if decides_in_kernel and not hasattr(type(policy), "kernel"):
        raise TypeError(f"{name}: has no 'kernel'; give kernel(percept, arrays, noise, action)")
    for attribute in ("draws", "inputs", "effort"):
        checks.count(f"{name}.{attribute}", getattr(policy, attribute), least=0)
    for attribute in ("channels", "columns", "shows", "needs"):
        check_names(f"{name}.{attribute}", getattr(policy, attribute), "('predators',)")
    for need in policy.needs:
        checks.choice(f"{name}.needs", need, (*OWN_FIELDS, IDENTITIES))
    checks.flag(f"{name}.decides_together", policy.decides_together)
    for channel in policy.channels:
        if channel in OWN_FIELDS:
            raise ValueError(f"{name}.channels: {channel!r} is a field of percepts, percept.{channel}; leave it out")
        checked_channel(channel)
    for column in (*policy.columns, *policy.shows):
        if not column.isidentifier() or hasattr(tuple, column):
            raise ValueError(f"{name}.columns: {column!r} cannot be an attribute of percept.columns; rename the column")
    state = policy.start(1) if policy.shows else None
    fields = state.floats.shape[2] if isinstance(state, PolicyState) and state.floats.shape[1] else 0
    if fields < len(policy.shows):
        raise ValueError(
            f"{name}.shows={policy.shows}: are the first {len(policy.shows)} fields of its state.floats[:, 0], which "
            f"has {fields}; return PolicyState(np.zeros((size, 1, {len(policy.shows)})), …) from start(size)"
        )
