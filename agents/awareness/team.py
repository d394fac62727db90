"""For kernels of degrees of awareness: what is known of a teammate, and how to show it."""

from __future__ import annotations

from typing import Any

from teamsight.agents.awareness.interface import team_group_at
from teamsight.core.kernel import inlined, kernel


@kernel
def group_of(team: Any, place: int) -> int:
    """Return the address, for `team_group_at`, of the group to which the robot with this index in the team belongs."""
    at = 0
    group = team_group_at(team[at])
    while place >= group.first + group.heading.shape[0]:
        at += 1
        group = team_group_at(team[at])
    return team[at]  # type: ignore[no-any-return]


@kernel
def teammate_heading(scene: Any, k: int) -> tuple[float, float]:
    """Return the heading of the teammate of entry `k` of ``scene.teammates``, a unit vector along the arena's axes."""
    group = team_group_at(group_of(scene.team, scene.place[k]))
    row = scene.place[k] - group.first
    return group.heading[row, 0], group.heading[row, 1]


@inlined
def show(seen: Any, k: int, shown: Any, at: int) -> int:
    """Copy entry `k` of a neighbour list to entry `at` of another, if it has room; return the number of the next."""
    if at < shown.distance.shape[0]:
        shown.identity[at] = seen.identity[k]
        shown.offset[at, 0] = seen.offset[k, 0]
        shown.offset[at, 1] = seen.offset[k, 1]
        shown.distance[at] = seen.distance[k]
    return at + 1


@inlined
def next_nearest(seen: Any, first: int, end: int, last: int) -> int:
    """Return the entry that follows `last` in order of distance, those at one distance in order of identity.

    Parameters
    ----------
    seen : NeighbourList
        Its entries from `first` up to `end` are those of one robot, in the order of identities.
    first, end : int
        These entries.
    last : int
        The entry before; −1 for none. After the farthest entry the result is −1.
    """
    found = -1
    for k in range(first, end):
        if last >= 0 and (
            seen.distance[k] < seen.distance[last] or (seen.distance[k] == seen.distance[last] and k <= last)
        ):
            continue
        if found < 0 or seen.distance[k] < seen.distance[found]:
            found = k
    return found
