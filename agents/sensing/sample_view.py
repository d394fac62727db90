"""Random views for the check of sensors and its tests, with neighbour lists made in Python."""

from __future__ import annotations

import numpy as np

from teamsight.agents.sensing.interface import View, salt_of
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.noise import Stream, key_of, stream_number
from teamsight.world.proximity.shapes import farthest_of
from teamsight.world.sight import Sight, open_sight


def sample_view(
    observers: int, others: int, side: float, rng: np.random.Generator, *, among: bool = False, coincide: bool = False,
    sight: Sight | None = None, square: bool = False,
) -> View:  # fmt: skip
    """Return a random view.

    Parameters
    ----------
    observers, others : int
        The numbers of observers, and of observed agents that are no observers.
    side : float
        The side of the square that contains all agents [ranges].
    rng : numpy.random.Generator
        The generator.
    among : bool, default False
        Whether the observers are among the observed, in the middle of the others.
    coincide : bool, default False
        Whether all agents are at one place.
    sight : Sight, optional
        What blocks the sight; nothing by default.
    square : bool, default False
        Whether ranges are squares.
    """
    position = rng.uniform(0, side, (observers, 2))
    observed = rng.uniform(0, side, (others, 2))
    own = others // 2 if among else -1
    if among:
        observed = np.insert(observed, own, position, axis=0)
    if coincide:
        position[:], observed[:] = 0.0, 0.0
    angle = rng.uniform(0, 2 * np.pi, observers)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    reach = rng.uniform(0.8, 1.2, observers)
    # Some identities and numbers of members are left out, as after removals.
    everyone = np.sort(rng.choice(3 * len(observed) + 3, len(observed), replace=False)) + 1
    member = np.sort(rng.choice(3 * observers + 3, observers, replace=False))
    way = observed - position[:, np.newaxis]
    apart = np.abs(way).max(axis=-1, initial=0.0) if square else np.hypot(way[..., 0], way[..., 1])
    near = apart <= reach[:, np.newaxis]
    if among:
        near[np.arange(observers), own + np.arange(observers)] = False
    start = np.concatenate([[0], np.cumsum(near.sum(axis=1))])
    offset = way[near]
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    in_range = NeighbourList(start, np.ascontiguousarray(np.nonzero(near)[1]), offset, distance)
    key = key_of(int(rng.integers(2**53)))
    return View(
        np.array([int(rng.integers(10_000))]), key, salt_of("targets"), stream_number(Stream.SENSOR, 1), member,
        position, heading, reach, everyone, own, in_range, sight or open_sight(),
        farthest_of("square" if square else "disc"),
    )  # fmt: skip
