"""Adjustments: changes of the settings of groups and of the abilities of agents."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from teamsight.agents.building import column, turn_columns
from teamsight.agents.decisions.new_timetable import put_timetable
from teamsight.agents.decisions.timetabling import back_to_group, begin_policy, check_policies, timetable_with
from teamsight.agents.fixed import put
from teamsight.agents.group import Group, first_state, team_of
from teamsight.agents.resolve import awareness_of, check_channels, policy_of
from teamsight.core import checks
from teamsight.core.interrupts import deferred

if TYPE_CHECKING:
    from teamsight.agents.body import Body
    from teamsight.agents.engine.engine import Engine
    from teamsight.agents.world_data import WorldData


def adjust(data: WorldData, engine: Engine, group: Group, changes: dict[str, Any]) -> None:
    """Change the settings of a group; see `World.adjust`."""
    data.timeline.check_undecided("adjust()", "plan it with world.clock.at(world.clock.now, …)")
    if group not in data.groups:
        raise ValueError(f"adjust({checks.shown(group)}): must be a group or an interaction of this world")
    given = {name: value for name, value in changes.items() if value is not None}
    size, limits, bodies = len(group), data.limits, group.bodies
    ranges = [
        column(name, given[name], size, limits.range) if name in given else before
        for name, before in zip(("sensing_range", "awareness_range"), group.ranges, strict=True)
    ]
    speed = column("speed", given["speed"], size, limits.speed) if "speed" in given else bodies.speed
    turning = bodies.turn_cosine, bodies.turn_sine
    if "turn_limit" in given:
        turning = turn_columns(given["turn_limit"], size)
    table = timetable_with(data, engine, group, given["cycle"]) if "cycle" in given else None
    before, policy = group.rules, _policy_given(group, given)
    awareness = awareness_of(given["awareness"]) if "awareness" in given else before[1]
    try:
        put(group, rules=(policy, awareness))
        stay = group.policies if policy is before[0] else [policy]
        check_policies(group, stay, team_of(data.groups, group))
        state = first_state(policy, size) if policy is not before[0] else None
    except BaseException:
        put(group, rules=before)
        raise
    with deferred():
        if "policy" in given and policy is before[0]:
            back_to_group(group)
            if table is not None:
                table.policy[:] = 0
        group.ranges = ranges[0], ranges[1]
        bodies.speed, (bodies.turn_cosine, bodies.turn_sine) = speed, turning
        if table is not None:
            put_timetable(group, table)
        if policy is not before[0]:
            begin_policy(group, state)
        engine.is_bound = False


def _policy_given(group: Group, given: dict[str, Any]) -> Any:
    """Return the new policy of a group; without one its present."""
    if "policy" in given:
        policy = policy_of(given["policy"], given.get("policy_options"))
        check_channels(group, policy)
        return policy
    if "policy_options" in given:
        shown = checks.shown(given["policy_options"])
        raise ValueError(f"policy_options={shown}: applies to a policy given by name; give policy too")
    return group.rules[0]


def adjust_one(data: WorldData, engine: Engine, agent: Body, name: str, value: float) -> None:
    """Change one ability of one agent: its speed, its turning limit, or one of its ranges."""
    group, row, bodies, limits = agent.group, agent.row, agent.group.bodies, data.limits
    if name == "turn_limit":
        (cosine,), (sine,) = turn_columns(value, 1)
        with deferred():
            bodies.turn_cosine[row], bodies.turn_sine[row] = cosine, sine
        return
    number = column(name, value, 1, limits.speed if name == "speed" else limits.range)[0]
    if name == "speed":
        bodies.speed[row] = number
    else:
        with deferred():
            group.ranges[name == "awareness_range"][row] = number
            engine.is_bound = False
