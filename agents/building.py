"""Membership: making a group from what a user gives, changing what it can do, and letting agents leave."""

from __future__ import annotations

import math
from collections.abc import Callable
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents import mesa_compat
from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body
from teamsight.agents.engine.state_rows import take_rows
from teamsight.agents.group import Group, first_memory
from teamsight.agents.resolve import awareness_of, check_fit, check_needs, policy_of
from teamsight.core import checks
from teamsight.core.interrupts import deferred
from teamsight.policies.compiled import CompiledPolicy, check_memory
from teamsight.world.bodies import Abilities, Bodies
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.starts import Founders, starts

if TYPE_CHECKING:
    from teamsight.agents.model import World
    from teamsight.world.arena import Arena
    from teamsight.world.limits import Limits

MOST_AGENTS = 10_000_000
"""How many agents a group can have: more would not fit in the memory of any machine."""

Floats = npt.NDArray[np.float64]


class Plan(NamedTuple):
    """What a user gives for a group; as for `World.add`."""

    policy: Any
    awareness: Awareness | str
    sensing_range: npt.ArrayLike
    awareness_range: npt.ArrayLike
    speed: npt.ArrayLike
    turn_limit: npt.ArrayLike | None
    placement: str | npt.ArrayLike
    name: str | None


def make_group(world: World, agent_class: type[Body], count: int, plan: Plan) -> Group:
    """Return a new group, its agents still to be made."""
    if not isinstance(agent_class, type) or not issubclass(agent_class, Body):
        raise TypeError(f"agent_class={checks.shown(agent_class)}: must be Robot, Target or a subclass")
    size = checks.count("count", count, most=MOST_AGENTS)
    number = len(world.groups)
    policy, awareness = plan.policy, awareness_of(plan.awareness)
    abilities = _abilities(plan, size, world.limits)
    placement = _placement(world.arena, plan.placement, size)
    founders = Founders(number, size, placement, float(abilities.sensing_range.max()))
    start = starts(world.arena, [founders], world.key[np.newaxis])
    own = Abilities(*(column.copy() for column in abilities))
    bodies = Bodies(
        np.zeros(size, np.int64), np.arange(size), start.position[0], start.heading[0], np.zeros((size, 2)),
        own.speed, own.turn_cosine, own.turn_sine, np.array(world.arena.size),
    )  # fmt: skip
    ranges = own.sensing_range, own.awareness_range
    name = plan.name or _free_name(world, f"{agent_class.__name__.lower()}s")
    if name in [group.name for group in world.groups]:
        raise ValueError(f"name={name!r}: another group has this name; give one of its own")
    group = Group(name, number, agent_class.team, bodies, ranges, policy, awareness, world.adjust)
    check_needs(group)
    group.founders, group.first_abilities = founders, abilities
    return group


def _abilities(plan: Plan, size: int, limits: Limits) -> Abilities:
    """Return the abilities of a group's agents, all of them checked."""
    sensing = _column("sensing_range", plan.sensing_range, size, limits.range)
    aware = _column("awareness_range", plan.awareness_range, size, limits.range)
    turning = _turn_columns(math.pi if plan.turn_limit is None else plan.turn_limit, size)
    return Abilities(_column("speed", plan.speed, size, limits.speed), *turning, sensing, aware)


def _placement(arena: Arena, placement: str | npt.ArrayLike, size: int) -> str | Floats:
    if isinstance(placement, str):
        return checks.choice("placement", placement, ("uniform", "spread"))
    return checked_positions(arena, placement, (size, 2))


def _free_name(world: World, name: str) -> str:
    taken = {group.name for group in world.groups}
    count = 2
    free = name
    while free in taken:
        free, count = f"{name}-{count}", count + 1
    return free


def _column(name: str, value: npt.ArrayLike, size: int, check: Callable[[str, float], float]) -> Floats:
    """Return one number for each agent, all of them checked."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise TypeError(f"{name}={checks.shown(value)}: must be a number, or one for each agent") from None
    if array.dtype.kind not in "iuf":
        # What is no array of numbers may still be one number, such as a fraction or 10**400.
        if not isinstance(value, Real) or isinstance(value, bool):
            raise TypeError(f"{name}={checks.shown(value)}: must be a number, or one for each agent")
        array = np.asarray(check(name, value))
    if array.shape not in ((), (size,)):
        raise ValueError(f"{name}: has the shape {array.shape}; give one number, or {size}, one for each agent")
    for number in np.unique(array) if array.size > 1 else array.ravel():
        check(name, float(number))
    return np.array(np.broadcast_to(array, size), float)


def _turn_columns(limit: npt.ArrayLike, size: int) -> tuple[Floats, Floats]:
    """Return the cosines and sines of the turning limits."""
    angles = _column("turn_limit", limit, size, lambda name, number: checks.number(name, number, least=0))
    cosine, sine = np.array([turn_limit_of(angle) for angle in angles]).reshape(-1, 2).T
    return np.ascontiguousarray(cosine), np.ascontiguousarray(sine)


def checked_positions(arena: Arena, value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Return positions that lie in the arena.

    Raises
    ------
    ValueError
        If the shape is wrong, a number is not finite, or a position lies outside.
    """
    try:
        position = np.array(value, float)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"position={checks.shown(value)}: must be numbers of shape {shape}") from None
    if position.shape != shape:
        raise ValueError(f"position: has the shape {position.shape}; it must be {shape}")
    inside = arena.contains(position) & np.isfinite(position).all(axis=-1)
    if not inside.all():
        wrong = position[~inside][0] if position.ndim == 2 else position
        raise ValueError(f"position={tuple(wrong.tolist())}: must be two finite numbers inside {arena}")
    return position


def populate(world: World, group: Group, agent_class: type[Body]) -> None:
    """Add a group to its world and make its agents; identities are their unique ids.

    When an agent cannot be made, the world is left as it was.
    """
    first, before = mesa_compat.next_identity(world), len(world.groups)
    try:
        world.groups.append(group)
        group.agents = [agent_class(world, group, row) for row in range(len(group))]
        group.bodies.identity[:] = [agent.unique_id for agent in group.agents]
        group.decides_alone = agent_class.decide is not Body.decide
        world.change()
    except BaseException:
        with deferred():
            # Groups too that the class has added while its agents were made.
            gone = world.groups[before:]
            del world.groups[before:]
            # Those of a class that failed after mesa had registered them too.
            for agent in [agent for agent in world.agents if vars(agent).get("group") in gone]:
                world.deregister_agent(agent)
            mesa_compat.set_next_identity(world, first)
            for other in gone:
                world.leave_out(other)
        raise


def adjust(world: World, group: Group, **changes: Any) -> None:
    """Change what a group can do; see `World.adjust`. All is checked before anything changes."""
    given = {name: value for name, value in changes.items() if value is not None}
    size, limits, bodies = len(group), world.limits, group.bodies
    ranges = [
        _column(name, given[name], size, limits.range) if name in given else before
        for name, before in zip(("sensing_range", "awareness_range"), group.ranges, strict=True)
    ]
    speed = _column("speed", given["speed"], size, limits.speed) if "speed" in given else bodies.speed
    turning = bodies.turn_cosine, bodies.turn_sine
    if "turn_limit" in given:
        turning = _turn_columns(given["turn_limit"], size)
    policy, awareness = before = group.rules
    if "awareness" in given:
        awareness = awareness_of(given["awareness"])
    if "policy" in given:
        policy = policy_of(given["policy"], given.get("policy_options"))
    elif "policy_options" in given:
        raise ValueError(
            f"policy_options={checks.shown(given['policy_options'])}: needs a policy by name; give policy too"
        )
    try:
        group.rules = policy, awareness
        check_fit(group, team_of(world.groups, group))
        memory = first_memory(policy, size) if policy is not before[0] else None
    except BaseException:
        group.rules = before
        raise
    with deferred():
        group.ranges = ranges[0], ranges[1]
        bodies.speed, (bodies.turn_cosine, bodies.turn_sine) = speed, turning
        if policy is not before[0]:
            group.begin(memory)
        world.change()


def adjust_one(world: World, agent: Body, name: str, value: float) -> None:
    """Change what one agent can do: its speed, its turning limit, or one of its ranges."""
    group, row, bodies = agent.group, agent.row, agent.group.bodies
    if name == "turn_limit":
        (cosine,), (sine,) = _turn_columns(value, 1)
        with deferred():
            bodies.turn_cosine[row], bodies.turn_sine[row] = cosine, sine
        return
    number = _column(name, value, 1, world.limits.speed if name == "speed" else world.limits.range)[0]
    if name == "speed":
        bodies.speed[row] = number
    else:
        with deferred():
            group.ranges[name == "awareness_range"][row] = number
            world.change()


def drop(group: Group, agent: Body, leave: Callable[[], None]) -> None:
    """Take one agent out of a group's arrays; the others keep their state.

    Parameters
    ----------
    group : Group
        Its group.
    agent : Body
        Who leaves.
    leave : callable
        Takes the agent out of mesa's sets. Called once nothing else can fail.
    """
    size, row = len(group), agent.row
    keep = np.arange(size) != row
    memory = take_rows(group.memory, keep, size)
    if isinstance(group.policy, CompiledPolicy):
        check_memory(group.policy, memory, size - 1)
    columns = {name: array[keep] for name, array in group.columns.arrays().items()}
    leave()
    group.bodies = group.bodies.rows(keep)
    group.ranges = group.ranges[0][keep], group.ranges[1][keep]
    group.columns.replace(columns)
    group.agents.pop(row)
    for place, other in enumerate(group.agents):
        other.row = place
    group.begin(memory)


def team_of(groups: list[Group], group: Group) -> list[Group]:
    """Return the groups that are teammates of a group, itself included; empty for one that is on no team."""
    return [other for other in groups if other.team == group.team] if group.team is not None else []


def steps_by_itself(group: Group) -> bool:
    """Whether the group's agents override mesa's ``step``."""
    import mesa

    return bool(group.agents) and type(group.agents[0]).step is not mesa.Agent.step
