"""Changes of when robots decide and by which policy: the cycle of a group or a robot, and the policy of a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from teamsight.agents.decisions.cycle import EVERY_STEP, cycle_of
from teamsight.agents.decisions.new_timetable import new_timetable, put_timetable
from teamsight.agents.decisions.other_policies import OtherPolicy
from teamsight.agents.decisions.timetable import Timetable
from teamsight.agents.engine.state_rows import put_rows, take_rows
from teamsight.agents.fixed import put
from teamsight.agents.group import Group, team_of
from teamsight.agents.policy_state import first_state
from teamsight.agents.resolve import check_channels, check_fit, policy_of
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.interface import PolicyState

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.world_data import WorldData

Integers = npt.NDArray[np.int64]

_WHEN = "plan it with world.clock.at(world.clock.now, …)"


def check_not_recorded(engine: Engine, group: Group, what: str) -> None:
    """Refuse robots that do not decide at every step where their transitions are recorded."""
    if group in engine.transitions.groups:
        raise ValueError(
            f"{what}: transitions of {group.name!r} are recorded, which takes a decision of each robot at every step; "
            "record them in a world with Cycle()"
        )


def timetable_with(data: WorldData, engine: Engine, group: Group, value: Any) -> Timetable | None:
    """Return the timetable of a group with another cycle, which begins now; None if it goes on without one."""
    cycle = cycle_of(value)
    if cycle != EVERY_STEP:
        check_not_recorded(engine, group, f"cycle={checks.shown(value)}")
    return new_timetable(data, group, cycle) if group.timetable or cycle != EVERY_STEP else None


def set_cycle_of_one(data: WorldData, engine: Engine, agent: Body, value: Any) -> None:
    """Give one robot a cycle that begins now; a reset goes back to that of the group."""
    data.timeline.check_undecided("cycle", _WHEN)
    group, row = agent.group, agent.row
    cycle = cycle_of(value)
    given = cycle.numbers(1)
    if cycle != EVERY_STEP:
        check_not_recorded(engine, group, f"cycle={checks.shown(value)}")
    table = group.timetable or new_timetable(data, group)
    with deferred():
        slots = len(table.arrives_at)
        for present, one in zip(table.numbers, given, strict=True):
            present[row] = one[0]
        table.begin(np.array([row]), data.key, group.bodies.member, data.timeline.tick)
        if group.timetable is None or len(table.arrives_at) != slots:
            put_timetable(group, table)
            engine.is_bound = False


def set_policy_of_one(data: WorldData, engine: Engine, agent: Body, value: Any) -> None:
    """Give one robot a policy, with the policy's first state; a reset goes back to that of the group."""
    data.timeline.check_undecided("policy", _WHEN)
    group, row = agent.group, agent.row
    policy = policy_of(value)
    if group.is_growing:
        raise RuntimeError(
            f"policy={checks.shown(value)}: set in {group.agent_class.__name__}.__init__, and a reset would not call "
            "that again; set it after world.add(…), or add a group for these agents"
        )
    index = index_of(group, policy)
    others = group.others
    if index < 0:
        check_channels(group, policy)
        check_policies(group, [policy], team_of(data.groups, group))
        others = (*others, OtherPolicy(policy, first_state(policy, len(group))))
    table = group.timetable or new_timetable(data, group)
    with deferred():
        if index >= 0:
            start_again(group, index, np.array([row]))
        else:
            index = len(others)
        table.policy[row] = index
        if others is not group.others:
            put(group, others=others)
            put_timetable(group, table)
            # The buffers for noise and situations depend on all policies.
            group.begin(group.policy_state, group.decided)
            engine.is_bound = False
        elif group.timetable is None:
            put_timetable(group, table)
            engine.is_bound = False


def check_policies(group: Group, policies: list[Any], team: list[Group]) -> None:
    """Refuse policies that do not fit the degree of awareness of a group; see `check_fit`."""
    before = group.rules
    try:
        for policy in policies:
            put(group, rules=(policy, before[1]))
            check_fit(group, team)
    finally:
        put(group, rules=before)


def begin_policy(group: Group, state: Any) -> None:
    """Let all robots decide by a new policy of the group, which has been set, with its first state."""
    put(group, others=())
    if group.timetable is not None:
        group.timetable.policy[:] = 0
    group.begin(state)


def back_to_group(group: Group) -> None:
    """Let all robots decide by the policy of the group; those that had another begin anew."""
    table = group.timetable
    if table is not None and table.policy.any():
        start_again(group, 0, np.flatnonzero(table.policy))
        table.policy[:] = 0


def index_of(group: Group, policy: Any) -> int:
    """Return the index of a policy among those of a group; −1 if it is not known to the group."""
    for index, known in enumerate(group.policies):
        if known is policy or (type(known) is type(policy) and _is_equal(known, policy)):
            return index
    return -1


def _is_equal(one: Any, other: Any) -> bool:
    # Only dataclasses, such as those of the package, compare by their options.
    return bool(hasattr(type(one), "__dataclass_fields__") and one == other)


def start_again(group: Group, index: int, rows: Integers) -> None:
    """Set the state of some robots to that before the first decision of a policy."""
    size = len(group)
    policy, state = group.policies[index], group.states[index]
    fresh = take_rows(first_state(policy, size), rows, size)
    if isinstance(state, PolicyState):
        # In place, because kernels read it.
        for array, part in zip(state, fresh, strict=True):
            array[rows] = part
    else:
        group.set_state(index, put_rows(state, rows, fresh, size))
