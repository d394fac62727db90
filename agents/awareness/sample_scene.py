"""Random teams and targets for the check of degrees of awareness, with neighbour lists made in Python."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import Scene, TeamGroup
from teamsight.core.neighbour_list import NeighbourList, no_neighbours
from teamsight.policies.interface import Floats, Integers
from teamsight.world.proximity.shapes import farthest_of


class Sample(NamedTuple):
    """The surroundings of one group of a team among targets.

    Attributes
    ----------
    scene : Scene
        Its scene, with an empty `team`.
    groups : list of TeamGroup
        The groups of the team.
    team_identity, target_identity : ndarray, int64
        The identities of all robots and of all targets.
    """

    scene: Scene
    groups: list[TeamGroup]
    team_identity: Integers
    target_identity: Integers

    @property
    def team_size(self) -> int:
        """Number of robots of the team; 1 without a team, as worlds count for `Awareness.width`."""
        return max(len(self.team_identity), 1)


def sample_scene(
    sizes: tuple[int, ...], group: int, targets: int, side: float, rng: np.random.Generator, *, coincide: bool = False,
    square: bool = False,
) -> Sample:  # fmt: skip
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
    square : bool, default False
        Whether ranges are squares.
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
    members = [slice(*edges) for edges in pairwise(np.cumsum([0, *sizes]).tolist())]
    shape = "square" if square else "disc"
    far = farthest_of(shape)
    groups = [
        TeamGroup(of.start, heading[of], reach[of], _neighbours(robots[of], reach[of], prey, what, shape)[0], far)
        for of in members
    ]
    mine = members[group]
    teammates, place = _neighbours(robots[mine], aware[mine], robots, who, shape, mine.start)
    scene = Scene(
        heading[mine], reach[mine], aware[mine], groups[group].targets, teammates, place, mine.start, [], far
    )
    return Sample(scene, groups, who, what)


def without_team(sample: Sample) -> Sample:
    """Return the scene of the same group without a team, as targets are."""
    empty = np.zeros(0, np.int64)
    scene = sample.scene._replace(teammates=no_neighbours(len(sample.scene.heading)), place=empty, first=0)
    return sample._replace(scene=scene, groups=[], team_identity=empty)


def _neighbours(
    observers: Floats, reach: Floats, observed: Floats, identity: npt.NDArray[np.int64], shape: str,
    own: int | None = None,
) -> tuple[NeighbourList, Integers]:
    """Return the neighbours, and their indices among the observed; `own` is that of the first observer."""
    way = observed - observers[:, np.newaxis]
    apart = np.hypot(way[..., 0], way[..., 1]) if shape == "disc" else np.abs(way).max(axis=-1, initial=0.0)
    near = apart <= reach[:, np.newaxis]
    if own is not None:
        near[np.arange(len(near)), own + np.arange(len(near))] = False
    offset, place = way[near], np.nonzero(near)[1]
    start = np.concatenate([[0], np.cumsum(near.sum(axis=1))])
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    return NeighbourList(start, identity[place], offset, distance), place
