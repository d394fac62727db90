"""The kernels that a world needs, for the report of compilation."""

from __future__ import annotations

import weakref
from collections.abc import Callable

from teamsight.agents.awareness.binding import perceive_entry, situate_entry
from teamsight.agents.engine.condition_changes import CHANGE
from teamsight.agents.engine.conditions import HIDE
from teamsight.agents.engine.interacting import MOVE_AND_INTERACT
from teamsight.agents.engine.loop import BEGIN_STEP, END_STEP, LOOK, RUN, SEE
from teamsight.agents.engine.perceived_columns import SHOW_COLUMNS
from teamsight.agents.engine.relation import needs_detection
from teamsight.agents.engine.relaying import delay_of
from teamsight.agents.engine.relays import SHOW_LATE
from teamsight.agents.group import Group
from teamsight.agents.sensing.binding import sense_entry
from teamsight.agents.sensing.sensor import Sensor
from teamsight.agents.world_data import WorldData
from teamsight.core.kernel import Entry
from teamsight.world.motion import advance_entry


def kernels_needed(data: WorldData) -> Callable[[], list[Entry]]:
    """Return a function that lists the kernels for the steps of a world; it does not keep the world alive."""
    known = weakref.ref(data)

    def entries() -> list[Entry]:
        world = known()
        return _entries_of(world) if world is not None else []

    return entries


def _entries_of(data: WorldData) -> list[Entry]:
    groups = data.groups
    steps = [RUN] if all(group.is_compiled for group in groups) else [BEGIN_STEP, END_STEP]
    found = [SEE, advance_entry(data.arena), *steps]
    for group in groups:
        found += _entries_of_group(group)
        sensors = (channel.sensor or Sensor() for channel in group.channels.values())
        found += [sense_entry(sensor) for sensor in sensors if needs_detection(sensor, data.arena)]
    if any(group.has_conditions for group in groups):
        found += [HIDE, CHANGE]
    if any(delay_of(group) for group in groups):
        found.append(SHOW_LATE)
    if data.interactions:
        found += [MOVE_AND_INTERACT, *(one.interaction.entry(one.kinds) for one in data.interactions)]
    if any(group.perceived_columns for group in groups):
        found.append(SHOW_COLUMNS)
    if data.watchers:
        found += [LOOK, *(watcher.entry for watcher in data.watchers)]
    return list(dict.fromkeys(found))


def _entries_of_group(group: Group) -> list[Entry]:
    """Return the kernels of a policy and a degree of awareness."""
    entries = []
    if group.is_compiled:
        entries += [policy.entry() for policy in group.policies]
    if group.reads_teammates and (perceive := perceive_entry(group.awareness)) is not None:
        entries.append(perceive)
    if group.inputs:
        entries.append(situate_entry(group.awareness))
    return entries
