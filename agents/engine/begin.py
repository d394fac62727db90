"""Begin a run: put a world that exists back to tick 0, under another seed.

The kernels' records hold addresses of arrays. As long as everything in a world ships with this package, a new run
writes into these same arrays, and nothing is bound again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.group import Group, first_memory
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState
from teamsight.world.motion import is_watched
from teamsight.world.starts import Starts, starts

if TYPE_CHECKING:
    from teamsight.agents.model import World


def start_of(world: World, keys: npt.NDArray[np.uint64]) -> Starts:
    """Return where the founders of a world's groups begin under each of some keys.

    Raises
    ------
    ValueError
        If the arena places agents outside.
    """
    return starts(world.arena, [group.founders for group in world.groups], keys)


def first_states(world: World) -> list[Any]:
    """Return the state of each group's policy before its first decision.

    Raises
    ------
    TypeError, ValueError
        If a policy returns a state that its kernel cannot read.
    """
    return [first_memory(group.policy, len(group)) for group in world.groups]


def restart_groups(world: World, start: Starts, run: int, states: list[Any]) -> bool:
    """Put all groups back to the start of a run; return whether the records still describe them.

    Parameters
    ----------
    world : World
        The world.
    start : Starts
        Where the founders begin.
    run : int
        Which run of `start`.
    states : list
        From `first_states`.
    """
    keep = is_rewritable(world)
    first = 0
    for group, state in zip(world.groups, states, strict=True):
        last = first + group.founders.size
        group.restart(start.position[run, first:last], start.heading[run, first:last])
        first = last
        if keep and isinstance(group.memory, PolicyState):
            for old, new in zip(group.memory, state, strict=True):
                old[:] = new
        else:
            group.begin(state)
    return keep


def is_rewritable(world: World) -> bool:
    """Whether a new run can use the records as they are.

    Policies, degrees of awareness and arenas of a user's own may return other parameters than when they were bound, so
    a world that has any of them is bound again.
    """
    return not is_watched(world.arena) and all(map(_is_shipped, world.groups))


def _is_shipped(group: Group) -> bool:
    policy, awareness = group.rules
    return (
        group.is_compiled
        and isinstance(policy, CompiledPolicy)
        and type(policy).__module__.startswith("teamsight.policies.")
        and type(awareness).__module__.startswith("teamsight.agents.awareness.")
    )
