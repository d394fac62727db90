"""Readings: what a situation shows, one entry for each sector or teammate in which something is sensed."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.angles import direction
from teamsight.core.kernel import Entry, Record, inlined, plain
from teamsight.policies.interface import Floats
from teamsight.policies.memory import LazyMemory

#: Kinds of readings: a target to which no perceived teammate is nearer, one to which a teammate is nearer, a teammate.
KINDS = ("free target", "taken target", "teammate")
FREE, TAKEN, TEAMMATE = range(len(KINDS))
#: Ways in which inputs show where teammates are; see ``Awareness.teammate_layout``.
LAYOUTS = {"": 0, "sectors": 1, "offsets": 2}

_TURNS_PER_RADIAN = 0.15915494309189535


def compass(own: int, added: int, layout: str) -> Floats:
    """Return the unit vectors of the centres of all sectors, shape (own + added, 2); (0, 0) for other inputs.

    Parameters
    ----------
    own, added : int
        Numbers of inputs that show targets and teammates.
    layout : str
        A key of `LAYOUTS`.
    """
    unit = plain(direction)
    found = np.zeros((own + added, 2))
    found[:own] = [unit(sector / own) for sector in range(own)]
    if layout == "sectors":
        found[own:] = [unit(sector / added) for sector in range(added)]
    return found


@inlined
def teammates(inputs: int, own: int, layout: int) -> int:
    """Return how many teammates or sectors of teammates a situation has."""
    return inputs - own if layout == 1 else (inputs - own) // 2 if layout == 2 else 0


@inlined
def place_of(situation: Any, compass: Any, own: int, layout: int, number: int) -> tuple[float, float, float]:
    """Return distance and unit vector of a teammate, in units of the awareness range; a distance of 1 is none."""
    if layout == 1:
        return situation[own + number], compass[own + number, 0], compass[own + number, 1]
    x, y = direction(situation[own + 2 * number + 1])
    return situation[own + 2 * number], x, y


@inlined
def is_taken(
    x: float, y: float, square: float, situation: Any, compass: Any, own: int, layout: int, ratio: float
) -> bool:
    """Return whether a perceived teammate is nearer to a target than the robot.

    Parameters
    ----------
    x, y, square : float
        The target's place in units of the sensing range, and its distance squared.
    situation, compass, own, layout
        As for `place_of`.
    ratio : float
        Awareness range over sensing range.
    """
    for number in range(teammates(situation.shape[0], own, layout)):
        distance, unit_x, unit_y = place_of(situation, compass, own, layout, number)
        if distance < 1.0:
            way_x = ratio * distance * unit_x - x
            way_y = ratio * distance * unit_y - y
            if way_x * way_x + way_y * way_y < square:
                return True
    return False


class Reader(NamedTuple):
    """The record of reading all transitions of a memory.

    Attributes
    ----------
    situation : ndarray, shape (inputs, k), float32
        The situations, one column a transition.
    action : ndarray, shape (2, k), float32
        Rotation [rad] and distance [share of the speed].
    compass : ndarray, shape (inputs, 2), float64
        See `compass`.
    own, layout : int
        Number of inputs that show targets, and of the layout of the others.
    ratio, stride : float
        Awareness range and the distance of a full step, over the sensing range.
    kind, transition : ndarray, shape (readings,), int64
        Written: the kind of each reading and its transition.
    distance, moved : ndarray, shape (readings,), float64
        Written: the distance before and after the robot's own move, if the others stand still [ranges].
    found : ndarray, shape (1,), int64
        Written: the number of readings.
    """

    situation: Annotated[npt.NDArray[np.float32], "inputs", "k"]
    action: Annotated[npt.NDArray[np.float32], 2, "k"]
    compass: Annotated[Floats, "inputs", 2]
    own: int
    layout: int
    ratio: float
    stride: float
    kind: Annotated[npt.NDArray[np.int64], "readings"]
    transition: Annotated[npt.NDArray[np.int64], "readings"]
    distance: Annotated[Floats, "readings"]
    moved: Annotated[Floats, "readings"]
    found: Annotated[npt.NDArray[np.int64], 1]


READER = Record(Reader)
reader_at = READER.at


def _read(address: int) -> int:
    reader = reader_at(address)
    found = 0
    inputs, size = reader.situation.shape
    own, layout, ratio = reader.own, reader.layout, reader.ratio
    for i in range(size):
        situation = reader.situation[:, i]
        fraction = reader.action[0, i] * _TURNS_PER_RADIAN
        move_x, move_y = direction(fraction if fraction >= 0.0 else fraction + 1.0)
        step = reader.stride * reader.action[1, i]
        move_x *= step
        move_y *= step
        for sector in range(own):
            distance = float(situation[sector])
            if distance < 1.0:
                x = distance * reader.compass[sector, 0]
                y = distance * reader.compass[sector, 1]
                taken = is_taken(x, y, distance * distance, situation, reader.compass, own, layout, ratio)
                reader.kind[found] = TAKEN if taken else FREE
                reader.transition[found] = i
                reader.distance[found] = distance
                reader.moved[found] = math.sqrt((x - move_x) ** 2 + (y - move_y) ** 2)
                found += 1
        for number in range(teammates(inputs, own, layout)):
            distance, unit_x, unit_y = place_of(situation, reader.compass, own, layout, number)
            if distance < 1.0:
                x = distance * unit_x - move_x / ratio
                y = distance * unit_y - move_y / ratio
                reader.kind[found] = TEAMMATE
                reader.transition[found] = i
                reader.distance[found] = distance
                reader.moved[found] = math.sqrt(x * x + y * y)
                found += 1
    reader.found[0] = found
    return 0


_READ = Entry(_read)


class Readings(NamedTuple):
    """The readings of all situations of a memory.

    Attributes
    ----------
    kind, transition : ndarray, shape (readings,), int64
        The index in `KINDS`, and the transition.
    distance, moved : ndarray, shape (readings,), float64
        The distance before and after the robot's own move, if all others stand still [ranges].
    """

    kind: npt.NDArray[np.int64]
    transition: npt.NDArray[np.int64]
    distance: Floats
    moved: Floats


def readings_of(memory: LazyMemory, inputs: int, layout: str, ratio: float, stride: float) -> Readings:
    """Return the readings of the situations of a memory, in the order of transitions and inputs.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    inputs : int
        Number of components of a situation that are used.
    layout : str
        A key of `LAYOUTS`; "" if no input shows where teammates are.
    ratio : float
        Awareness range over sensing range.
    stride : float
        Distance of a full step over the sensing range.
    """
    table = memory.table[:inputs]
    most = int(np.count_nonzero(table < 1.0))
    room = Readings(np.zeros(most, np.int64), np.zeros(most, np.int64), np.zeros(most), np.zeros(most))
    found = np.zeros(1, np.int64)
    action = memory.table[memory.inputs : memory.inputs + 2]
    directions = compass(memory.own, inputs - memory.own, layout)
    reader = Reader(table, action, directions, memory.own, LAYOUTS[layout], ratio, stride, *room, found)
    _READ(READER.pack(reader))
    kind, transition, distance, moved = room
    count = int(found[0])
    return Readings(kind[:count], transition[:count], distance[:count], moved[:count])
