"""The check of a sensor: its kernel on sample views, under guard and compared."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from teamsight.agents.sensing.sensor import DETECTING, Detecting, Floats, Sensor, View, salt_of, sense_entry
from teamsight.core.contracts import (
    Lists,
    check_offsets,
    class_name,
    descends,
    lists_in_any_room,
    lists_written,
    neighbours_of,
    numbers,
    random_headings,
    refuse_entries,
    rows_of,
    unwritten_list,
)
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.core.neighbour_list import NeighbourList
from teamsight.world.arena import Box
from teamsight.world.limits import farthest_of
from teamsight.world.motion import bodies_at
from teamsight.world.noise import Stream, key_of, stream_number
from teamsight.world.occlusion import GATHER_BODIES, gathering
from teamsight.world.search import proximity_graph
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
    heading, reach = random_headings(observers, rng), rng.uniform(0.8, 1.2, observers)
    # Some identities and numbers of members are left out, as after removals.
    everyone = np.sort(rng.choice(3 * len(observed) + 3, len(observed), replace=False)) + 1
    member = np.sort(rng.choice(3 * observers + 3, observers, replace=False))
    shape = "square" if square else "disc"
    if among:
        mine, far = slice(own, own + observers), np.zeros(len(observed))
        far[mine] = reach
        in_range = neighbours_of(mine, proximity_graph(observed, None, far, range_shape=shape))
    else:
        in_range = proximity_graph(position, observed, reach, range_shape=shape)
    key = key_of(int(rng.integers(2**53)))
    return View(
        np.array([int(rng.integers(10_000))]), key, salt_of("targets"), stream_number(Stream.SENSOR, 1), member,
        position, heading, reach, everyone, own, in_range, sight or open_sight(), farthest_of(shape),
    )  # fmt: skip


def _among_bodies(view: View, rng: np.random.Generator) -> View:
    """Return the view with bodies: those of the observers, which are observed, and others."""
    identity = view.everyone[view.own : view.own + len(view.position)]
    bodies = bodies_at(np.concatenate([view.position, rng.uniform(0, 2, (6, 2))]), random_headings(13, rng))
    bodies.radius[:], bodies.identity[:] = rng.uniform(0, 0.2, 13), [*identity, *range(1_000, 1_006)]
    record = gathering([bodies], Box(4.0, 4.0))
    GATHER_BODIES(record)
    return view._replace(identity=identity, opaque=record.value.opaque)


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
        "identities": Axis("observers", "there are view.identity.shape[0]"),
        "bodies": Axis("bodies", "there are view.opaque.x.shape[0]"),
        **{str(length): _COUNTED for length in (*range(1, 5), 7)},
    },
)

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
    name = class_name(sensor, Sensor, "Sensor(field_of_view=2.0)")
    numbers(f"{name}.parameters", sensor.parameters)
    begin_check()
    rng = np.random.default_rng(seed)
    views = [sample_view(observers, others, side, rng, among=among) for observers, others, side, among in _SCENES]
    views.append(sample_view(4, 3, 1.0, rng, among=True, coincide=True))
    segments = rng.uniform(0, 2, (3, 4))
    discs = np.column_stack([rng.uniform(0, 2, (2, 2)), rng.uniform(0.05, 0.3, 2)])
    views.append(sample_view(7, 9, 2.0, rng, among=True, sight=Sight(segments, discs, np.zeros(2), 0.0)))
    views.append(sample_view(7, 9, 2.0, rng, among=True, square=True))
    views.append(_among_bodies(sample_view(7, 9, 2.0, rng, among=True), rng))
    for view in views:
        less = (0, 1, int(view.in_range.start[-1]))
        sensed = lists_in_any_room(f"{name}: sense", partial(_sense, sensor, view), less)["sensed"]
        _check_entries(f"{name}: sense writes for observer", view, sensed)
    for view in views:
        _check_rows(name, sensor, view)


def _sense(sensor: Sensor, view: View, room: int) -> tuple[int, Lists]:
    """Run `sense` under guard; return its answer and what it wrote."""
    parameters, blank = np.ascontiguousarray(sensor.parameters, float), unwritten_list(len(view.heading), room)
    given = Detecting(view, parameters, blank)
    need, done = _GUARD.run(type(sensor).__name__, "sense", sense_entry(sensor), given)
    return need, {"sensed": done.sensed}


def _check_rows(name: str, sensor: Sensor, view: View) -> None:
    """Check that what a sensor writes for one view does not depend on row numbers."""

    def seen(view: View) -> Floats:
        # Which agent a false detection shows may depend on all of them.
        sensed = lists_written(f"{name}: sense", partial(_sense, sensor, view))["sensed"]
        return sensed.offset[sensed.identity >= 0]

    before = seen(view)
    last = _with_observer(view, len(view.heading))
    for what, moved, cure in (
        ("observed agents", _shifted(view), "view.everyone[index]"),
        ("observers", _with_observer(view, 0), "view.member[i]"),
    ):
        if not np.array_equal(before, seen(moved)):
            # An observer behind the others leaves their rows as they are.
            if what == "observers" and not np.array_equal(before, seen(last)):
                raise ValueError(
                    f"{name}: sense writes something else if there is one observer more, far from all others; it may "
                    "read other observers than i, but only those nearby"
                )
            raise ValueError(
                f"{name}: sense writes something else if the {what} have other row numbers; noise must be a function "
                f"of {cure}, not of the row"
            )


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
    if len(view.identity):
        view = view._replace(identity=more(view.identity, 2**20))
    return view._replace(
        member=more(view.member, 2**20), position=more(view.position, _FAR), heading=more(view.heading, (1.0, 0.0)),
        reach=more(view.reach, 1.0), in_range=seen._replace(start=more(seen.start, seen.start[row])),
    )  # fmt: skip


def _check_entries(what: str, view: View, sensed: NeighbourList) -> None:
    """Check the indices, offsets and distances that a sensor writes for one view."""
    row, near, identity, size = rows_of(sensed), view.in_range, sensed.identity, len(view.everyone)
    index = np.where(identity >= 0, identity, ~identity)
    is_near = np.isin(row * size + index, rows_of(near) * size + near.identity)
    for wrong, text in (
        (
            index >= size,
            f"the index {{}}, but there are {size} observed agents; copy it from view.in_range.identity, or write "
            "~index for a false detection",
        ),
        (descends(row, index), "the index {} after one that is not smaller; they must ascend, each at most once"),
        ((identity >= 0) & ~is_near, "the index {}, which is not in range; write ~{} for a false detection"),
        ((view.own >= 0) & (index == view.own + row), "the observer itself, index {1}; leave out view.own + i"),
    ):
        refuse_entries(what, row, wrong, text, identity, index)
    check_offsets(what, sensed)
