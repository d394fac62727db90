"""Random teams and targets for the check of degrees of awareness, with neighbour lists made in Python."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.neighbour_list import NeighbourList, no_neighbours
from teamsight.policies.interface import Floats, Integers


class Sample(NamedTuple):
    """The surroundings of one group of a team among targets.

    Attributes
    ----------
    heading, sensing_range, awareness_range : ndarray
        Of the group's n robots; shapes (n, 2), (n,), (n,).
    targets, teammates : NeighbourList
        All within range of the group's robots.
    place : ndarray, shape (k,), int64
        For each entry of `teammates`, its index in the team.
    first : int
        The index in the team of the group's first robot.
    groups : list of (first, heading, sensing_range, targets)
        The same of each group of the team.
    team_identity, target_identity : ndarray, int64
        The identities of all robots and of all targets.
    """

    heading: Floats
    sensing_range: Floats
    awareness_range: Floats
    targets: NeighbourList
    teammates: NeighbourList
    place: Integers
    first: int
    groups: list[tuple[int, Floats, Floats, NeighbourList]]
    team_identity: Integers
    target_identity: Integers

    @property
    def team_size(self) -> int:
        """Number of robots of the team; 1 without a team, as worlds count for `Awareness.width`."""
        return max(len(self.team_identity), 1)


def sample_scene(
    sizes: tuple[int, ...], group: int, targets: int, side: float, rng: np.random.Generator, *, coincide: bool = False
) -> Sample:
    """Return a random sample.

    Parameters
    ----------
    sizes : tuple of int
        Sizes of the groups of the team.
    group : int
        The index of the group whose scene it is.
    targets : int
        The number of targets.
    side : float
        The side of the square that contains all agents [sensing ranges].
    rng : numpy.random.Generator
        The generator.
    coincide : bool, default False
        Whether all robots and the first target are at one place.
    """
    size = sum(sizes)
    robots = np.zeros((size, 2)) if coincide else rng.uniform(0, side, (size, 2))
    prey = rng.uniform(0, side, (targets, 2))
    if coincide:
        prey[:1] = 0.0
    # Some identities are left out, as after removals.
    identity = np.sort(rng.choice(3 * (size + targets) + 3, size + targets, replace=False)) + 1
    who, what = identity[:size], identity[size:]
    angle = rng.uniform(0, 2 * np.pi, size)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    reach, aware = rng.uniform(0.8, 1.2, size), rng.uniform(0.8, 1.2, size)
    first = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    groups = []
    for begin, end in pairwise(first):
        seen, _ = _neighbour_list(robots[begin:end], reach[begin:end], prey, what)
        groups.append((int(begin), heading[begin:end], reach[begin:end], seen))
    mine = slice(first[group], first[group + 1])
    teammates, place = _neighbour_list(robots[mine], aware[mine], robots, who, own=int(first[group]))
    return Sample(
        heading[mine],
        reach[mine],
        aware[mine],
        groups[group][3],
        teammates,
        place,
        int(first[group]),
        groups,
        who,
        what,
    )


def without_team(sample: Sample) -> Sample:
    """Return the scene of the same group without a team, as targets are."""
    none = no_neighbours(len(sample.heading))
    empty = np.zeros(0, np.int64)
    return sample._replace(teammates=none, place=empty, first=0, groups=[], team_identity=empty)


def _neighbour_list(
    observers: Floats, reach: Floats, observed: Floats, identity: npt.NDArray[np.int64], own: int | None = None
) -> tuple[NeighbourList, Integers]:
    """Return the neighbours, and their indices among the observed; `own` is that of the first observer."""
    start, index, offsets = [0], [], []
    for i, position in enumerate(observers):
        for j, other in enumerate(observed):
            way = other - position
            if np.hypot(*way) <= reach[i] and (own is None or j != own + i):
                index.append(j)
                offsets.append(way)
        start.append(len(index))
    place, offset = np.array(index, np.int64), np.array(offsets, float).reshape(-1, 2)
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    return NeighbourList(np.array(start, np.int64), identity[place], offset, distance), place
