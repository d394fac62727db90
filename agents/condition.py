"""Changes of the condition of agents: one takes part or not, and its sensors work or not.

The arrays of conditions are bound when an agent of a group is first in another condition than at the start; a group in
which that never happens costs nothing more than before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.agents.condition_of_one import channel_of
from teamsight.core import checks
from teamsight.core.interrupts import deferred

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.group import Group
    from teamsight.agents.world_data import WorldData


def set_active(data: WorldData, engine: Engine, agent: Body, active: bool) -> None:
    """Let an agent take part, or not; neighbour lists show it at once."""
    group, row = agent.group, agent.row
    # A mask of NumPy's has elements of its own type.
    active = checks.flag("active", bool(active) if isinstance(active, np.bool_) else active)
    data.timeline.check_undecided("active", "plan it with world.clock.at(world.clock.now, …)")
    data.sources.switched(agent, None, active)
    if group.bodies.active[row] != active:
        with deferred():
            group.bodies.active[row] = active
            engine.change(group, row)
            data.sources.note_change("active" if active else "inactive", agent)


def set_works(data: WorldData, engine: Engine, agent: Body, channel: str, works: bool) -> None:
    """Put one agent's sensor of a channel in order, or out of order; neighbour lists show it at once."""
    group, row = agent.group, agent.row
    array = channel_of(group, channel).works
    what = "repair_sensor()" if works else "break_sensor()"
    data.timeline.check_undecided(what, "plan it with world.clock.at(world.clock.now, …)")
    data.sources.switched(agent, channel, works)
    if array[row] != works:
        with deferred():
            array[row] = works
            engine.change(group, row)


def note_conditions(group: Group) -> None:
    """Note whether an agent of a group is inactive, or a sensor out of order, after its arrays were replaced."""
    works = all(channel.works.all() for channel in group.channels.values())
    group.has_conditions = group.has_conditions or not (works and group.bodies.active.all())
