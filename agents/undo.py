"""Undo: the groups of a world as they were before agents were added, to go back to them if that fails."""

from __future__ import annotations

from typing import Any

from teamsight.agents import mesa_compat
from teamsight.agents.engine.engine import Engine
from teamsight.agents.group import Group
from teamsight.agents.mesa_bases import Model
from teamsight.agents.world_data import WorldData
from teamsight.core.interrupts import deferred


class Undo:
    """What was there before agents are added.

    The ``__init__`` of an agent may add groups and agents, and remove others. Adding and removing replace arrays, so it
    suffices to keep the old ones.
    """

    def __init__(self, model: Model, data: WorldData, engine: Engine) -> None:
        self._model, self._data, self._engine = model, data, engine
        # Ctrl-C may come where `Timeline.calling` cannot set it back.
        self._inside = data.timeline.inside
        self._first = mesa_compat.next_identity(model)
        self._interactions = [(one, one.changes) for one in data.interactions]
        self._kept = [_Kept(group) for group in data.groups]

    def undo(self) -> None:
        """Go back."""
        with deferred():
            self._data.timeline.inside = self._inside
            added = self._data.groups[len(self._kept) :]
            del self._data.groups[len(self._kept) :]
            for agent in [agent for agent in self._model.agents if agent.unique_id >= self._first]:
                self._model.deregister_agent(agent)
            for kept in self._kept:
                kept.put_back(self._model)
            mesa_compat.set_next_identity(self._model, self._first)
            for group in added:
                self._engine.leave_out(group)
            self._data.interactions[:] = [one for one, _ in self._interactions]
            for one, changes in self._interactions:
                one.take(changes)
            self._engine.is_bound = False


class _Kept:
    """The attributes of a group, its agents and its columns."""

    def __init__(self, group: Group) -> None:
        self._group = group
        self._attributes: dict[str, Any] = vars(group).copy()
        self._agents, self._columns = group._agents.copy(), group.columns.kept()
        self._works = {name: channel.works for name, channel in group.channels.items()}

    def put_back(self, model: Model) -> None:
        """Give the group what it had."""
        vars(self._group).update(self._attributes)
        self._group._agents = self._agents
        self._group.columns.go_back(self._columns)
        for name, works in self._works.items():
            self._group.channels[name].works = works
        for row, agent in enumerate(self._agents):
            if agent._row < 0:
                # mesa 3.5 would give it a new number.
                identity = agent.unique_id
                model.register_agent(agent)
                agent.unique_id = identity
            agent.row = row
