"""The contract of sensors: which of the agents within range an observer senses, and where they appear to be."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Record, specialise
from teamsight.core.neighbour_list import Filled, NeighbourList, filled, neighbour_room
from teamsight.world.sight import Sight

if TYPE_CHECKING:
    from teamsight.agents.sensing.sensor import Sensor

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Words = npt.NDArray[np.uint64]


class View(NamedTuple):
    """What a sensor starts from: the agents of a channel within range of each of n observers.

    Attributes
    ----------
    tick : ndarray, shape (1,), int64
        The tick of these positions.
    key, salt : ndarray, shape (2,), uint64
        The world's noise key and the channel's `salt_of`. The key of the noise is `key` ^ `salt`.
    stream : int
        The stream of the noise.
    member : ndarray, shape (n,), int64
        The number of each observer within its group, never reused. It selects the observer's noise.
    position, heading : ndarray, shape (n, 2), float64
        Of the observers [length]; headings are unit vectors.
    reach : ndarray, shape (n,), float64
        The range of each observer [length].
    everyone : ndarray, shape (m,), int64
        The identities of the observed. They select the noise of an observer and an observed agent.
    own : int
        The index of observer 0 among the observed; −1 if the observers are not observed. Observer i is ``own + i``.
    in_range : NeighbourList
        The agents in range; `identity` holds indices among the observed, ascending for each observer.
    sight : Sight
        What blocks the line of sight.
    farthest : float
        The largest distance in range, over the range: 1 for discs, √2 for squares with sides along the axes.
    """

    tick: Annotated[Integers, 1]
    key: Annotated[Words, 2]
    salt: Annotated[Words, 2]
    stream: int
    member: Annotated[Integers, "n"]
    position: Annotated[Floats, "n", 2]
    heading: Annotated[Floats, "n", 2]
    reach: Annotated[Floats, "n"]
    everyone: Annotated[Integers, "m"]
    own: int
    in_range: Filled
    sight: Sight
    farthest: float = 1.0


def salt_of(channel: str) -> Words:
    """Return the salt of a channel: two 32-bit words, shape (2,), so that each channel has noise of its own."""
    word = hashlib.blake2b(channel.encode(), digest_size=8, person=b"teamsight").digest()
    return np.frombuffer(word, "<u4").astype(np.uint64)


class Detecting(NamedTuple):
    """The record of a sensor: the arguments of its kernel; see `Sensor`."""

    view: View
    parameters: Annotated[Floats, "p"]
    sensed: NeighbourList


DETECTING = Record(Detecting)
detecting_at = DETECTING.at


def sense_at(address: int) -> int:
    """Call `sense` of a sensor on the arrays of a record."""
    # Unpacked, because numba takes an attribute `view` for the method of arrays.
    view, parameters, sensed = detecting_at(address)
    return sense_kernel(view, parameters, sensed)  # type: ignore[name-defined,no-any-return]  # noqa: F821


def sense_entry(sensor: Sensor) -> Entry:
    """Return the entry that writes what a sensor senses; it returns the number of entries needed."""
    return specialise(sense_at, type(sensor).__name__, sense_kernel=type(sensor).sense)


def detect(sensor: Sensor, view: View) -> NeighbourList:
    """Return what a sensor senses of a view.

    Parameters
    ----------
    sensor : Sensor
        The sensor.
    view : View
        What it starts from.

    Returns
    -------
    NeighbourList
        `identity` holds the index among the observed, or ``~index``, −1 − index, for a false detection.
    """
    parameters, size = np.ascontiguousarray(sensor.parameters, float), len(view.heading)
    sensed = neighbour_room(size, int(view.in_range.start[-1]) + size)
    record, entry = DETECTING.pack(Detecting(view, parameters, sensed)), sense_entry(sensor)
    while (need := entry(record)) > len(sensed.identity):
        sensed = neighbour_room(size, need + need // 4)
        record.update(sensed=sensed)
    return filled(sensed)
