"""The layout of recorded frames: which words of a frame are whose, as long as groups and channels do not change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.channel import TEAMMATES
from teamsight.agents.engine.relation import Members, Relation
from teamsight.agents.recording.frame_kernel import UNIT, LinkArrays
from teamsight.agents.sensing.sensor import Sensor
from teamsight.world.arena import Arena
from teamsight.world.proximity.shapes import farthest_of

Integers = npt.NDArray[np.int64]

# Of so many bodies, counts and indices fit in a byte.
_MOST_NARROW = 255


class LinkLayout(NamedTuple):
    """The links of one relation.

    Attributes
    ----------
    channel : str
        The channel.
    counts : bool
        Whether what is sensed in it counts.
    measured : bool
        Whether offsets are recorded.
    scale : float
        The offset for which 32,767 stands [length]; 0 if there are none.
    has_range : bool
        Whether the teammates in range are counted apart from those that are shown.
    most : int
        How many links a frame holds; of more it holds none.
    observers, observed : ndarray, shape (n,) and (m,), int64
        The indices of both among all bodies.
    """

    channel: str
    counts: bool
    measured: bool
    scale: float
    has_range: bool
    most: int
    observers: Integers
    observed: Integers

    @property
    def is_wide(self) -> bool:
        """Whether counts and indices take two bytes each."""
        return len(self.observed) > _MOST_NARROW

    def is_like(self, other: LinkLayout) -> bool:
        """Whether another layout has the same words, if the bodies are the same."""
        return self[:6] == other[:6] and all(map(np.array_equal, self[6:], other[6:]))


class Layout(NamedTuple):
    """Which words of a frame are whose.

    Attributes
    ----------
    slots : ndarray, shape (bodies,), int64
        The slot of each body.
    size : int
        The number of slots in frames of this layout.
    is_conditional : bool
        Whether any body can be inactive.
    links : tuple of LinkLayout
        The relations.
    """

    slots: Integers
    size: int
    is_conditional: bool
    links: tuple[LinkLayout, ...]

    def is_like(self, other: Layout) -> bool:
        """Whether frames of another layout can follow frames of this one."""
        return (
            np.array_equal(self.slots, other.slots)
            and self.is_conditional == other.is_conditional
            and len(self.links) == len(other.links)
            and all(mine.is_like(theirs) for mine, theirs in zip(self.links, other.links, strict=True))
        )


def link_layouts(
    relations: list[Relation], first_body: dict[int, int], arena: Arena, most: int
) -> tuple[LinkLayout, ...]:  # fmt: skip
    """Return the layouts of all relations.

    Parameters
    ----------
    relations : list of Relation
        The relations of a world.
    first_body : dict of int to int
        The index of each group's first agent among all bodies.
    arena : Arena
        The arena.
    most : int
        How many links of a relation a frame holds.
    """
    # All relations of a channel are one list in a frame, with offsets or without.
    measured = {relation.name for relation in relations if _is_measured(_sensor(relation))}
    return tuple(
        LinkLayout(
            relation.name, relation.counts, relation.name in measured,
            _scale(relation, arena) if relation.name in measured else 0.0,
            relation.name == TEAMMATES and relation.detection is not None, most,
            _bodies([relation.observers], first_body), _bodies(relation.observed, first_body),
        )
        for relation in relations
    )  # fmt: skip


def link_arrays(relation: Relation, layout: LinkLayout) -> LinkArrays:
    """Return what the kernel copies of a relation: what its percepts show."""
    if layout.measured:
        shown = relation.room
        start, index, offset = shown.start, relation.place, shown.offset
    else:
        start, index = relation.true_lists
        offset = np.zeros((0, 2))
    in_range = relation.search.room.start if layout.has_range else np.zeros(0, np.int64)
    factor = UNIT / layout.scale if layout.scale else 0.0
    return LinkArrays(start, index, offset, in_range, factor, layout.is_wide, layout.most)


def most_bytes(arrays: LinkArrays) -> int:
    """Return how many bytes the links of a relation need at most."""
    observers = len(arrays.start) - 1 + max(len(arrays.in_range) - 1, 0)
    links = min(len(arrays.indices), arrays.most)
    return (observers + links) * (1 + arrays.is_wide) + 4 * links * (len(arrays.offset) > 0)


def _bodies(groups: Sequence[Members], first_body: dict[int, int]) -> Integers:
    """Return the indices of the agents of groups among all bodies."""
    rows = [np.arange(len(group)) + first_body[group.number] for group in groups]
    return np.concatenate([np.zeros(0, np.int64), *rows])


def _sensor(relation: Relation) -> Sensor | None:
    return relation.observers.channels[relation.name].sensor


def _is_measured(sensor: Sensor | None) -> bool:
    """Whether percepts may show agents elsewhere than they are."""
    if sensor is None:
        return False
    is_standard = type(sensor).sense is Sensor.sense and type(sensor).parameters is Sensor.parameters
    return not is_standard or any((sensor.range_noise, sensor.bearing_noise, sensor.false_positives, sensor.delay))


def _scale(relation: Relation, arena: Arena) -> float:
    """Return the largest offset that percepts can show [length]."""
    sensor = _sensor(relation)
    low, high = arena.bounds
    diagonal = float(np.hypot(*(high - low)))
    if sensor is not None and type(sensor).sense is not Sensor.sense:
        return diagonal
    # Readings of the package's own sensors end at the range.
    own = sensor.range if sensor is not None and sensor.range is not None else None
    reach = own if own is not None else float(relation.observers.ranges[relation.name == TEAMMATES].max(initial=0.0))
    return min(reach * farthest_of(relation.observers.range_shape), diagonal) or diagonal
