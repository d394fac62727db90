"""Exceptions for steps that cannot be made. No body has moved and the clock has not advanced."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from teamsight.agents.engine.interacting import BAD_HEADING, BAD_POSITION, BAD_REWARD, BAD_SCORE, BAD_SPEED, RAISED
from teamsight.agents.engine.records import BAD_ACTION, GROW_DETECTION, OUTSIDE
from teamsight.world.motion import is_watched

if TYPE_CHECKING:
    from teamsight.agents.engine.records import WorldArrays
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group
    from teamsight.agents.world_data import WorldData


def failure(data: WorldData, status: int, where: int, tick: int) -> ValueError:
    """Return the exception for the status with which the loop ended, at a group and a tick."""
    group = data.groups[where]
    if status == OUTSIDE:
        return ValueError(
            f"{data.arena}: confine left an agent of {group.name} outside at tick {tick}; check the arena with "
            "check_arena()"
        )
    return ValueError(
        f"{type(group.policy).__name__}: an action of {group.name} at tick {tick} is not finite, or its heading is not "
        "a unit vector; check the policy with check_policy(), and a degree of awareness of your own with "
        "check_awareness(). To continue, give the group another policy, restore() a state or reset()"
    )


def keep_actions(groups: list[Group], status: int, where: int, *, has_decided: bool) -> None:
    """Mark the groups whose kernels had decided before a step failed: the next step carries their actions out.

    A move before a sensor that failed has been undone.
    """
    for group in groups[: where + 1] if status == BAD_ACTION else groups:
        group.has_decided = has_decided and group.is_compiled


def endless(groups: list[Group], relations: list[Relation], status: int, where: int) -> ValueError:
    """Return the exception for a component that asks for more room on every call."""
    if status == GROW_DETECTION:
        return endless_sensor(relations[where])
    return endless_growth(groups[where])


def endless_growth(group: Group) -> ValueError:
    """Return the exception for a degree of awareness that asks for more room on every call."""
    return ValueError(
        f"awareness={group.awareness!r}: perceive asks for more room on every call, for {group.name}; check the degree "
        "with check_awareness()"
    )


def endless_sensor(relation: Relation) -> ValueError:
    """Return the exception for a sensor that asks for more room on every call."""
    return ValueError(
        f"{_sensor_of(relation)}: sense asks for more room on every call; check the sensor with check_sensor()"
    )


def bad_sensing(relation: Relation, tick: int) -> ValueError:
    """Return the exception for a sensor whose list cannot be read."""
    observed = len(relation.everyone)
    return ValueError(
        f"{_sensor_of(relation)}: sense has written a wrong list for tick {tick}: `start` must ascend from 0 to at "
        f"most the number returned, indices lie in {-observed} … {observed - 1}, and offsets and distances finite; "
        "check the sensor with check_sensor(). To continue, set another one"
    )


def _sensor_of(relation: Relation) -> str:
    group = relation.observers
    return f"sensors[{relation.name!r}]={group.channels[relation.name].sensor!r} of {group.name}"


def bad_interaction(data: WorldData, world: WorldArrays, where: int) -> ValueError:
    """Return the exception for an interaction that has left something wrong."""
    progress, placed, found = world.progress[0], data.interactions[where], world.interactions[where].value.found
    x, y = found.tolist()
    cure = "check the interaction with check_interaction(). To continue, restore() a state or reset()"
    if progress["what"] == RAISED:
        return ValueError(
            f"{placed.name}: its kernel raised an exception at tick {int(progress['tick'])}, which is printed above; "
            f"{cure}"
        )
    if progress["what"] == BAD_SCORE:
        score = placed.interaction.scores[int(progress["need"])]
        return ValueError(f"{placed.name}: the score {score!r} is {x:g}; scores must be finite; {cure}")
    role = placed.interaction.roles[int(progress["need"])]
    wrong = {
        BAD_POSITION: f"at ({x:g}, {y:g}), which is outside {data.arena}; write positions inside the arena only",
        BAD_HEADING: f"with the heading ({x:g}, {y:g}); headings must be unit vectors",
        BAD_SPEED: f"with the speed {x:g}; speeds must be finite and at least 0",
        BAD_REWARD: f"with the reward {x:g}; rewards must be finite",
    }[int(progress["what"])]
    agent = placed.roles[role]._agents[int(progress["body"])]
    return ValueError(f"{placed.name}: its kernel left {agent!r} at tick {int(progress['tick'])} {wrong}; {cure}")


def check_places(data: WorldData) -> None:
    """Raise if an agent is outside a user-defined arena; others are not checked.

    Raises
    ------
    ValueError
        Naming the group and the position.
    """
    arena = data.arena
    if not is_watched(arena):
        return
    for group in data.groups:
        inside = np.asarray(arena.contains(group.bodies.position))
        if not inside.all():
            place = tuple(group.bodies.position[int(np.argmin(inside))].tolist())
            raise ValueError(
                f"{arena}: an agent of {group.name} is at {place}, which is outside according to contains(); check "
                "confine and place() of the arena with check_arena()"
            )
