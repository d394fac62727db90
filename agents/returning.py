"""Agents when a state is restored: those that came since leave, and those that left since come back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.body import Body
from teamsight.agents.mesa_bases import Agent, Model

if TYPE_CHECKING:
    from teamsight.agents.group import Group


def lost_members(group: Group, member: npt.NDArray[np.int64]) -> list[int]:
    """Return the members that cannot come back: agents made by an ``__init__`` of the user's that nobody keeps."""
    if group.agent_class.__init__ is Body.__init__:
        return []
    missing = set(member.tolist()) - set(group.bodies.member.tolist())
    return sorted(number for number in missing if number not in group.departed)


def bring_back(model: Model, group: Group, member: npt.NDArray[np.int64], identity: npt.NDArray[np.int64]) -> None:
    """Give a group the agents that are these members, in this order, with these identities; columns get rows for them.

    An agent that has left and is still in use somewhere comes back itself; else a new one takes its place.
    """
    present = dict(zip(group.bodies.member.tolist(), group._agents, strict=True))
    rows = {number: row for row, number in enumerate(present)}
    wanted = member.tolist()
    group.columns.replace(group.columns.rearranged([rows.get(number, -1) for number in wanted]))
    for number in present.keys() - set(wanted):
        agent = present.pop(number)
        model.deregister_agent(agent)
        agent.row = -1
        group.departed[number] = agent
    agents = []
    for row, (number, unique_id) in enumerate(zip(wanted, identity.tolist(), strict=True)):
        agent = present.get(number) or _returned(model, group, number)
        # Here agents may have come in another order; and mesa may give those that return a new one.
        agent.unique_id = unique_id
        agent.row = row
        agents.append(agent)
    group._agents = agents


def _returned(model: Model, group: Group, number: int) -> Any:
    agent = group.departed.pop(number, None)
    if agent is None:
        made: Any = group.agent_class
        agent = made.__new__(made)
        vars(agent).update(group=group, _row=-1)
        Agent.__init__(agent, model)
    else:
        model.register_agent(agent)
    return agent
