"""Starts: the initial positions and headings of runs, each a function of the run's noise key."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record
from teamsight.world.arena import Arena
from teamsight.world.motion import is_watched
from teamsight.world.noise import Stream, philox, stream_number
from teamsight.world.placement import in_cells, spread

Points = npt.NDArray[np.float64]

_CHANNELS = 3


class Request(NamedTuple):
    """The record of a call of `_fill`; k runs, n agents."""

    keys: Annotated[npt.NDArray[np.uint64], "k", 2]
    stream: Annotated[npt.NDArray[np.int64], "n"]
    member: Annotated[npt.NDArray[np.int64], "n"]
    numbers: Annotated[Points, _CHANNELS, "k", "n"]


REQUEST = Record(Request)
request_at = REQUEST.at


class Founders(NamedTuple):
    """Agents of a group at the start of a run, which were added together or follow the same rule.

    Attributes
    ----------
    number : int
        The group's number in its world; it selects the noise.
    size : int
        Number of agents, n.
    placement : {"uniform", "spread", "cells"} or ndarray, shape (n, 2), float64
        The rule for their positions, or the positions [length].
    spacing : float
        The radius of the discs that "spread" keeps apart [length].
    heading : ndarray, shape (n, 2), float64, optional
        Unit vectors; by default they are drawn.
    first : int
        The number of the first within the group; it selects the noise.
    """

    number: int
    size: int
    placement: str | Points
    spacing: float
    heading: Points | None = None
    first: int = 0

    def cut(self, members: int) -> Founders:
        """Return those whose number within the group is less than `members`."""
        size = max(min(self.size, members - self.first), 0)
        placement = self.placement if isinstance(self.placement, str) else self.placement[:size]
        heading = None if self.heading is None else self.heading[:size]
        return self._replace(size=size, placement=placement, heading=heading)

    def followed_by(self, other: Founders) -> list[Founders]:
        """Return these and the next ones of the same group, as one if the same rule can place them together."""
        one, two = self.placement, other.placement
        placement: str | Points
        if isinstance(one, str) and isinstance(two, str) and one == two:
            placement = one
        elif isinstance(one, np.ndarray) and isinstance(two, np.ndarray):
            placement = np.concatenate([one, two])
        else:
            return [self, other]
        heading = None
        if self.heading is not None and other.heading is not None:
            heading = np.concatenate([self.heading, other.heading])
        elif self.heading is not None or other.heading is not None:
            return [self, other]
        size, spacing = self.size + other.size, max(self.spacing, other.spacing)
        return [self._replace(size=size, placement=placement, spacing=spacing, heading=heading)]


class Starts(NamedTuple):
    """The initial positions and headings of all agents, for each of k runs.

    Attributes
    ----------
    position : ndarray, shape (k, n, 2), float64
        [length]; one group after the other.
    heading : ndarray, shape (k, n, 2), float64
        Unit vectors.
    """

    position: Points
    heading: Points


def starts(arena: Arena, groups: Sequence[Founders], keys: npt.NDArray[np.uint64]) -> Starts:
    """Place the agents of all groups for several runs at once.

    Parameters
    ----------
    arena : Arena
        The arena of all runs.
    groups : sequence of Founders
        All groups of the world; those of one group follow one another.
    keys : ndarray, shape (k, 2), uint64
        The noise key of each run, from `noise.key_of`.

    Returns
    -------
    Starts
        Each run depends on its own key only; computing several at once saves time.

    Raises
    ------
    ValueError
        If the arena's ``place`` returns positions outside the arena.
    """
    numbers = _numbers(groups, keys)
    angle = 2 * math.pi * numbers[2]
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    last = list(accumulate(one.size for one in groups))
    for one, end in zip(groups, last, strict=True):
        if one.heading is not None:
            heading[:, end - one.size : end] = one.heading
    if not is_watched(arena) and all(isinstance(one.placement, str) and one.placement == "uniform" for one in groups):
        return Starts(np.ascontiguousarray(arena.place(*numbers[:2])), heading)
    position = np.empty_like(heading)
    for run in range(len(keys)):
        for one, end in zip(groups, last, strict=True):
            here = slice(end - one.size, end)
            position[run, here] = _places(arena, one, np.ascontiguousarray(numbers[:2, run, here]))
    return Starts(position, heading)


def _numbers(groups: Sequence[Founders], keys: npt.NDArray[np.uint64]) -> Points:
    """Return uniform numbers in (0, 1), shape (channels, k, n): those of `noise.uniforms` at tick 0."""
    sizes = [one.size for one in groups]
    stream = np.repeat([stream_number(Stream.PLACEMENT, one.number) for one in groups], sizes).astype(np.int64)
    member = np.concatenate([one.first + np.arange(one.size) for one in groups] or [np.zeros(0, np.int64)])
    keys = np.ascontiguousarray(keys, np.uint64)
    numbers = np.empty((_CHANNELS, len(keys), len(member)))
    _FILL(REQUEST.pack(Request(keys, stream, member, numbers)))
    return numbers


def _fill(address: int) -> int:
    keys, stream, member, numbers = request_at(address)
    for channel in range(_CHANNELS):
        for run in range(keys.shape[0]):
            for i in range(member.shape[0]):
                word, _, _, _ = philox(
                    np.uint64(0), np.uint64(member[i]), np.uint64(channel), np.uint64(stream[i]),
                    keys[run, 0], keys[run, 1],
                )  # fmt: skip
                numbers[channel, run, i] = (np.float64(np.int64(word)) + 0.5) * 2.0**-32
    return 0


_FILL = Entry(_fill)


def _places(arena: Arena, group: Founders, numbers: Points) -> Points:
    if not isinstance(group.placement, str):
        return group.placement
    if group.placement == "cells":
        return in_cells(arena, numbers)
    is_spread = group.placement == "spread"
    places = spread(arena, numbers, group.spacing) if is_spread else np.asarray(arena.place(*numbers))
    if is_watched(arena) and not (inside := np.asarray(arena.contains(places))).all():
        wrong = tuple(places[int(np.argmin(inside))].tolist())
        raise ValueError(
            f"{arena}: place() returns {wrong}, which is outside according to contains(); check the arena with "
            "check_arena()"
        )
    return places
