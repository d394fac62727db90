"""Readings: what a situation shows, one entry for each sector or teammate in which something is sensed."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.angles import direction, direction_after
from teamsight.core.kernel import Entry, Record, below_8, inlined, lowest_bit, plain
from teamsight.policies.interface import Floats
from teamsight.policies.memory import LazyMemory

#: Kinds of readings: a target to which no perceived teammate is nearer, one to which a teammate is nearer, a teammate.
KINDS = ("free target", "taken target", "teammate")
FREE, TAKEN, TEAMMATE = range(len(KINDS))
#: Ways in which inputs show where teammates are; see ``Awareness.teammate_layout``.
LAYOUTS = ("", "sectors", "offsets")
_OFFSETS = LAYOUTS.index("offsets")

#: Inputs that `sensed` looks at in one call.
WORD = 64

_TURNS_PER_RADIAN = 0.15915494309189535
# Every second bit: of the inputs of a teammate the first is the distance, the second the bearing.
_DISTANCES = 0x5555555555555555


def unit_vectors(own: int, added: int, layout: str) -> Floats:
    """Return the directions of the centres of all sectors, shape (own + added, 2); (0, 0) for inputs that are none.

    Parameters
    ----------
    own, added : int
        Numbers of inputs that show targets and teammates.
    layout : str
        One of `LAYOUTS`.
    """
    found = np.zeros((own + added, 2))
    for first, sectors in ((0, own), (own, added if layout == "sectors" else 0)):
        for sector in range(sectors):
            found[first + sector] = plain(direction)(sector / sectors)
    return found


@inlined
def sensed(situation: Any, first: int, stop: int) -> Any:
    """Return a word in which bit i is set if input ``first + i`` is below 1, for `WORD` inputs before `stop`."""
    word = np.uint64(0)
    at = first
    end = min(first + WORD, stop)
    while at + 8 <= end:
        word |= below_8(situation, at, 1.0) << np.uint64(at - first)
        at += 8
    while at < end:
        word |= np.uint64(situation[at] < 1.0) << np.uint64(at - first)
        at += 1
    return word


@inlined
def teammates(situation: Any, first: int, stop: int, layout: int) -> Any:
    """Return a word in which bit i is set if input ``first + i`` is the distance of a perceived teammate."""
    word = sensed(situation, first, stop)
    return word & np.uint64(_DISTANCES) if layout == _OFFSETS else word


@inlined
def place(situation: Any, unit: Any, layout: int, own: int, at: int) -> tuple[float, float, float]:
    """Return the distance that input `at` shows, at least 0, and the direction as a unit vector.

    Parameters
    ----------
    situation : ndarray, shape (inputs,), float32
        The situation.
    unit : ndarray, shape (inputs, 2), float64
        See `unit_vectors`.
    layout, own : int
        Index in `LAYOUTS`, and the number of inputs that show targets.
    at : int
        The input; of a teammate's two inputs the first.
    """
    x, y = unit[at, 0], unit[at, 1]
    if layout == _OFFSETS and at >= own:
        turns = float(situation[at + 1])
        x, y = direction_after(turns)
    return max(float(situation[at]), 0.0), x, y


@inlined
def is_taken(situation: Any, unit: Any, layout: int, own: int, sector: int, word: Any, ranges: Any) -> bool:
    """Return whether a perceived teammate is nearer to the target in a sector than the robot.

    Parameters
    ----------
    situation, unit, layout, own
        As for `place`.
    sector : int
        The input that shows the target.
    word : int
        ``teammates(situation, own, inputs, layout)``, which is the same for all targets.
    ranges : tuple of float
        Sensing range and awareness range, in any unit.
    """
    distance, x, y = place(situation, unit, layout, own, sector)
    distance *= ranges[0]
    inputs = situation.shape[0]
    for first in range(own, inputs, WORD):
        if first > own:
            word = teammates(situation, first, inputs, layout)
        while word:
            bit, word = lowest_bit(word)
            at: Any = first + np.int64(bit)
            apart, to_x, to_y = place(situation, unit, layout, own, at)
            apart *= ranges[1]
            # By the law of cosines; a teammate at the robot's own place is not nearer.
            if 0.0 < apart < 2.0 * distance * (to_x * x + to_y * y):
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
    unit : ndarray, shape (inputs, 2), float64
        See `unit_vectors`.
    own, layout : int
        Number of inputs that show targets, and index in `LAYOUTS`.
    ratio, stride : float
        Awareness range and the distance of a full step, over the sensing range.
    row : ndarray, shape (inputs,), float32
        Room for one situation.
    kind, transition : ndarray, shape (readings,), int64
        Written: the kind of each reading and its transition.
    distance, moved : ndarray, shape (readings,), float64
        Written: the distance before and after the robot's own move, if the others stand still [ranges].
    found : ndarray, shape (1,), int64
        Written: the number of readings.
    """

    situation: Annotated[npt.NDArray[np.float32], "inputs", "k"]
    action: Annotated[npt.NDArray[np.float32], 2, "k"]
    unit: Annotated[Floats, "inputs", 2]
    own: int
    layout: int
    ratio: float
    stride: float
    row: Annotated[npt.NDArray[np.float32], "inputs"]
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
    own, layout = reader.own, reader.layout
    # Side by side, as in a percept.
    situation = reader.row
    for i in range(size):
        for at in range(inputs):
            situation[at] = reader.situation[at, i]
        turns = float(reader.action[0, i]) * _TURNS_PER_RADIAN
        move_x, move_y = direction_after(turns)
        step = reader.stride * reader.action[1, i]
        perceived = teammates(situation, own, inputs, layout)
        for at in range(inputs):
            if not situation[at] < 1.0 or (layout == _OFFSETS and at >= own and (at - own) % 2):
                continue
            distance, x, y = place(situation, reader.unit, layout, own, at)
            kind = TEAMMATE
            if at < own:
                taken = is_taken(situation, reader.unit, layout, own, at, perceived, (1.0, reader.ratio))
                kind = TAKEN if taken else FREE
            # Inputs of teammates are in awareness ranges.
            reach = step / reader.ratio if kind == TEAMMATE else step
            reader.kind[found] = kind
            reader.transition[found] = i
            reader.distance[found] = distance
            way_x, way_y = distance * x - reach * move_x, distance * y - reach * move_y
            reader.moved[found] = math.sqrt(way_x * way_x + way_y * way_y)
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
        One of `LAYOUTS`; "" if no input shows where teammates are.
    ratio : float
        Awareness range over sensing range.
    stride : float
        Distance of a full step over the sensing range.
    """
    table = memory.table[:inputs]
    most = int(np.count_nonzero(table < 1.0))
    room = Readings(np.zeros(most, np.int64), np.zeros(most, np.int64), np.zeros(most), np.zeros(most))
    row, found = np.zeros(inputs, np.float32), np.zeros(1, np.int64)
    action = memory.table[memory.inputs : memory.inputs + 2]
    unit = unit_vectors(memory.own, inputs - memory.own, layout)
    reader = Reader(table, action, unit, memory.own, LAYOUTS.index(layout), ratio, stride, row, *room, found)
    _READ(READER.pack(reader))
    kind, transition, distance, moved = room
    count = int(found[0])
    return Readings(kind[:count], transition[:count], distance[:count], moved[:count])
