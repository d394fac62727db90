"""Begin a run: put a world that exists back to tick 0, under another seed.

The kernels' records hold addresses of arrays. If all policies, degrees of awareness and the arena are this package's
own, a new run reuses these arrays without binding them again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.group import Group, first_state
from teamsight.agents.world_data import WorldData
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState
from teamsight.world.motion import is_watched
from teamsight.world.starts import Starts, starts


def start_of(data: WorldData, keys: npt.NDArray[np.uint64]) -> Starts:
    """Return the initial positions and headings of all groups for each key.

    Raises
    ------
    ValueError
        If the arena places agents outside.
    """
    return starts(data.arena, [group.founders for group in data.groups], keys)


def first_states(data: WorldData) -> list[Any]:
    """Return the state of each group's policy before its first decision.

    Raises
    ------
    TypeError, ValueError
        If a policy returns a state that its kernel cannot read.
    """
    return [first_state(group.policy, len(group)) for group in data.groups]


def restart_groups(data: WorldData, start: Starts, run: int, states: list[Any], keep: bool) -> None:
    """Put all groups back to the start of a run.

    Parameters
    ----------
    data : WorldData
        The data of the world.
    start : Starts
        Initial positions and headings.
    run : int
        The index of the run in `start`.
    states : list
        What `first_states` returned.
    keep : bool
        Whether to keep the arrays to which the records point; see `is_rewritable`.
    """
    first = 0
    for group, state in zip(data.groups, states, strict=True):
        last = first + group.founders.size
        group.restart(start.position[run, first:last], start.heading[run, first:last])
        first = last
        if keep and isinstance(group.policy_state, PolicyState):
            for old, new in zip(group.policy_state, state, strict=True):
                old[:] = new
        else:
            group.begin(state)


def is_rewritable(data: WorldData) -> bool:
    """Whether a new run can use the records as they are.

    The parameters of user-defined policies, degrees and arenas may have changed: a world with any is bound again.
    """
    return not is_watched(data.arena) and all(map(_is_shipped, data.groups))


def _is_shipped(group: Group) -> bool:
    policy, awareness = group.rules
    return (
        group.is_compiled
        and isinstance(policy, CompiledPolicy)
        and type(policy).__module__.startswith("teamsight.policies.")
        and type(awareness).__module__.startswith("teamsight.agents.awareness.")
    )
