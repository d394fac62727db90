"""Membership: making a group from what a user gives, changing what it can do, and letting agents leave."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight import checks
from teamsight.agents.awareness import Awareness
from teamsight.agents.body import Body
from teamsight.agents.fit import awareness_of, check_fit, check_needs, policy_of
from teamsight.agents.group import Group
from teamsight.world import placement as placements
from teamsight.world.bodies import Bodies
from teamsight.world.motion import turn_limit as turn_limit_of
from teamsight.world.noise import Stream, stream_number, uniforms

if TYPE_CHECKING:
    from teamsight.agents.model import World
    from teamsight.world.arena import Arena

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
        raise TypeError(f"agent_class={agent_class!r}: must be Robot, Target or a subclass")
    size = checks.count("count", count, most=MOST_AGENTS)
    number = len(world.groups)
    policy, awareness = policy_of(plan.policy), awareness_of(plan.awareness)
    bodies, ranges = make_bodies(world, number, size, plan)
    name = plan.name or _free_name(world, f"{agent_class.__name__.lower()}s")
    if name in [group.name for group in world.groups]:
        raise ValueError(f"name={name!r}: another group has this name; give one of its own")
    group = Group(name, number, agent_class.team, bodies, ranges, policy, awareness)
    check_needs(group)
    group.plan = plan
    return group


def make_bodies(world: World, number: int, size: int, plan: Plan) -> tuple[Bodies, tuple[Floats, Floats]]:
    """Return the bodies of a group at the beginning, and their sensing and awareness ranges."""
    sensing = _column("sensing_range", plan.sensing_range, size, above=0)
    ranges = sensing, _column("awareness_range", plan.awareness_range, size, above=0)
    for reach in ranges:
        world.arena.check_reach(float(reach.max()))
    numbers = uniforms(world.key, stream_number(Stream.PLACEMENT, number), 0, np.arange(size), 3)
    angle = 2 * math.pi * numbers[2]
    limits = _column("turn_limit", math.pi if plan.turn_limit is None else plan.turn_limit, size, least=0)
    cosine, sine = _turn_columns(limits)
    bodies = Bodies(
        identity=np.zeros(size, np.int64),
        member=np.arange(size),
        position=_positions(world.arena, plan.placement, numbers[:2], float(sensing.max())),
        heading=np.ascontiguousarray(np.stack([np.cos(angle), np.sin(angle)], axis=-1)),
        moved=np.zeros((size, 2)),
        speed=_column("speed", plan.speed, size, least=0),
        turn_cosine=cosine,
        turn_sine=sine,
        arena_size=np.array(world.arena.size),
    )
    return bodies, ranges


def _free_name(world: World, name: str) -> str:
    taken = {group.name for group in world.groups}
    count = 2
    free = name
    while free in taken:
        free, count = f"{name}-{count}", count + 1
    return free


def _column(name: str, value: npt.ArrayLike, size: int, **limits: float) -> Floats:
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.dtype.kind == "b":
        raise TypeError(f"{name}={value!r}: must be a number, or one for each agent")
    if array.shape not in ((), (size,)):
        raise ValueError(f"{name}: has the shape {array.shape}; give one number, or {size}, one for each agent")
    for number in np.unique(array) if array.size > 1 else array.ravel():
        checks.number(name, float(number), **limits)
    return np.array(np.broadcast_to(array, size), float)


def _positions(arena: Arena, placement: str | npt.ArrayLike, numbers: Floats, radius: float) -> Floats:
    if isinstance(placement, str):
        if checks.choice("placement", placement, ("uniform", "spread")) == "spread":
            return placements.spread(arena, numbers, radius)
        return placements.uniform(arena, numbers)
    return checked_positions(arena, placement, (numbers.shape[1], 2))


def checked_positions(arena: Arena, value: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Return positions that lie in the arena.

    Raises
    ------
    ValueError
        If the shape is wrong, a number is not finite, or a position lies outside.
    """
    try:
        position = np.array(value, float)
    except (TypeError, ValueError):
        raise TypeError(f"position={value!r}: must be numbers of shape {shape}") from None
    if position.shape != shape:
        raise ValueError(f"position: has the shape {position.shape}; it must be {shape}")
    inside = arena.contains(position) & np.isfinite(position).all(axis=-1)
    if not inside.all():
        wrong = position[~inside][0] if position.ndim == 2 else position
        raise ValueError(f"position={tuple(wrong.tolist())}: must be two finite numbers inside {arena}")
    return position


def populate(world: World, group: Group, agent_class: type[Body]) -> None:
    """Make the mesa agents of a group; identities are their unique ids."""
    group.agents = [agent_class(world, group, row) for row in range(len(group))]
    group.bodies.identity[:] = [agent.unique_id for agent in group.agents]
    group.decides_alone = agent_class.decide is not Body.decide
    group.begin()


def adjust(world: World, group: Group, **changes: Any) -> None:
    """Change what a group can do; see `World.adjust`."""
    size = len(group)
    sensing, aware = group.ranges
    if changes["sensing_range"] is not None:
        sensing = _column("sensing_range", changes["sensing_range"], size, above=0)
    if changes["awareness_range"] is not None:
        aware = _column("awareness_range", changes["awareness_range"], size, above=0)
    for reach in (sensing, aware):
        world.arena.check_reach(float(reach.max(initial=0.0)))
    speed, limits = group.bodies.speed, None
    if changes["speed"] is not None:
        speed = _column("speed", changes["speed"], size, least=0)
    if changes["turn_limit"] is not None:
        limits = _column("turn_limit", changes["turn_limit"], size, least=0)
    policy, awareness = group.rules
    if changes["awareness"] is not None:
        awareness = awareness_of(changes["awareness"])
    if changes["policy"] is not None:
        policy = policy_of(changes["policy"])
    before = group.rules
    group.rules = policy, awareness
    try:
        check_fit(group, team_of(world.groups, group))
    except ValueError:
        group.rules = before
        raise
    group.ranges = sensing, aware
    group.bodies.speed = speed
    if limits is not None:
        group.bodies.turn_cosine, group.bodies.turn_sine = _turn_columns(limits)
    if policy is not before[0]:
        group.begin()


def _turn_columns(limits: Floats) -> tuple[Floats, Floats]:
    cosine, sine = np.array([turn_limit_of(limit) for limit in limits]).reshape(-1, 2).T
    return np.ascontiguousarray(cosine), np.ascontiguousarray(sine)


def drop(group: Group, agent: Body) -> None:
    """Take one agent out of a group's arrays; the others keep their state."""
    keep = np.arange(len(group)) != agent.row
    memory = group.memory
    group.bodies = group.bodies.rows(keep)
    group.ranges = group.sensing_range[keep], group.awareness_range[keep]
    group.columns = {name: array[keep] for name, array in group.columns.items()}
    group.agents.pop(agent.row)
    for row, other in enumerate(group.agents):
        other.row = row
    group.begin()
    group.memory = _rows(memory, keep)


def _rows(memory: Any, keep: npt.NDArray[np.bool_]) -> Any:
    """Return the rows to keep of all arrays with a row for each agent, however a policy has put them together."""
    if isinstance(memory, np.ndarray) and memory.shape[:1] == keep.shape:
        return np.ascontiguousarray(memory[keep])
    if isinstance(memory, dict):
        return {name: _rows(part, keep) for name, part in memory.items()}
    if isinstance(memory, (tuple, list)):
        parts = [_rows(part, keep) for part in memory]
        return type(memory)(*parts) if hasattr(memory, "_fields") else type(memory)(parts)
    return memory


def team_of(groups: list[Group], group: Group) -> list[Group]:
    """Return the groups that are teammates of a group, itself included; empty for one that is on no team."""
    return [other for other in groups if other.team == group.team] if group.team is not None else []


def steps_by_itself(group: Group) -> bool:
    """Whether the group's agents override mesa's ``step``."""
    import mesa

    return bool(group.agents) and type(group.agents[0]).step is not mesa.Agent.step
