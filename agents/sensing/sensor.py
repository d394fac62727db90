"""Sensors: what robots detect of those in range, with noise, misses, false detections and blind angles."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.angles import direction, direction_after
from teamsight.core.component import Allowed, Component, NonNegative, Positive, Probability
from teamsight.core.kernel import Entry, Record, bits_of, float_of, inlined, kernel, scratch, specialise
from teamsight.core.neighbour_list import Filled, NeighbourList, filled, neighbour_room
from teamsight.world.arena import Arena
from teamsight.world.limits import farthest_of
from teamsight.world.noise import Stream, key_of, philox, stream_number
from teamsight.world.occlusion import Opaque, is_hidden, no_bodies
from teamsight.world.search import proximity_graph
from teamsight.world.walls import Sight, is_blocked, open_sight

#: The cosine of half the field of view (−2 if that is a full turn), the field of view [turns], the standard deviations
#: of distance [length] and bearing [turns], two probabilities, and what blocks the sight: nothing (0), obstacles and
#: walls (1), or bodies too (2).
COSINE, WIDTH, RANGE_NOISE, BEARING_NOISE, MISSED, FALSE_POSITIVES, OCCLUDED = range(7)

PER_RADIAN = 1.0 / (2.0 * math.pi)

#: The least distance of a noisy reading [range]: an agent that seems to be at the same place would have no bearing.
NEAREST = 1e-6


@inlined
def put(sensed: Any, edge: Any, index: int, x: float, y: float, distance: float) -> None:
    """Write one entry."""
    sensed.identity[edge] = index
    sensed.offset[edge, 0] = x
    sensed.offset[edge, 1] = y
    sensed.distance[edge] = distance


#: In place of an identity: the noise of an observer's false detections.
NOBODY = 2**32 - 1

# The parts of a float64.
_BIAS = 1023
_FRACTION = np.uint64(2**52 - 1)
_ONE = np.uint64(_BIAS << 52)

_ROOT = math.sqrt(2.0)
_LOG_2 = math.log(2.0)
FULL_TURN = 2.0 * math.pi

#: What blocks the sight of a sensor, beside obstacles and walls.
BODIES = "bodies"


@inlined
def words_of(view: Any, i: int, identity: Any) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64]:
    """Return four random words of 32 bits: those of observer `i` and of the observed agent with this identity.

    They depend on the observer's number within its group, on the agent's identity and on the tick, but not on the
    order or the number of agents.

    Parameters
    ----------
    view : View
        What the sensor starts from.
    i : int
        The observer.
    identity : int
        From `View.everyone`, or `NOBODY` for the observer's false detections.
    """
    return philox(
        np.uint64(view.tick[0]), np.uint64(view.member[i]), np.uint64(identity), np.uint64(view.stream),
        view.key[0] ^ view.salt[0], view.key[1] ^ view.salt[1],
    )  # fmt: skip


@inlined
def uniform(word: np.uint64) -> float:
    """Return the uniform number in (0, 1) of a word."""
    return (np.float64(np.int64(word)) + 0.5) * 2.0**-32  # type: ignore[no-any-return]


@inlined
def _minus_log(word: np.uint64) -> float:
    """Return −ln of the uniform number of a word, to within 1e-11 of its value.

    Unlike that of the mathematics library, it can be computed in SIMD lanes and is the same on every machine.
    """
    bits = bits_of(np.float64(np.int64(word)) + 0.5)
    power = np.int64(bits >> np.uint64(52)) - (_BIAS + 32)
    part = float_of((bits & _FRACTION) | _ONE)
    # From [1, 2) to [√½, √2), where the series converges fast.
    is_high = part > _ROOT
    part = 0.5 * part if is_high else part
    s = (part - 1.0) / (part + 1.0)
    t = s * s
    # Here and below sums are grouped so that their parts can be computed at the same time: nothing else waits.
    tt = t * t
    series = (1.0 + t * (1 / 3)) + tt * (1 / 5 + t * (1 / 7)) + tt * tt * ((1 / 9 + t * (1 / 11)) + tt * (1 / 13))
    return -((power + is_high) * _LOG_2 + 2.0 * s * series)  # type: ignore[no-any-return]


@inlined
def normals(word: np.uint64, other: np.uint64) -> tuple[float, float]:
    """Return two independent standard normal numbers, from two words."""
    x, y = direction(uniform(other))
    length = math.sqrt(2.0 * _minus_log(word))
    return length * x, length * y


@inlined
def rotation(turns: float) -> tuple[float, float]:
    """Return cosine and sine of any number of full turns, to within 1e-12; faster than `direction`."""
    quarter = np.rint(4.0 * turns)
    t = (turns - 0.25 * quarter) * FULL_TURN
    s = t * t
    ss = s * s
    sine = (1.0 - s * (1 / 6)) + ss * (1 / 120 - s * (1 / 5040)) + ss * ss * (1 / 362880 - s * (1 / 39916800))
    sine = t * (sine + ss * ss * ss * (1 / 6227020800))
    cosine = (1.0 - s * 0.5) + ss * (1 / 24 - s * (1 / 720)) + ss * ss * (1 / 40320 - s * (1 / 3628800))
    cosine += ss * ss * ss * (1 / 479001600 - s * (1 / 87178291200))
    which = int(quarter)
    x = -sine if which & 1 else cosine
    y = cosine if which & 1 else sine
    return (-x if which & 2 else x), (-y if which & 2 else y)


@inlined
def _candidate(view: Any, i: int, first: int, edge: int, sensed: Any, word: Any) -> int:
    """Return a random agent that is not the observer and not among those that it senses; −1 if there is none."""
    myself = view.own + i if view.own >= 0 else -1
    count = view.everyone.shape[0] - (edge - first) - (myself >= 0)
    if count <= 0:
        return -1
    index = int(uniform(word) * count)
    # Skip those that are excluded, in ascending order; the observer is one of them.
    for k in range(first, edge):
        if 0 <= myself < sensed.identity[k]:
            index += myself <= index
            myself = -1
        index += sensed.identity[k] <= index
    return index + (0 <= myself <= index)


@inlined
def _turned(x: float, y: float, turns: float) -> tuple[float, float]:
    """Return a direction rotated by a number of full turns."""
    cosine, sine = direction_after(turns)
    return cosine * x - sine * y, sine * x + cosine * y


@inlined
def _perimeter_of(x: float, y: float) -> float:
    """Return how far along the sides of the square of half-width 1 a direction points: 0 to 8, from (1, −1) on."""
    wide = abs(x)
    high = abs(y)
    if wide >= high:
        return 1.0 + y / wide if x > 0.0 else 5.0 - y / wide
    return 3.0 - x / high if y > 0.0 else 7.0 + x / high


@inlined
def _on_square(heading_x: float, heading_y: float, width: float, share: float) -> tuple[float, float]:
    """Return the point of the sides of the square of half-width 1 at this share of the field of view.

    All sides are at the same distance from the centre. So equal lengths of them, seen from there, cover equal areas.
    """
    x, y = _turned(heading_x, heading_y, -0.5 * width)
    first = _perimeter_of(x, y)
    length = 8.0
    if width < 1.0:
        x, y = _turned(heading_x, heading_y, 0.5 * width)
        length = _perimeter_of(x, y) - first
        length = length + 8.0 if length < 0.0 else length
    at = first + share * length
    at = at - 8.0 if at >= 8.0 else at
    if at < 2.0:
        return 1.0, at - 1.0
    if at < 4.0:
        return 3.0 - at, 1.0
    return (-1.0, 5.0 - at) if at < 6.0 else (at - 7.0, -1.0)


@kernel
def _imagine(view: Any, i: int, first: int, edge: int, parameters: Any, sensed: Any) -> int:
    """Write a false detection of observer `i`, if it does not sense all others; return the next entry."""
    words = words_of(view, i, NOBODY)
    index = _candidate(view, i, first, edge, sensed, words[1])
    if index < 0:
        return edge
    at = edge
    while at > first and sensed.identity[at - 1] > index:
        x = sensed.offset[at - 1, 0]
        y = sensed.offset[at - 1, 1]
        put(sensed, at, sensed.identity[at - 1], x, y, sensed.distance[at - 1])
        at -= 1
    # Uniform over the area in view.
    away = view.reach[i] * math.sqrt(uniform(words[2]))
    if view.farthest > 1.0:
        x, y = _on_square(view.heading[i, 0], view.heading[i, 1], parameters[WIDTH], uniform(words[3]))
        put(sensed, at, ~index, away * x, away * y, away * math.sqrt(x * x + y * y))
    else:
        x, y = _turned(view.heading[i, 0], view.heading[i, 1], (uniform(words[3]) - 0.5) * parameters[WIDTH])
        put(sensed, at, ~index, away * x, away * y, away)
    return edge + 1


@inlined
def _draw_false(view: Any, first: int, chance: Any) -> None:
    """Draw for the observers from `first` on whether they have a false detection, as many as there is room for."""
    tick = np.uint64(view.tick[0])
    stream = np.uint64(view.stream)
    k0 = view.key[0] ^ view.salt[0]
    k1 = view.key[1] ^ view.salt[1]
    # In SIMD lanes, unlike the rest, which few observers need.
    for c in range(np.uint64(min(chance.shape[0], view.member.shape[0] - first))):
        member = np.uint64(view.member[np.uint64(first) + c])
        words = philox(tick, member, np.uint64(NOBODY), stream, k0, k1)
        chance[c] = uniform(words[0])


@inlined
def close_rows(view: Any, parameters: Any, here: int, until: int, edge: Any, sensed: Any, chance: Any) -> int:
    """End the entries of the observers from `here` to `until` − 1 with their false detections; return the next.

    `chance` is work space. All observers are closed once, in ascending order.
    """
    for i in range(here, until):
        at = i % chance.shape[0]
        if at == 0:
            _draw_false(view, i, chance)
        if chance[at] < parameters[FALSE_POSITIVES]:
            edge = _imagine(view, i, sensed.start[i], edge, parameters, sensed)
        sensed.start[i + 1] = edge
    return edge  # type: ignore[no-any-return]


#: The number of agents in range that are processed at once.
CHUNK = 64


class Chunk(NamedTuple):
    """The selected entries of a chunk of the agents in range, and their noise.

    Attributes
    ----------
    entry, row : ndarray, shape (CHUNK,), int64
        The entry of `View.in_range`, and its observer.
    member, identity : ndarray, shape (CHUNK,), uint64
        What selects the noise.
    away, turn, chance : ndarray, shape (CHUNK,), float64
        Two normal numbers, for distance and bearing, and a uniform one.
    cosine, sine : ndarray, shape (CHUNK,), float64
        Of the error of the bearing.
    """

    entry: Integers
    row: Integers
    member: Words
    identity: Words
    away: Floats
    turn: Floats
    chance: Floats
    cosine: Floats
    sine: Floats


@inlined
def _select(view: Any, parameters: Any, span: tuple[int, int, int], chunk: Any) -> tuple[int, int]:
    """Select the entries in view from the first to the last of the span, and note what their noise depends on.

    The span's third number is the observer of the first entry. Returns the number of entries selected, and the observer
    of the last entry.
    """
    seen = view.in_range
    is_blind = view.sight.segments.shape[0] + view.sight.discs.shape[0] > 0 and parameters[OCCLUDED] > 0.0
    has_bodies = view.opaque.x.shape[0] > 0 and parameters[OCCLUDED] > 1.0
    # Unsigned here and below: numba would check each signed index for a negative value.
    count = np.uint64(0)
    i = np.uint64(span[2])
    for k in range(np.uint64(span[0]), np.uint64(span[1])):
        while k >= np.uint64(seen.start[i + np.uint64(1)]):
            i += np.uint64(1)
        x = seen.offset[k, 0]
        y = seen.offset[k, 1]
        ahead = x * view.heading[i, 0] + y * view.heading[i, 1]
        is_seen = ahead >= seen.distance[k] * parameters[COSINE]
        if is_blind and is_seen:
            is_seen = not is_blocked(view.position[i, 0], view.position[i, 1], x, y, view.sight)
        if has_bodies and is_seen:
            mine = view.identity[i]
            other = view.everyone[np.uint64(seen.identity[k])]
            is_seen = not is_hidden(view.position[i, 0], view.position[i, 1], x, y, mine, other, view.opaque)
        # Written in any case, since a branch would be mispredicted.
        chunk.entry[count] = k
        chunk.row[count] = i
        chunk.member[count] = np.uint64(view.member[i])
        chunk.identity[count] = np.uint64(view.everyone[np.uint64(seen.identity[k])])
        count += np.uint64(is_seen)
    found: Any = np.int64(count)
    last: Any = np.int64(i)
    return found, last


@inlined
def _draw(view: Any, parameters: Any, count: int, chunk: Any) -> None:
    """Draw the noise of the selected entries."""
    tick = np.uint64(view.tick[0])
    stream = np.uint64(view.stream)
    k0 = view.key[0] ^ view.salt[0]
    k1 = view.key[1] ^ view.salt[1]
    lanes = np.uint64((count + 7) & ~7)
    for c in range(np.uint64(count), lanes):
        chunk.member[c] = np.uint64(0)
        chunk.identity[c] = np.uint64(0)
    for c in range(lanes):
        first, second, third, _ = philox(tick, chunk.member[c], chunk.identity[c], stream, k0, k1)
        chunk.member[c] = first
        chunk.identity[c] = second
        chunk.chance[c] = uniform(third)
    if parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0:
        for c in range(lanes):
            chunk.away[c], chunk.turn[c] = normals(chunk.member[c], chunk.identity[c])
    if parameters[BEARING_NOISE] > 0.0:
        for c in range(lanes):
            chunk.cosine[c], chunk.sine[c] = rotation(parameters[BEARING_NOISE] * chunk.turn[c])


@inlined
def _put_noisy(view: Any, parameters: Any, c: int, chunk: Any, sensed: Any, edge: Any) -> None:
    """Write what an observer measures of the selected entry `c`."""
    seen = view.in_range
    k = np.uint64(chunk.entry[c])
    i = np.uint64(chunk.row[c])
    x = seen.offset[k, 0]
    y = seen.offset[k, 1]
    distance = seen.distance[k]
    if parameters[RANGE_NOISE] > 0.0:
        least = NEAREST * view.reach[i]
        scale = 1.0 / distance
        if distance <= least:
            x = view.heading[i, 0]
            y = view.heading[i, 1]
            scale = 1.0
        distance = min(max(distance + parameters[RANGE_NOISE] * chunk.away[c], least), view.reach[i] * view.farthest)
        x *= distance * scale
        y *= distance * scale
    if parameters[BEARING_NOISE] > 0.0:
        x, y = chunk.cosine[c] * x - chunk.sine[c] * y, chunk.sine[c] * x + chunk.cosine[c] * y
    put(sensed, edge, seen.identity[k], x, y, distance)


@inlined
def _append(view: Any, parameters: Any, c: Any, chunk: Any, sensed: Any, edge: Any) -> Any:
    """Write the selected entry `c`, unless it is missed; return the next entry."""
    if parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0:
        _put_noisy(view, parameters, c, chunk, sensed, edge)
    else:
        seen = view.in_range
        k = np.uint64(chunk.entry[c])
        put(sensed, edge, seen.identity[k], seen.offset[k, 0], seen.offset[k, 1], seen.distance[k])
    # Missed ones are written too, and overwritten by the next, since a branch would be mispredicted.
    return edge + (np.uint64(chunk.chance[c] >= parameters[MISSED]) if parameters[MISSED] > 0.0 else np.uint64(1))


@inlined
def _fill_starts(start: Any) -> None:
    """Write where the entries of each observer begin; so far only those that follow an observer with entries do."""
    end = 0
    for i in range(np.uint64(1), np.uint64(start.shape[0])):
        end = max(end, start[i])
        start[i] = end


@kernel
def standard_sense(view: Any, parameters: Any, sensed: Any) -> int:
    """Write what a `Sensor` senses; see there."""
    size = view.heading.shape[0]
    total = view.in_range.start[size]
    is_false = parameters[FALSE_POSITIVES] > 0.0
    most = total + (size if is_false else 0)
    if most > sensed.distance.shape[0]:
        return int(most)
    chunk = Chunk(
        scratch(CHUNK, np.int64), scratch(CHUNK, np.int64), scratch(CHUNK, np.uint64), scratch(CHUNK, np.uint64),
        scratch(CHUNK, np.float64), scratch(CHUNK, np.float64), scratch(CHUNK, np.float64),
        scratch(CHUNK, np.float64), scratch(CHUNK, np.float64),
    )  # fmt: skip
    chance = scratch(CHUNK, np.float64)
    is_random = parameters[RANGE_NOISE] > 0.0 or parameters[BEARING_NOISE] > 0.0 or parameters[MISSED] > 0.0
    last = 0
    here = 0
    edge = np.uint64(0)
    for i in range(np.uint64(size + 1)):
        sensed.start[i] = 0
    for first in range(0, total, CHUNK):
        count, last = _select(view, parameters, (first, min(first + CHUNK, total), last), chunk)
        if is_random:
            _draw(view, parameters, count, chunk)
        for c in range(np.uint64(count)):
            row = chunk.row[c]
            if is_false and here < row:
                edge = np.uint64(close_rows(view, parameters, here, row, np.int64(edge), sensed, chance))
                here = row
            edge = _append(view, parameters, c, chunk, sensed, edge)
            sensed.start[np.uint64(row) + np.uint64(1)] = edge
    if is_false:
        return int(close_rows(view, parameters, here, size, np.int64(edge), sensed, chance))
    _fill_starts(sensed.start)
    return int(sensed.start[size])


#: The largest delay [ticks]; the measurements of as many ticks are kept.
MOST_DELAY = 1_000

Delay = Annotated[int, Allowed(least=0, most=MOST_DELAY, cure="it is a number of ticks", unit="ticks")]


def checked_view(name: str, value: Any, *, cure: str) -> float:
    """Return a field of view [rad]; raise an error with this cure if it is not above 0."""
    if (given := checks.number(name, value)) <= 0:
        raise ValueError(f"{name}={given}: must be above 0 [rad] and at most 2π; {cure}")
    return checks.angle(name, value, FULL_TURN)


def _occluded(name: str, value: Any) -> Any:
    if not isinstance(value, (str, bool, np.bool_)):
        raise TypeError(f"{name}={checks.shown(value)}: must be True, False or {BODIES!r}")
    return checks.choice(name, value, [BODIES]) if isinstance(value, str) else checks.flag(name, value)


@dataclass(frozen=True)
class Sensor(Component):
    """The sensor of a group for one channel: by default exact, all around, within range and in line of sight.

    Parameters
    ----------
    field_of_view : float, default 2π
        The angle that it covers, centred on the heading [rad]; above 0, at most 2π.
    range_noise : float, default 0
        Standard deviation of distances [length].
    bearing_noise : float, default 0
        Standard deviation of bearings [rad]; at most π.
    missed : float, default 0
        Probability that an agent in view is not sensed at a tick.
    false_positives : float, default 0
        Probability that an observer senses at a tick an agent that is not there: a random agent of the observed groups
        that it does not sense at this tick appears at a random place in the field of view, within range; none if that
        agent is inactive.
    delay : int, default 0
        Time from measuring to the percept [ticks], at most `MOST_DELAY`. Until the first measurement arrives, the
        percept is empty.
    occluded : bool or "bodies", default True
        Whether obstacles and walls block its sight; with "bodies", active bodies that have a radius do too.
    range : float, optional
        Range of the sensor [length], for other channels than targets and teammates; those have the `sensing_range` and
        the `awareness_range` of the group.

    Attributes
    ----------
    sense : kernel
        ``sense(view, parameters, sensed)`` writes the neighbour list `sensed` for a `View`, and returns the number of
        entries that it needs. If there is less room than that, it is called again with more. `sensed.identity` holds
        the index among the observed, or ``~index`` for a false detection; indices ascend for each observer.

    Raises
    ------
    TypeError, ValueError
        If an option has the wrong type or is outside its limits.

    Notes
    -----
    Noisy distances saturate: a reading is at most the range, √2 times that if ranges are squares, and at least a
    millionth of the range. All noise is a function of
    the world's seed, the channel, the tick, the observer and the observed agent.

    A sensor of one's own is a subclass with another `sense` and the `parameters` that it reads; `check_sensor` checks
    it. Its `delay` and `range` work as here; its kernel has to implement the rest.

    *Departs:* the paper's sensors are exact and see all around (§3, §5).
    """

    field_of_view: Annotated[
        float,
        Allowed(
            above=0, most=FULL_TURN, check=partial(checked_view, cure="to sense nothing, use missed=1"), unit="rad"
        ),
    ] = FULL_TURN
    range_noise: Annotated[NonNegative, Allowed(unit="length")] = 0.0
    bearing_noise: Annotated[
        float, Allowed(least=0, most=math.pi, check=partial(checks.angle, most=math.pi), unit="rad")
    ] = 0.0
    missed: Probability = 0.0
    false_positives: Probability = 0.0
    delay: Delay = 0
    occluded: Annotated[bool | Literal["bodies"], Allowed(check=_occluded)] = True
    range: Annotated[Positive, Allowed(unit="length")] | None = None

    sense: ClassVar[Callable[..., int]] = standard_sense

    def __repr__(self) -> str:
        values = [(each, getattr(self, each.name)) for each in fields(self)]
        changed = ", ".join(f"{each.name}={value!r}" for each, value in values if value != each.default)
        return f"{type(self).__name__}({changed})"

    @property
    def parameters(self) -> npt.NDArray[np.float64]:
        """The constants that the kernel reads, shape (p,)."""
        is_all_round = self.field_of_view >= FULL_TURN
        return np.array([
            -2.0 if is_all_round else math.cos(0.5 * self.field_of_view), self.field_of_view * PER_RADIAN,
            self.range_noise, self.bearing_noise * PER_RADIAN,
            self.missed, self.false_positives, 2.0 if self.occluded == BODIES else self.occluded,
        ])  # fmt: skip

    @property
    def is_perfect(self) -> bool:
        """Whether it senses exactly what is in range, at once; if `occluded`, where no obstacle blocks its sight."""
        is_standard = type(self).sense is Sensor.sense and type(self).parameters is Sensor.parameters
        is_noisy = self.range_noise or self.bearing_noise or self.missed or self.false_positives or self.delay
        misses_some = self.field_of_view < FULL_TURN or self.occluded == BODIES
        return is_standard and not misses_some and not is_noisy

    def detect(
        self,
        observers: npt.ArrayLike,
        observed: npt.ArrayLike | None,
        heading: npt.ArrayLike,
        reach: npt.ArrayLike,
        *,
        arena: Arena | None = None,
        range_shape: str = "disc",
        seed: int = 0,
        tick: int = 0,
    ) -> NeighbourList:
        """Return what observers sense at once, without a world; `delay` and `range` have no effect here.

        Parameters
        ----------
        observers : array_like, shape (n, 2)
            Positions [length].
        observed : array_like, shape (m, 2), or None
            Positions [length]; None for the observers among themselves.
        heading : array_like, shape (n, 2)
            The observers' headings, unit vectors.
        reach : float or array_like, shape (n,)
            The range of each observer [length].
        arena : Arena, optional
            The arena, with what blocks the sight. By default the plane.
        range_shape : {"disc", "square"}
            The shape of ranges.
        seed, tick : int, default 0
            The noise is a function of these two.

        Returns
        -------
        NeighbourList
            `identity` holds the row in `observed`, or ``~row``, −1 − row, for a false detection.

        Raises
        ------
        ValueError
            If an array has the wrong shape, a heading is not a unit vector, or bodies block its sight.
        """
        if self.occluded == BODIES:
            raise ValueError(
                "detect: knows no radius of bodies, and occluded='bodies'; use the sensor in a world, or occluded=True"
            )
        in_range = proximity_graph(observers, observed, reach, arena, range_shape=range_shape)
        position = np.array(observers, float)
        size = len(position)
        facing = np.array(heading, float)
        if facing.shape != (size, 2) or not np.allclose(np.hypot(*facing.T), 1.0, rtol=0, atol=1e-6):
            raise ValueError(f"heading: must be {size} unit vectors, of shape ({size}, 2), one for each observer")
        view = View(
            np.array([checks.count("tick", tick, least=0)]), key_of(seed), salt_of("targets"),
            stream_number(Stream.SENSOR, 0), np.arange(size), position, facing,
            np.array(np.broadcast_to(np.asarray(reach, float), size)),
            np.arange(size if observed is None else len(np.asarray(observed))), 0 if observed is None else -1,
            in_range, arena.sight if arena else open_sight(), farthest_of(range_shape),
        )  # fmt: skip
        return detect(self, view)


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
    identity : ndarray, shape (n,) or (0,), int64
        The identities of the observers; empty if no bodies block their sight.
    opaque : Opaque
        The bodies that block sight, for a sensor with ``occluded="bodies"``.
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
    identity: Annotated[Integers, ".identities"] = np.zeros(0, np.int64)
    opaque: Opaque = no_bodies()


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
