"""The check of a sensor: its kernel on sample views, under guard and compared."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.agents.sensing.sensor import (
    DETECTING,
    Detecting,
    Detector,
    Floats,
    Integers,
    Sensor,
    View,
    salt_of,
    sense_entry,
)
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.core.neighbour_list import NeighbourList, filled
from teamsight.world.limits import farthest_of
from teamsight.world.noise import Stream, key_of, stream_number
from teamsight.world.walls import Sight, open_sight


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


_IN_RANGE = Axis("entries", "those of observer i are start[i] up to, not including, start[i + 1]")
_ENTRY = Axis("entries", "write no more than there is room for, and return how many are needed")
_COUNTED = Axis("elements", "that is all that there are")
_GUARD = Guard(
    DETECTING,
    ("sensed",),
    {
        "n": Axis("observers", "observers are 0 to n − 1, and n is view.heading.shape[0]"),
        "m": Axis("agents", "the observed are 0 to m − 1, and m is view.everyone.shape[0]"),
        "n + 1": Axis("elements", "there is one more than observers; observer i's are start[i] and start[i + 1]"),
        "k": _IN_RANGE,
        **{f"sensed.{name} k": _ENTRY for name in ("identity", "offset", "distance")},
        "p": Axis("parameters", "add what it needs to `parameters`"),
        "segments": Axis("segments", "there are view.sight.segments.shape[0]"),
        "discs": Axis("discs", "there are view.sight.discs.shape[0]"),
        **{str(length): _COUNTED for length in range(1, 5)},
    },
)

def sense_guarded(sensor: Detector, view: View, sensed: NeighbourList) -> tuple[int, NeighbourList]:
    """Run `sense` on copies of these arrays, with bounds checks; return its answer and what it wrote.

    Raises
    ------
    TypeError, ValueError
        If the kernel cannot be compiled, or uses elements outside its arrays; see `Guard`.
    """
    given = Detecting(view, np.ascontiguousarray(sensor.parameters, float), sensed)
    need, done = _GUARD.run(type(sensor).__name__, "sense", sense_entry(sensor), given)
    return need, done.sensed


_UNWRITTEN = -7_777_777
# Nothing changes between two calls, so the room that the first call returns must suffice.
_MOST_CALLS = 3
# A place so far away that no sensor should depend on who is there.
_FAR = 1e6

# Numbers of observers and of others, the side of the square [ranges], and whether observers are observed.
_SCENES = (
    (0, 0, 1.0, False),
    (1, 0, 1.0, True),
    (1, 5, 1.0, False),
    (4, 0, 1.5, True),
    (7, 9, 2.0, False),
    (7, 9, 2.0, True),
    (12, 30, 0.5, True),
    (6, 6, 20.0, False),
)


def check_sensor(sensor: Sensor, *, seed: int = 1) -> None:
    """Check whether a sensor keeps the contract of `Sensor`, on random scenes.

    Its kernel runs with bounds checks: on single observers, sparse and crowded scenes, with obstacles, and with buffers
    that are too small at first, as in a world.

    Parameters
    ----------
    sensor : Sensor
        The sensor to check.
    seed : int, default 1
        Seed of the scenes.

    Raises
    ------
    TypeError
        If it is not a `Sensor`, its parameters have the wrong type, or its kernel cannot be compiled.
    ValueError
        If the kernel accesses elements outside its arrays or writes read-only ones, if what it writes or returns is
        inconsistent, or if it depends on more than it may: on the content of its buffers, or on row numbers.
    """
    name = type(sensor).__name__
    if not isinstance(sensor, Sensor):
        name = sensor.__name__ if isinstance(sensor, type) else name
        raise TypeError(f"{name}: must be an object of Sensor or of a subclass, such as Sensor(field_of_view=2.0)")
    parameters = np.asarray(_parameters(name, sensor))
    if parameters.ndim != 1 or not np.isfinite(parameters).all():
        raise ValueError(f"{name}.parameters: must be finite numbers in one dimension; the shape is {parameters.shape}")
    begin_check()
    rng = np.random.default_rng(seed)
    views = [sample_view(observers, others, side, rng, among=among) for observers, others, side, among in _SCENES]
    views += [sample_view(4, 3, 1.0, rng, among=True, coincide=True), _with_obstacles(rng)]
    views.append(sample_view(7, 9, 2.0, rng, among=True, square=True))
    for view in views:
        _check_view(name, sensor, view)
    for view in views:
        _check_rows(name, sensor, view)


def _parameters(name: str, sensor: Sensor) -> Any:
    try:
        return np.asarray(sensor.parameters, float)
    except (TypeError, ValueError):
        kind = type(sensor.parameters).__name__
        raise TypeError(f"{name}.parameters: has the type {kind}; it must be an array of floats") from None


def _with_obstacles(rng: np.random.Generator) -> View:
    segments = np.column_stack([rng.uniform(0, 2, (3, 2)), rng.uniform(0, 2, (3, 2))])
    discs = np.column_stack([rng.uniform(0, 2, (2, 2)), rng.uniform(0.05, 0.3, 2)])
    return sample_view(7, 9, 2.0, rng, among=True, sight=Sight(segments, discs, np.zeros(2), 0.0))


def _check_view(name: str, sensor: Sensor, view: View) -> None:
    """Check what a sensor writes for one view."""
    ample = _sensed(name, sensor, view, 10_000)
    for room in (0, 1, int(view.in_range.start[-1])):
        found = _sensed(name, sensor, view, room)
        if any(not np.array_equal(a, b, equal_nan=True) for a, b in zip(found, ample, strict=True)):
            raise ValueError(
                f"{name}: sense writes something else after a call with too little room; do not depend on the content "
                "of the buffers"
            )
    for i in range(len(view.heading)):
        _check_observer(f"{name}: sense writes for observer {i}", view, ample, i)


def _check_rows(name: str, sensor: Sensor, view: View) -> None:
    """Check that what a sensor writes for one view does not depend on row numbers."""
    ample = _sensed(name, sensor, view, 10_000)
    for what, moved, cure in (
        ("observed agents", _shifted(view), "view.everyone[index]"),
        ("observers", _with_observer(view, 0), "view.member[i]"),
    ):
        # Which agent a false detection shows may depend on all of them.
        if not np.array_equal(_true_offsets(ample), _true_offsets(_sensed(name, sensor, moved, 10_000))):
            if what == "observers" and _reads_all_observers(name, sensor, view):
                raise ValueError(
                    f"{name}: sense writes something else if there is one observer more, far from all others; it may "
                    "read other observers than i, but only those nearby"
                )
            raise ValueError(
                f"{name}: sense writes something else if the {what} have other row numbers; noise must be a function "
                f"of {cure}, not of the row"
            )


def _reads_all_observers(name: str, sensor: Sensor, view: View) -> bool:
    """Return whether an observer far away changes what a sensor writes for the others, whose rows stay as they are."""
    last = len(view.heading)
    one, other = (_true_offsets(_sensed(name, sensor, each, 10_000)) for each in (view, _with_observer(view, last)))
    return not np.array_equal(one, other)


def _true_offsets(sensed: NeighbourList) -> Floats:
    return sensed.offset[sensed.identity >= 0]


def _shifted(view: View) -> View:
    """Return the view with one more observed agent, at the first place and out of every range."""
    seen = view.in_range
    everyone = np.concatenate([[0], view.everyone])
    return view._replace(
        everyone=everyone, own=view.own + (view.own >= 0), in_range=seen._replace(identity=seen.identity + 1)
    )


def _with_observer(view: View, row: int) -> View:
    """Return the view with one more observer in a row, far away and with nothing in range."""

    def more(array: Any, value: Any) -> Any:
        return np.insert(array, row, value, axis=0)

    seen, own = view.in_range, view.own + row
    if view.own >= 0:
        # It is observed too.
        seen = seen._replace(identity=seen.identity + (seen.identity >= own))
        view = view._replace(everyone=np.insert(view.everyone, own, 2**20))
    return view._replace(
        member=more(view.member, 2**20), position=more(view.position, _FAR), heading=more(view.heading, (1.0, 0.0)),
        reach=more(view.reach, 1.0), in_range=seen._replace(start=more(seen.start, seen.start[row])),
    )  # fmt: skip


def _sensed(name: str, sensor: Sensor, view: View, room: int) -> NeighbourList:
    """Return what `sense` writes with this room, or with as much more as it asks for."""
    for _ in range(_MOST_CALLS):
        need, sensed = sense_guarded(sensor, view, _blank(len(view.heading), room))
        if need <= room:
            break
        room = max(need + need // 4, 16)
    else:
        raise ValueError(f"{name}: sense asks for more room on every call, last for {need}; return what is needed")
    start = sensed.start
    if start[0] != 0 or (np.diff(start) < 0).any() or start[-1] > room:
        raise ValueError(
            f"{name}: sense writes sensed.start = {_short(start)}, with room for {room}; write all n + 1 elements: 0 "
            "first, then ascending, and the number of entries last"
        )
    if need < start[-1]:
        raise ValueError(f"{name}: sense returns {need}, but writes {start[-1]} entries; return how many are needed")
    return filled(sensed)


def _blank(size: int, room: int) -> NeighbourList:
    """Return buffers filled with values that show what was not written."""
    return NeighbourList(
        np.full(size + 1, _UNWRITTEN), np.full(room, _UNWRITTEN), np.full((room, 2), np.nan), np.full(room, np.nan)
    )


def _check_observer(what: str, view: View, sensed: NeighbourList, i: int) -> None:
    mine = slice(sensed.start[i], sensed.start[i + 1])
    identity, offset, distance = sensed.identity[mine], sensed.offset[mine], sensed.distance[mine]
    index = np.where(identity >= 0, identity, ~identity)
    if (index >= len(view.everyone)).any():
        wrong = identity[np.argmax(index >= len(view.everyone))]
        raise ValueError(
            f"{what} the index {wrong}, but there are {len(view.everyone)} observed agents; copy it from "
            "view.in_range.identity, or write ~index for a false detection"
        )
    if (np.diff(index) <= 0).any():
        raise ValueError(f"{what} the indices {_short(index)}; they must ascend, each at most once")
    if view.own >= 0 and (index == view.own + i).any():
        raise ValueError(f"{what} the observer itself, index {view.own + i}; leave out view.own + i")
    if not (np.isfinite(offset).all() and np.isfinite(distance).all()):
        raise ValueError(f"{what} an offset or a distance that is unwritten or not finite; write both")
    length = np.hypot(offset[:, 0], offset[:, 1])
    apart = np.abs(length - distance) > 1e-9 * (1.0 + length)
    if apart.any():
        k = int(np.argmax(apart))
        raise ValueError(
            f"{what} the distance {distance[k]:g} and an offset of length {length[k]:g}; they must be equal"
        )
    _check_true(what, view, identity[identity >= 0], i)


def _check_true(what: str, view: View, found: Integers, i: int) -> None:
    near = view.in_range.identity[view.in_range.start[i] : view.in_range.start[i + 1]]
    strange = ~np.isin(found, near)
    if strange.any():
        wrong = int(found[np.argmax(strange)])
        raise ValueError(f"{what} the index {wrong}, which is not in range; write ~{wrong} for a false detection")


def _short(numbers: Any) -> str:
    return f"{numbers[:6].tolist()}{' and so on' if len(numbers) > 6 else ''}"
