"""The check of a degree of awareness: its kernels on sample scenes, under guard and compared."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.interface import (
    SENSING,
    TEAM_GROUP,
    Awareness,
    Scene,
    Sensing,
    TeamGroup,
    check_width,
    perceive_entry,
    situate_entry,
)
from teamsight.core.kernel import Entry
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.core.neighbour_list import NeighbourList, filled, no_neighbours
from teamsight.policies.check import PERCEPT_AXES
from teamsight.policies.interface import Floats, Integers
from teamsight.world.limits import farthest_of


class Sample(NamedTuple):
    """The surroundings of one group of a team among targets.

    Attributes
    ----------
    scene : Scene
        Its scene, with an empty `team`.
    groups : list of TeamGroup
        The groups of the team.
    team_identity, target_identity : ndarray, int64
        The identities of all robots and of all targets.
    """

    scene: Scene
    groups: list[TeamGroup]
    team_identity: Integers
    target_identity: Integers

    @property
    def team_size(self) -> int:
        """Number of robots of the team; 1 without a team, as worlds count for `Awareness.width`."""
        return max(len(self.team_identity), 1)


def sample_scene(
    sizes: tuple[int, ...], group: int, targets: int, side: float, rng: np.random.Generator, *, coincide: bool = False,
    square: bool = False,
) -> Sample:  # fmt: skip
    """Return a random sample.

    Parameters
    ----------
    sizes : tuple of int
        Sizes of the groups of the team.
    group : int
        The index of the group whose scene it is.
    targets : int
        The number of targets.
    side : float
        The side of the square that contains all agents [sensing ranges].
    rng : numpy.random.Generator
        The generator.
    coincide : bool, default False
        Whether all robots and the first target are at one place.
    square : bool, default False
        Whether ranges are squares.
    """
    size = sum(sizes)
    robots = np.zeros((size, 2)) if coincide else rng.uniform(0, side, (size, 2))
    prey = rng.uniform(0, side, (targets, 2))
    if coincide:
        prey[:1] = 0.0
    # Some identities are left out, as after removals.
    identity = np.sort(rng.choice(3 * (size + targets) + 3, size + targets, replace=False)) + 1
    who, what = identity[:size], identity[size:]
    angle = rng.uniform(0, 2 * np.pi, size)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    reach, aware = rng.uniform(0.8, 1.2, size), rng.uniform(0.8, 1.2, size)
    members = [slice(*edges) for edges in pairwise(np.cumsum([0, *sizes]).tolist())]
    shape = "square" if square else "disc"
    far = farthest_of(shape)
    groups = [
        TeamGroup(of.start, heading[of], reach[of], _neighbours(robots[of], reach[of], prey, what, shape)[0], far)
        for of in members
    ]
    mine = members[group]
    teammates, place = _neighbours(robots[mine], aware[mine], robots, who, shape, mine.start)
    scene = Scene(
        heading[mine], reach[mine], aware[mine], groups[group].targets, teammates, place, mine.start, [], far
    )
    return Sample(scene, groups, who, what)


def without_team(sample: Sample) -> Sample:
    """Return the scene of the same group without a team, as targets are."""
    empty = np.zeros(0, np.int64)
    scene = sample.scene._replace(teammates=no_neighbours(len(sample.scene.heading)), place=empty, first=0)
    return sample._replace(scene=scene, groups=[], team_identity=empty)


def _neighbours(
    observers: Floats, reach: Floats, observed: Floats, identity: npt.NDArray[np.int64], shape: str,
    own: int | None = None,
) -> tuple[NeighbourList, Integers]:
    """Return the neighbours, and their indices among the observed; `own` is that of the first observer."""
    way = observed - observers[:, np.newaxis]
    apart = np.hypot(way[..., 0], way[..., 1]) if shape == "disc" else np.abs(way).max(axis=-1, initial=0.0)
    near = apart <= reach[:, np.newaxis]
    if own is not None:
        near[np.arange(len(near)), own + np.arange(len(near))] = False
    offset, place = way[near], np.nonzero(near)[1]
    start = np.concatenate([[0], np.cumsum(near.sum(axis=1))])
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    return NeighbourList(start, identity[place], offset, distance), place


_ENTRY = Axis("entries", "write no more than there is room for, and return how many are needed")
_AXES = PERCEPT_AXES | {
    "n": Axis("robots", "robots are 0 to n − 1, and n is scene.heading.shape[0]"),
    "records": Axis("groups", "find a robot's group by its place"),
    "width": Axis("inputs", "width(team_size) says how many there are"),
    **{f"{kind}.{name} k": _ENTRY for kind in ("teammates", "relayed") for name in ("identity", "offset", "distance")},
}
# The teammates of a degree that shows all of them, including `start`, may only be read.
_GUARDS = {hides: Guard(SENSING, ("relayed", "situation") + ("teammates",) * hides, _AXES) for hides in (False, True)}


def _run(degree: Awareness, kernel: str, entry: Entry, sample: Sample, **written: Any) -> tuple[int, Sensing]:
    """Run a kernel of a degree on the scene of a sample and on copies of the buffers that it writes."""
    scene = sample.scene._replace(team=[TEAM_GROUP.pack(group) for group in sample.groups])
    size = len(scene.heading)
    nothing, parameters = no_neighbours(size), np.ascontiguousarray(degree.parameters, float)
    given = Sensing(scene, parameters, nothing, nothing, np.zeros((size, 0), np.float32))._replace(**written)
    return _GUARDS[not degree.shows_teammates].run(type(degree).__name__, kernel, entry, given)


_FIELDS = ("targets", "teammates", "relayed", "identities")
_NO_IDENTITY = -7_777_777
_UNWRITTEN = np.uint32(0x7FC5_EED5)
# The largest reading whose distances are finite; see teamsight.policies.memory.transitions.
_MOST = 1e30
# Nothing changes between two calls, so the room that the first call returns must suffice.
_MOST_CALLS = 3

# Sizes of the groups of the team, the group, the number of targets, the side of the square [sensing ranges].
_SCENES = (
    ((1,), 0, 0, 1.0),
    ((1,), 0, 5, 1.0),
    ((4,), 0, 0, 1.5),
    ((7,), 0, 9, 2.5),
    ((3, 4), 0, 9, 2.0),
    ((3, 4), 1, 9, 2.0),
    ((2, 1, 5), 2, 20, 1.0),
    ((12,), 0, 30, 0.5),
    ((6,), 0, 6, 20.0),
    ((0, 3), 0, 4, 1.0),
)


def check_awareness(degree: Awareness, *, seed: int = 1) -> None:
    """Check whether a degree of awareness keeps the contract of `Awareness`, on random scenes.

    Its kernels run with bounds checks: on single robots, sparse and crowded teams, teams of one group and of several,
    and with buffers that are too small at first, as in a world.

    Parameters
    ----------
    degree : Awareness
        The degree to check.
    seed : int, default 1
        Seed of the scenes.

    Raises
    ------
    TypeError
        If it is not an `Awareness`, a member is missing or has the wrong type, or a kernel cannot be compiled.
    ValueError
        If a kernel accesses elements outside its arrays or writes read-only ones, if `width` differs from what
        `situate` writes, if a reading is not finite, or if what `perceive` writes or returns is inconsistent.
    """
    name = type(degree).__name__
    if not isinstance(degree, Awareness):
        name = degree.__name__ if isinstance(degree, type) else name
        raise TypeError(f"{name}: must be an object of a subclass of Awareness, such as RingAwareness(16)")
    _check_members(name, degree)
    begin_check()
    rng = np.random.default_rng(seed)
    samples = [sample_scene(sizes, group, targets, side, rng) for sizes, group, targets, side in _SCENES]
    samples.append(sample_scene((3,), 0, 2, 1.0, rng, coincide=True))
    samples.append(sample_scene((3, 4), 1, 9, 2.0, rng, square=True))
    samples.append(without_team(sample_scene((3,), 0, 5, 1.0, rng)))
    for sample in samples:
        _check_perceive(name, degree, sample)
        _check_situate(name, degree, sample)


def _check_members(name: str, degree: Awareness) -> None:
    for member in ("name", "order"):
        if not isinstance(getattr(degree, member, None), str):
            raise TypeError(f"{name}.{member}={getattr(degree, member, None)!r}: must be a str")
    if getattr(type(degree), "situate", None) is None:
        raise TypeError(f"{name}: has no 'situate'; give a kernel situate(scene, parameters, situation)")
    delivers = degree.delivers
    if not isinstance(delivers, tuple) or not set(delivers) <= set(_FIELDS):
        raise ValueError(f"{name}.delivers={delivers!r}: must be a tuple of some of {', '.join(_FIELDS)}")
    if degree.shows_teammates and "teammates" not in delivers:
        raise ValueError(f"{name}.delivers={delivers!r}: shows_teammates is True; add 'teammates'")
    try:
        parameters = np.asarray(degree.parameters, float)
    except (TypeError, ValueError):
        kind = type(degree.parameters).__name__
        raise TypeError(f"{name}.parameters: has the type {kind}; it must be an array of floats") from None
    if parameters.ndim != 1 or not np.isfinite(parameters).all():
        raise ValueError(f"{name}.parameters: must be finite numbers in one dimension; the shape is {parameters.shape}")
    for team_size in (1, 2, 10):
        check_width(degree, team_size)
        rings, added = degree.rings(team_size), degree.width(team_size).added
        is_good = isinstance(rings, tuple) and all(type(ring) is int and ring > 0 for ring in rings)
        if not is_good or sum(rings) > added:
            raise ValueError(
                f"{name}.rings({team_size})={rings!r}: must be a tuple of numbers of sectors, in all at most the "
                f"{added} inputs that it adds"
            )


def _check_perceive(name: str, degree: Awareness, sample: Sample) -> None:
    if type(degree).perceive is None:
        return
    # A world has no buffers for a group without a team; for others, it begins with room for all teammates in range.
    ample = _perceived(name, degree, sample, 10_000 if sample.groups else 0)
    for room in (0, 1, len(sample.scene.teammates.identity)) if sample.groups else ():
        found = _perceived(name, degree, sample, room)
        for kind, one, other in zip(("teammates", "relayed"), found, ample, strict=True):
            if any(not np.array_equal(a, b, equal_nan=True) for a, b in zip(one, other, strict=True)):
                raise ValueError(
                    f"{name}: perceive writes different {kind} after a call with too little room; do not depend on the "
                    "content of the buffers"
                )
    for kind, seen, known in (
        ("teammates", ample[0], sample.team_identity),
        ("relayed", ample[1], sample.target_identity),
    ):
        if len(seen.identity) and kind not in degree.delivers:
            raise ValueError(f"{name}.delivers={degree.delivers!r}: perceive writes {kind}; add {kind!r}")
        _check_neighbours(f"{name}: perceive writes {kind}", seen, known, ascending=kind == "teammates")


def _perceived(name: str, degree: Awareness, sample: Sample, room: int) -> tuple[NeighbourList, NeighbourList]:
    """Return what `perceive` writes with this room, or with as much more as it asks for."""
    size, entry = len(sample.scene.heading), perceive_entry(degree)
    assert entry is not None
    for _ in range(_MOST_CALLS):
        shown = _blank(size, 0 if degree.shows_teammates else room)
        relayed = _blank(size, room)
        # A list that it never writes is empty, as in a world.
        if degree.shows_teammates or "teammates" not in degree.delivers:
            shown.start[:] = 0
        if "relayed" not in degree.delivers:
            relayed.start[:] = 0
        need, done = _run(degree, "perceive", entry, sample, teammates=shown, relayed=relayed)
        shown, relayed = done.teammates, done.relayed
        if need <= room:
            break
        if not sample.groups:
            raise ValueError(f"{name}: perceive returns {need} for robots without a team; it must be 0")
        room = max(need + need // 4, 16)
    else:
        raise ValueError(f"{name}: perceive asks for more room on every call, last for {need}; return what is needed")
    for kind, seen in (("teammates", shown), ("relayed", relayed)):
        _check_start(f"{name}: perceive writes {kind}.start", seen.start, len(seen.distance))
        if seen.start[-1] > need:
            raise ValueError(
                f"{name}: perceive returns {need}, but writes {seen.start[-1]} {kind}; return the number of entries "
                "that the longer of teammates and relayed needs"
            )
    return filled(shown), filled(relayed)


def _blank(size: int, room: int) -> NeighbourList:
    """Return buffers filled with values that show what was not written."""
    return NeighbourList(
        np.full(size + 1, _NO_IDENTITY), np.full(room, _NO_IDENTITY), np.full((room, 2), np.nan), np.full(room, np.nan)
    )


def _check_start(what: str, start: Any, room: int) -> None:
    wrong = start[0] != 0 or (np.diff(start) < 0).any() or start[-1] > room
    if wrong:
        raise ValueError(
            f"{what} = {_short(start)}, with room for {room}; write all n + 1 elements: 0 first, then ascending, and "
            "the number of entries last"
        )


def _check_neighbours(what: str, seen: NeighbourList, known: Any, *, ascending: bool) -> None:
    for i in range(len(seen.start) - 1):
        mine = slice(seen.start[i], seen.start[i + 1])
        identity, offset, distance = seen.identity[mine], seen.offset[mine], seen.distance[mine]
        if not (np.isfinite(offset).all() and np.isfinite(distance).all()):
            raise ValueError(f"{what} of robot {i} whose offset or distance is unwritten or not finite; write both")
        length = np.hypot(offset[:, 0], offset[:, 1])
        wrong = np.abs(length - distance) > 1e-9 * (1.0 + length)
        if wrong.any():
            k = int(np.argmax(wrong))
            raise ValueError(
                f"{what} of robot {i} with the distance {distance[k]:g} and an offset of length {length[k]:g}; they "
                "must be equal"
            )
        strange = (identity != -1) & ~np.isin(identity, known)
        if strange.any():
            raise ValueError(
                f"{what} of robot {i} with the identity {identity[np.argmax(strange)]}, which no agent has; copy it "
                "from the scene, or write -1 to hide it"
            )
        shown = identity[identity != -1]
        if ascending and (np.diff(shown) <= 0).any():
            raise ValueError(f"{what} of robot {i} with the identities {_short(shown)}; they must ascend")


def _short(numbers: Any) -> str:
    return f"{numbers[:6].tolist()}{' and so on' if len(numbers) > 6 else ''}"


def _check_situate(name: str, degree: Awareness, sample: Sample) -> None:
    """Check the vectors for learners: as wide as `width` says, written throughout, and finite."""
    width, size = check_width(degree, sample.team_size), len(sample.scene.heading)
    blank = np.full((size, width), _UNWRITTEN).view(np.float32)
    entry = situate_entry(degree)
    situation = _run(degree, "situate", entry, sample, situation=blank)[1].situation
    place = f"{name}: situate, of robot {{}} in a team of {sample.team_size},"
    unwritten = situation.view(np.uint32) == _UNWRITTEN
    if unwritten.any():
        i, j = np.argwhere(unwritten)[0].tolist()
        raise ValueError(
            f"{place.format(i)} leaves input {j} of {width} unwritten; write every element, 1 where nothing is sensed, "
            f"or correct width({sample.team_size})"
        )
    wrong = ~(np.abs(situation) <= _MOST)
    if wrong.any():
        i, j = np.argwhere(wrong)[0].tolist()
        raise ValueError(
            f"{place.format(i)} writes {situation[i, j]} to input {j}; readings must be finite and at most {_MOST:g}: "
            "write 1 where nothing is sensed"
        )
    other = np.full((size, width), 0.5, np.float32)
    again = _run(degree, "situate", entry, sample, situation=other)[1].situation
    if not np.array_equal(situation, again):
        i, j = np.argwhere(situation != again)[0].tolist()
        raise ValueError(
            f"{place.format(i)} writes {situation[i, j]:g} or {again[i, j]:g} to input {j}, depending on what it was; "
            "write before you read"
        )
