"""Detection: what sensors make of the agents in range, and readings on the way: to the percept, and to teammates."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import PAST, KeptLists, Past, TeamGroup, kept_lists, past_at
from teamsight.agents.channel import TARGETS, TEAMMATES
from teamsight.agents.sensing.sensor import (
    DETECTING,
    MOST_DELAY,
    Detecting,
    Sensor,
    View,
    put,
    salt_of,
    sense_entry,
    uniform,
)
from teamsight.core import checks
from teamsight.core.kernel import Entry, Packed, Record, call, kernel
from teamsight.core.neighbour_list import NeighbourList, neighbour_room
from teamsight.world.noise import Stream, philox, stream_number

if TYPE_CHECKING:
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class Readings:
    """The readings of a group in one channel. They belong to agents, so they survive changes of the groups.

    Parameters
    ----------
    delay : int
        The number of ticks from a measurement to the percept, at least 1.

    Attributes
    ----------
    arrays : KeptLists
        The lists.
    """

    def __init__(self, delay: int) -> None:
        self.delay = delay
        none = np.zeros(0, np.int64)
        self._observers, self._everyone = none, none
        self.arrays = kept_lists(delay + 1, 0, 0)

    def forget(self) -> None:
        """Drop all lists, in place."""
        self.arrays.tick[:] = -1

    def slots(self) -> list[tuple[int, int]]:
        """Return where each list is, and where it is to be after a change of `delay`, in the order of ticks."""
        tick = self.arrays.tick
        kept = [slot for slot in np.argsort(tick).tolist() if tick[slot] >= 0]
        return [(slot, int(tick[slot]) % (self.delay + 1)) for slot in kept[-self.delay - 1 :]]

    def fit(self, observers: Integers, everyone: Integers, room: int) -> None:
        """Adapt to the present agents, given by their identities, to a number of entries per list, and to `delay`.

        The lists of agents that have left, and entries that show them, are dropped; new agents have none.
        """
        old = self.arrays
        is_same = np.array_equal(observers, self._observers) and np.array_equal(everyone, self._everyone)
        if is_same and (len(old.tick), old.identity.shape[1]) == (self.delay + 1, room):
            return
        new = kept_lists(self.delay + 1, len(observers), room)
        row_of = {identity: row for row, identity in enumerate(self._observers.tolist())}
        place_of = {identity: place for place, identity in enumerate(everyone.tolist())}
        rows = [row_of.get(identity, -1) for identity in observers.tolist()]
        for slot, into in self.slots():
            new.tick[into] = old.tick[slot]
            kept: list[int] = []
            for row, before in enumerate(rows):
                if before >= 0:
                    entries = range(old.start[slot, before], old.start[slot, before + 1])
                    kept += [k for k in entries if int(old.identity[slot, k]) in place_of]
                new.start[into, row + 1] = len(kept)
            new.identity[into, : len(kept)] = old.identity[slot, kept]
            new.offset[into, : len(kept)] = old.offset[slot, kept]
            new.distance[into, : len(kept)] = old.distance[slot, kept]
            new.place[into, : len(kept)] = [place_of[identity] for identity in old.identity[slot, kept].tolist()]
        self.arrays, self._observers, self._everyone = new, observers.copy(), everyone.copy()


class Searched(NamedTuple):
    """What the search was made with, from which it can be read who is inactive; empty if nobody ever is.

    Attributes
    ----------
    reach : ndarray, shape (n,), float64
        Below 0 for observers that sense nobody.
    x : ndarray, shape (observed,), float64
        NaN for bodies that nobody senses.
    """

    reach: Annotated[npt.NDArray[np.float64], ".n"]
    x: Annotated[npt.NDArray[np.float64], ".observed"]


class DetectionArrays(NamedTuple):
    """The record of a detection.

    Attributes
    ----------
    sense, detecting
        The kernel of the sensor and its record.
    sensed : NeighbourList
        What the kernel writes: its identities are indices among the observed, or −1 − index for a false detection.
    everyone : ndarray, shape (observed,), int64
        The identities of the observed.
    identity, place : ndarray, shape (k,), int64
        For each entry of `sensed`, the identity and the index of the agent that it shows.
    true_start, true_index : ndarray, shape (n + 1,) and (k,), int64
        The indices of the agents that each observer detects, without false detections.
    tick : ndarray, shape (1,), int64
        The tick of the present positions.
    is_checked : bool
        Whether the list is checked, since the sensor is user-defined.
    delay : int
        The number of ticks until a percept shows a list.
    readings : KeptLists
        The lists that are not yet shown; empty without a delay.
    shown : NeighbourList
        What percepts show; with a delay, in arrays of its own.
    shown_place : ndarray, shape (k,), int64
        The index among the observed of each of its entries.
    searched : Searched
        Who is inactive.
    """

    sense: Entry
    detecting: Packed[Detecting]
    sensed: NeighbourList
    everyone: Annotated[Integers, "observed"]
    identity: Annotated[Integers, "room"]
    place: Annotated[Integers, "room"]
    true_start: Annotated[Integers, "n + 1"]
    true_index: Annotated[Integers, "room"]
    tick: Annotated[Integers, 1]
    is_checked: bool
    delay: int
    readings: KeptLists
    shown: NeighbourList
    shown_place: Annotated[Integers, ".shown"]
    searched: Searched


DETECTION = Record(DetectionArrays)
detection_at = DETECTION.at


@kernel
def _keep(readings: Any, tick: int, entries: Any, identity: Any, place: Any) -> None:
    """Keep the list of a tick until it is due; `identity` and `place` say whom its entries show."""
    slot = tick % readings.tick.shape[0]
    readings.tick[slot] = tick
    for i in range(entries.start.shape[0]):
        readings.start[slot, i] = entries.start[i]
    for k in range(entries.start[entries.start.shape[0] - 1]):
        readings.identity[slot, k] = identity[k]
        readings.place[slot, k] = place[k]
        readings.offset[slot, k, 0] = entries.offset[k, 0]
        readings.offset[slot, k, 1] = entries.offset[k, 1]
        readings.distance[slot, k] = entries.distance[k]


@kernel
def _show(readings: Any, due: int, shown: Any, place: Any) -> bool:
    """Show the list of a tick; none if nothing was measured then. Return whether there is one."""
    slot = due % readings.tick.shape[0]
    is_there = due >= 0 and readings.tick[slot] == due
    for i in range(shown.start.shape[0]):
        shown.start[i] = readings.start[slot, i] if is_there else 0
    for k in range(shown.start[shown.start.shape[0] - 1]):
        shown.identity[k] = readings.identity[slot, k]
        place[k] = readings.place[slot, k]
        shown.offset[k, 0] = readings.offset[slot, k, 0]
        shown.offset[k, 1] = readings.offset[slot, k, 1]
        shown.distance[k] = readings.distance[slot, k]
    return is_there


@kernel
def _leave_out_inactive(entries: Any, index: Any, searched: Any) -> None:
    """Leave out of a list the rows of inactive observers, and inactive bodies.

    `index` has for each entry the index among the observed, or −1 − index. The search has found nobody inactive, but
    sensors have false detections, and a list that was measured earlier may show bodies that are inactive now.
    """
    at = 0
    k = 0
    for i in range(entries.start.shape[0] - 1):
        end = entries.start[i + 1]
        senses = searched.reach.shape[0] == 0 or searched.reach[i] >= 0.0
        while k < end:
            body = index[k]
            if senses and not math.isnan(searched.x[body if body >= 0 else ~body]):
                index[at] = body
                put(entries, at, entries.identity[k], entries.offset[k, 0], entries.offset[k, 1], entries.distance[k])
                at += 1
            k += 1
        entries.start[i + 1] = at


@kernel
def _count_true(detection: Any, are_all_true: bool) -> None:
    """Write where the true detections of each observer begin."""
    start = detection.sensed.start
    if are_all_true:
        for i in range(np.uint64(start.shape[0])):
            detection.true_start[i] = start[i]
        return
    found = 0
    for i in range(start.shape[0] - 1):
        detection.true_start[i] = found
        for k in range(start[i], start[i + 1]):
            found += detection.sensed.identity[k] >= 0
    detection.true_start[start.shape[0] - 1] = found


@kernel
def _is_sound(detection: Any, need: int) -> bool:
    """Whether a list can be read: starts ascend, indices are those of observed agents, offsets are finite."""
    start, index, offset = detection.sensed.start, detection.sensed.identity, detection.sensed.offset
    observers = start.shape[0] - 1
    observed = detection.everyone.shape[0]
    # An observer senses each agent once at most; a kernel may ask for more room, but not for a number out of nowhere.
    if need < 0 or need > 64 * (observers * observed + 64):
        return False
    if need > detection.place.shape[0]:
        # It is written again, with more room.
        return True
    if start[0] != 0 or start[observers] > need:
        return False
    for i in range(observers):
        if start[i] > start[i + 1]:
            return False
    for k in range(start[observers]):
        sum_ = offset[k, 0] + offset[k, 1] + detection.sensed.distance[k]
        if not -observed <= index[k] < observed or not math.isfinite(sum_):
            return False
    return True


def _detect(address: int) -> int:
    """Apply the sensor to the agents in range; return the number of entries for which it needs room, −1 if it is wrong.

    That number is 0 if there was room.
    """
    detection = detection_at(address)
    need = call(detection.sense, detection.detecting)
    if detection.is_checked != 0 and not _is_sound(detection, need):
        return -1
    if need > detection.place.shape[0]:
        return need  # type: ignore[no-any-return]
    if detection.searched.reach.shape[0] > 0:
        _leave_out_inactive(detection.sensed, detection.sensed.identity, detection.searched)
    # Unsigned, because numba would check signed indices for negative values.
    size = np.uint64(detection.true_start.shape[0] - 1)
    entries = np.uint64(detection.sensed.start[size])
    found = np.uint64(0)
    for k in range(entries):
        index = detection.sensed.identity[k]
        is_true = index >= 0
        index = index if is_true else ~index
        detection.place[k] = index
        detection.identity[k] = detection.everyone[np.uint64(index)]
        # Written in any case, since a branch would be mispredicted.
        detection.true_index[found] = index
        found += np.uint64(is_true)
    _count_true(detection, found == entries)
    if detection.delay > 0:
        _keep(detection.readings, detection.tick[0], detection.sensed, detection.identity, detection.place)
        _show(detection.readings, detection.tick[0] - detection.delay, detection.shown, detection.shown_place)
        if detection.searched.reach.shape[0] > 0:
            _leave_out_inactive(detection.shown, detection.shown_place, detection.searched)
    return 0


DETECT = Entry(_detect)


def is_checked(sensor: Sensor) -> bool:
    """Whether the lists of a sensor are checked at each tick, since it is user-defined."""
    return type(sensor).sense is not Sensor.sense


class Detection:
    """The arrays of a sensor that a group uses in one channel.

    Parameters
    ----------
    sensor : Sensor
        The sensor.
    view : View
        What it starts from.
    readings : Readings or None
        The lists on their way, for a sensor with a delay.
    searched : Searched
        Who is inactive.

    Attributes
    ----------
    view : View
        What the sensor starts from.
    record : Packed of DetectionArrays
        The argument of `DETECT`.
    """

    def __init__(self, sensor: Sensor, view: View, readings: Readings | None, searched: Searched) -> None:
        self._sensor, self._readings, self._searched = sensor, readings, searched
        self.see(view)

    @property
    def arrays(self) -> DetectionArrays:
        """The arrays of the detection."""
        return self.record.value

    def see(self, view: View) -> None:
        """Start from other arrays; make room for all agents in range and a false detection of each observer."""
        self.view = view
        self.make_room(len(view.in_range.identity) + len(view.member))

    def grow(self, need: int) -> None:
        """Make room for this many entries and a quarter more."""
        self.make_room(need + need // 4)

    def make_room(self, room: int) -> None:
        """Make the arrays anew, with room for this many entries."""
        view, size = self.view, len(self.view.member)
        sensed = neighbour_room(size, room)
        identity, place, true_index = np.zeros((3, room), np.int64)
        shown, shown_place = sensed._replace(identity=identity), place
        readings = kept_lists(0, size, 0)
        if self._readings:
            self._readings.fit(view.member, view.everyone, room)
            readings, shown, shown_place = self._readings.arrays, neighbour_room(size, room), np.zeros(room, np.int64)
        parameters = np.ascontiguousarray(self._sensor.parameters, float)
        self.record = DETECTION.pack(DetectionArrays(
            sense_entry(self._sensor), DETECTING.pack(Detecting(view, parameters, sensed)), sensed, view.everyone,
            identity, place, np.zeros(size + 1, np.int64), true_index, view.tick,
            is_checked(self._sensor), self._sensor.delay, readings, shown, shown_place, self._searched,
        ))  # fmt: skip


class RelayArrays(NamedTuple):
    """The record of a relay of a group's targets and headings.

    Attributes
    ----------
    tick : ndarray, shape (1,), int64
        The tick of the present positions.
    delay : int
        The number of ticks until teammates know what the group senses.
    heading : ndarray, shape (n, 2), float64
        The present headings.
    targets : NeighbourList
        The targets that the group senses now.
    place : ndarray, shape (k,), int64
        The index of each of them among the observed.
    searched : Searched
        Which targets are inactive: nobody shows them. Without `reach`, since an inactive robot still relays.
    readings : KeptLists
        Those of the last ticks.
    headings : ndarray, shape (slots, n, 2), float64
        The headings of the last ticks.
    shown, shown_place, shown_heading
        What teammates know.
    """

    tick: Annotated[Integers, 1]
    delay: int
    heading: Annotated[Floats, "n", 2]
    targets: NeighbourList
    place: Annotated[Integers, ".place"]
    searched: Searched
    readings: KeptLists
    headings: Annotated[Floats, "slots", "n", 2]
    shown: NeighbourList
    shown_place: Annotated[Integers, ".shown"]
    shown_heading: Annotated[Floats, "n", 2]


RELAY = Record(RelayArrays)
_relay_at = RELAY.at


def _relay(address: int) -> int:
    """Keep the present targets and headings of a group, and show those that are due; none if there were none then."""
    here = _relay_at(address)
    slots = here.readings.tick.shape[0]
    _keep(here.readings, here.tick[0], here.targets, here.targets.identity, here.place)
    due = here.tick[0] - here.delay
    is_there = _show(here.readings, due, here.shown, here.shown_place)
    for i in range(here.heading.shape[0]):
        for axis in range(2):
            here.headings[here.tick[0] % slots, i, axis] = here.heading[i, axis]
            here.shown_heading[i, axis] = here.headings[due % slots, i, axis] if is_there else here.heading[i, axis]
    if here.searched.x.shape[0] > 0:
        _leave_out_inactive(here.shown, here.shown_place, here.searched)
    return 0


SHOW_LATE = Entry(_relay)


class RelayReadings(Readings):
    """The targets that a group has sensed in the last ticks, and its headings.

    Attributes
    ----------
    headings : ndarray, shape (slots, n, 2), float64
        The headings.
    """

    def __init__(self, delay: int) -> None:
        super().__init__(delay)
        self.headings = np.zeros((delay + 1, 0, 2))

    def fit(self, observers: Integers, everyone: Integers, room: int) -> None:
        """Adapt to the present agents; see `Readings.fit`."""
        row_of = {member: row for row, member in enumerate(self._observers.tolist())}
        old, self.headings = self.headings, np.zeros((self.delay + 1, len(observers), 2))
        for slot, into in self.slots():
            for row, member in enumerate(observers.tolist()):
                if member in row_of:
                    self.headings[into, row] = old[slot, row_of[member]]
        super().fit(observers, everyone, room)


def relays_of(groups: list[Group], tick: Integers) -> dict[tuple[int, int], Packed[RelayArrays]]:
    """Return the relays of a world, by the number of the group that relays and the delay, and forget all others."""
    found = {}
    for group in groups:
        team = [other for other in groups if group.team is not None and other.team == group.team]
        mine = sorted({delay_of(other) for other in team} - {0})
        for name in [name for name, kept in group.readings.items() if isinstance(kept, RelayReadings)]:
            if name not in map(_name, mine):
                del group.readings[name]
        for delay in mine:
            found[group.number, delay] = _relay_of(group, delay, tick)
    return found


def delay_of(group: Group) -> int:
    """Return the number of ticks after which a group knows of its teammates."""
    channel = group.channels.get(TEAMMATES)
    return channel.sensor.delay if channel and channel.sensor else 0


def _name(delay: int) -> str:
    return f"{TEAMMATES} after {delay}"


def _relay_of(group: Group, delay: int, tick: Integers) -> Packed[RelayArrays]:
    relation, targets = group.relations.get(TARGETS), group.room(TARGETS)
    readings = group.readings.setdefault(_name(delay), RelayReadings(delay))
    assert isinstance(readings, RelayReadings)
    room = len(targets.identity)
    readings.fit(group.bodies.member, relation.everyone if relation else np.zeros(0, np.int64), room)
    none = np.zeros(0, np.int64)
    x = relation.search.x if relation and relation.is_conditional else np.zeros(0)
    return RELAY.pack(RelayArrays(
        tick, delay, group.bodies.heading, targets, relation.place if relation else none, Searched(np.zeros(0), x),
        readings.arrays, readings.headings, neighbour_room(len(group), room), np.zeros(room, np.int64),
        group.bodies.heading.copy(),
    ))  # fmt: skip


class ReportsArrays(NamedTuple):
    """The record of the reports of a group, which are kept for a degree of awareness.

    Attributes
    ----------
    tick : ndarray, shape (1,), int64
        The tick of the present positions.
    loss : float
        The probability that a report is lost.
    key, salt : ndarray, shape (2,), uint64
        The world's noise key, and the salt of reports. The key of the noise is `key` ^ `salt`.
    stream : int
        The stream of the noise.
    member : ndarray, shape (n,), int64
        The number of each robot within its group.
    group : TeamGroup
        What the group senses now, and `past`, in which it is kept.
    target_place : ndarray, shape (k,), int64
        The index of each target among the observed.
    """

    tick: Annotated[Integers, 1]
    loss: float
    key: Annotated[npt.NDArray[np.uint64], 2]
    salt: Annotated[npt.NDArray[np.uint64], 2]
    stream: int
    member: Annotated[Integers, "n"]
    group: TeamGroup
    target_place: Annotated[Integers, ".targets"]


REPORTS = Record(ReportsArrays)
_reports_at = REPORTS.at


def _keep_reports(address: int) -> int:
    """Keep what a group senses at the present tick, without the teammates whose reports are lost."""
    here = _reports_at(address)
    group, past, tick = here.group, past_at(here.group.past[0]), here.tick[0]
    _keep(past.targets, tick, group.targets, group.targets.identity, here.target_place)
    slot = tick % past.links.tick.shape[0]
    for i in range(group.heading.shape[0]):
        past.heading[slot, i, 0] = group.heading[i, 0]
        past.heading[slot, i, 1] = group.heading[i, 1]
    links = past.links
    links.tick[slot] = tick
    at = 0
    for i in range(group.heading.shape[0]):
        links.start[slot, i] = at
        for k in range(group.teammates.start[i], group.teammates.start[i + 1]):
            if here.loss > 0.0:
                word = philox(
                    np.uint64(tick), np.uint64(here.member[i]), np.uint64(group.teammates.identity[k]),
                    np.uint64(here.stream), here.key[0] ^ here.salt[0], here.key[1] ^ here.salt[1],
                )[0]  # fmt: skip
                if uniform(word) < here.loss:
                    continue
            links.identity[slot, at] = group.teammates.identity[k]
            links.place[slot, at] = group.place[k]
            links.offset[slot, at, 0] = group.teammates.offset[k, 0]
            links.offset[slot, at, 1] = group.teammates.offset[k, 1]
            links.distance[slot, at] = group.teammates.distance[k]
            at += 1
    links.start[slot, group.heading.shape[0]] = at
    past.newest[0] = tick
    return 0


KEEP_REPORTS = Entry(_keep_reports)

_SALT = salt_of("reports")


class Reports(Readings):
    """The reports of a group at the last ticks: the teammates that it sensed, less those whose reports were lost.

    Attributes
    ----------
    targets : RelayReadings
        The targets that it sensed, and its headings.
    newest : ndarray, shape (1,), int64
        The tick of the newest.
    """

    def __init__(self) -> None:
        super().__init__(0)
        self.targets, self.newest = RelayReadings(0), np.full(1, -1)

    def forget(self) -> None:
        """Drop all reports, in place."""
        super().forget()
        self.targets.forget()


class Keeping(NamedTuple):
    """What a degree of awareness needs of the past of a team."""

    delay: int
    loss: float


def keeping_of(group: Group, team: list[Group]) -> tuple[Keeping, int] | None:
    """Return what the degree of a group needs of the past, and for how many ticks; None for nothing."""
    degree, awareness = type(group.awareness).__name__, group.awareness
    memory = awareness.memory(max(sum(map(len, team)), 1)) if team else 0
    if type(memory) is int and memory == 0 and awareness.loss == 0.0:
        return None
    memory = checks.count(f"{degree}.memory(…)", memory, least=0, most=MOST_DELAY)
    loss = checks.number(f"{degree}.loss", awareness.loss, least=0, most=1)
    return (Keeping(delay_of(group), loss), memory) if team else None


def reports_of(
    group: Group, keeping: Keeping, memory: int, sensed: TeamGroup, target_place: Integers, tick: Integers,
    key: npt.NDArray[np.uint64],
) -> ReportsArrays:  # fmt: skip
    """Return the record that keeps the reports of a group.

    Parameters
    ----------
    group : Group
        The group.
    keeping, memory : Keeping, int
        What is needed, and for how many ticks.
    sensed : TeamGroup
        What teammates know of the group without hops.
    target_place : ndarray, shape (k,), int64
        The index of each of its targets among the observed.
    tick : ndarray, shape (1,), int64
        The tick of the present positions.
    key : ndarray, shape (2,), uint64
        The key of the world's noise.
    """
    kept = group.readings.setdefault(_name_of(keeping), Reports())
    assert isinstance(kept, Reports)
    kept.delay = kept.targets.delay = memory
    relation, targets = group.relations[TEAMMATES], group.relations.get(TARGETS)
    kept.fit(group.bodies.member, relation.everyone, len(sensed.teammates.identity))
    kept.targets.fit(
        group.bodies.member, targets.everyone if targets else np.zeros(0, np.int64), len(sensed.targets.identity)
    )
    none = np.zeros(0)
    past = Past(
        kept.newest, kept.arrays, kept.targets.arrays, kept.targets.headings, relation.conditions.reach,
        relation.search.x if relation.is_conditional else none,
        targets.search.x if targets and targets.is_conditional else none,
    )
    stream = stream_number(Stream.SENSOR, group.number)
    now_and_before = sensed._replace(past=[PAST.pack(past)])
    return ReportsArrays(tick, keeping.loss, key, _SALT, stream, group.bodies.member, now_and_before, target_place)


def forget_reports(group: Group, needed: Iterable[Keeping]) -> None:
    """Forget the reports of a group that no degree needs any more."""
    names = set(map(_name_of, needed))
    for name in [name for name, kept in group.readings.items() if isinstance(kept, Reports) and name not in names]:
        del group.readings[name]


def _name_of(keeping: Keeping) -> str:
    return f"reports after {keeping.delay}, loss {keeping.loss!r}"
