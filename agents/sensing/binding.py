"""The record of a sensor, and the entry that calls its kernel on it."""

from __future__ import annotations

from functools import cache
from typing import Annotated, NamedTuple

import numpy as np

from teamsight.agents.sensing.interface import Detector, Floats, View
from teamsight.core.kernel import Entry, Record, specialise
from teamsight.core.neighbour_list import NeighbourList, filled, neighbour_room


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


_specialised = cache(specialise)


def sense_entry(sensor: Detector) -> Entry:
    """Return the entry that writes what a sensor senses; it returns the number of entries needed."""
    return _specialised(sense_at, type(sensor).__name__, sense_kernel=type(sensor).sense)


def detect(sensor: Detector, view: View) -> NeighbourList:
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
