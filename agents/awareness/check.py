"""The check of a degree of awareness: its kernels on sample scenes, under guard and compared."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from teamsight.agents.awareness.interface import (
    PAST,
    SENSING,
    TEAM_GROUP,
    Awareness,
    Past,
    Scene,
    Sensing,
    TeamGroup,
    check_width,
    kept_lists,
    perceive_entry,
    situate_entry,
)
from teamsight.core.contracts import (
    Lists,
    check_offsets,
    class_name,
    descends,
    lists_in_any_room,
    neighbours_of,
    numbers,
    random_headings,
    refuse_entries,
    rows_of,
    unwritten_list,
)
from teamsight.core.kernel import Entry
from teamsight.core.kernel.guard import Axis, Guard, begin_check
from teamsight.core.neighbour_list import no_neighbours
from teamsight.policies.check import PERCEPT_AXES
from teamsight.policies.interface import Integers
from teamsight.world.limits import farthest_of
from teamsight.world.search import proximity_graph


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
    square: bool = False, memory: int = -1,
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
    memory : int, default -1
        The number of ticks before the present for which reports are kept; −1 for no past.
    """
    size = sum(sizes)
    robots = np.zeros((size, 2)) if coincide else rng.uniform(0, side, (size, 2))
    prey = rng.uniform(0, side, (targets, 2))
    prey[:coincide] = 0.0
    # Some identities are left out, as after removals.
    identity = np.sort(rng.choice(3 * (size + targets) + 3, size + targets, replace=False)) + 1
    who, what = identity[:size], identity[size:]
    heading = random_headings(size, rng)
    reach, aware = rng.uniform(0.8, 1.2, size), rng.uniform(0.8, 1.2, size)
    members = [slice(*edges) for edges in pairwise(np.cumsum([0, *sizes]).tolist())]
    shape = "square" if square else "disc"
    far = farthest_of(shape)
    team, sensed = (proximity_graph(robots, *others, range_shape=shape) for others in ((None, aware), (prey, reach)))
    groups = [
        TeamGroup(
            of.start, who[of], heading[of], reach[of], neighbours_of(of, sensed, what), neighbours_of(of, team, who),
            neighbours_of(of, team).identity, [], far,
        )
        for of in members
    ]  # fmt: skip
    if memory >= 0:
        groups = _with_past(groups, memory, rng)
    mine = members[group]
    place = neighbours_of(mine, team).identity
    scene = Scene(
        heading[mine], reach[mine], aware[mine], groups[group].targets, neighbours_of(mine, team, who), place,
        mine.start, [], far, np.zeros((size, 4), np.int64), np.zeros((size, 7)),
    )  # fmt: skip
    return Sample(scene, groups, who, what)


def _with_past(groups: list[TeamGroup], memory: int, rng: np.random.Generator) -> list[TeamGroup]:
    """Return the groups with reports of so many ticks; at each but the newest, half of the entries of now."""
    made = []
    for group in groups:
        robots = len(group.identity)
        lists = [kept_lists(memory + 1, robots, len(one.identity)) for one in (group.teammates, group.targets)]
        places = group.place, np.zeros(len(group.targets.identity), np.int64)
        for kept, now, place in zip(lists, (group.teammates, group.targets), places, strict=True):
            # So the oldest ticks were never reported.
            for tick in range(memory // 2, memory + 1):
                chosen = np.flatnonzero(rng.random(len(place)) < (1.0 if tick == memory else 0.5))
                kept.tick[tick] = tick
                kept.start[tick] = np.searchsorted(chosen, now.start)
                for column, values in zip(kept[2:], (now.identity, place, now.offset, now.distance), strict=True):
                    column[tick, : len(chosen)] = values[chosen]
        heading, none = np.repeat(group.heading[None], memory + 1, axis=0), np.zeros(0)
        past = Past(np.array([memory]), lists[0], lists[1], heading, none, none, none)
        made.append(group._replace(past=[PAST.pack(past)]))
    return made


def without_team(sample: Sample) -> Sample:
    """Return the scene of the same group without a team, as targets are."""
    empty = np.zeros(0, np.int64)
    scene = sample.scene._replace(
        teammates=no_neighbours(len(sample.scene.heading)), place=empty, first=0, marks=np.zeros((0, 4), np.int64),
        sums=np.zeros((0, 7)),
    )  # fmt: skip
    return sample._replace(scene=scene, groups=[], team_identity=empty)


_ENTRY = Axis("entries", "write no more than there is room for, and return how many are needed")
_AXES = PERCEPT_AXES | {
    "n": Axis("robots", "robots are 0 to n − 1, and n is scene.heading.shape[0]"),
    "records": Axis("groups", "find a robot's group by its place"),
    "1": Axis("ticks", "it is one"), "4": Axis("columns", "they are 0 to 3"), "7": Axis("columns", "they are 0 to 6"),
    "work": Axis("robots of the team", "places in the team are 0 to scene.marks.shape[0] − 1"),
    "scene.team.past records": Axis("pasts", "it has one, or none: then read the present lists"),
    "slots": Axis("ticks", "a tick is in slot tick % slots"),
    "kept": Axis("entries", "stay below start[slot, n]"),
    "reach": Axis("robots", "it can be empty"), "x": Axis("robots of the team", "it can be empty"),
    "targets": Axis("targets", "it can be empty"),
    "width": Axis("inputs", "width(team_size) says how many there are"),
    **{f"{kind}.{name} k": _ENTRY for kind in ("teammates", "relayed") for name in ("identity", "offset", "distance")},
}
# The teammates of a degree that shows all of them, including `start`, may only be read.
_GUARDS = {
    hides: Guard(SENSING, ("relayed", "situation", "scene.marks", "scene.sums") + ("teammates",) * hides, _AXES)
    for hides in (False, True)
}


def _run(degree: Awareness, kernel: str, entry: Entry, sample: Sample, **written: Any) -> tuple[int, Sensing]:
    """Run a kernel of a degree on the scene of a sample and on copies of the buffers that it writes."""
    scene = sample.scene._replace(team=[TEAM_GROUP.pack(group) for group in sample.groups])
    size = len(scene.heading)
    nothing, parameters = no_neighbours(size), np.ascontiguousarray(degree.parameters, float)
    given = Sensing(scene, parameters, nothing, nothing, np.zeros((size, 0), np.float32))._replace(**written)
    return _GUARDS[not degree.shows_teammates].run(type(degree).__name__, kernel, entry, given)


_FIELDS = ("targets", "teammates", "relayed", "identities")
_UNWRITTEN = np.uint32(0x7FC5_EED5)
# The largest reading whose distances are finite; see teamsight.policies.memory.transitions.
_MOST = 1e30

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
    name = class_name(degree, Awareness, "RingAwareness(16)")
    _check_members(name, degree)
    begin_check()
    rng = np.random.default_rng(seed)

    def sample(sizes: tuple[int, ...], group: int, targets: int, side: float, **options: Any) -> Sample:
        memory = degree.memory(sum(sizes))
        kept = memory if memory or degree.loss else -1
        return sample_scene(sizes, group, targets, side, rng, memory=kept, **options)

    samples = [sample(sizes, group, targets, side) for sizes, group, targets, side in _SCENES]
    samples.append(sample((3,), 0, 2, 1.0, coincide=True))
    samples.append(sample((3, 4), 1, 9, 2.0, square=True))
    samples.append(without_team(sample((3,), 0, 5, 1.0)))
    for one in samples:
        _check_perceive(name, degree, one)
        _check_situate(name, degree, one)


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
    numbers(f"{name}.parameters", degree.parameters)
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
    size, entry = len(sample.scene.heading), perceive_entry(degree)
    if entry is None:
        return

    def run(room: int) -> tuple[int, Lists]:
        # A world has no buffers for a group without a team.
        room *= bool(sample.groups)
        shown, relayed = unwritten_list(size, 0 if degree.shows_teammates else room), unwritten_list(size, room)
        # A list that it never writes is empty, as in a world.
        if degree.shows_teammates or "teammates" not in degree.delivers:
            shown.start[:] = 0
        if "relayed" not in degree.delivers:
            relayed.start[:] = 0
        need, done = _run(degree, "perceive", entry, sample, teammates=shown, relayed=relayed)
        if need and not sample.groups:
            raise ValueError(f"{name}: perceive returns {need} for robots without a team; it must be 0")
        return need, {"teammates": done.teammates, "relayed": done.relayed}

    less = (0, 1, len(sample.scene.teammates.identity)) if sample.groups else ()
    written = lists_in_any_room(f"{name}: perceive", run, less)
    for kind, known in (("teammates", sample.team_identity), ("relayed", sample.target_identity)):
        seen, what = written[kind], f"{name}: perceive writes {kind} of robot"
        if len(seen.identity) and kind not in degree.delivers:
            raise ValueError(f"{name}.delivers={degree.delivers!r}: perceive writes {kind}; add {kind!r}")
        check_offsets(what, seen)
        is_shown = seen.identity != -1
        row, identity = rows_of(seen)[is_shown], seen.identity[is_shown]
        text = "the identity {}, which no agent has; copy it from the scene, or write -1 to hide it"
        refuse_entries(what, row, ~np.isin(identity, known), text, identity)
        if kind == "teammates":
            text = "the identity {} after one that is not smaller; they must ascend"
            refuse_entries(what, row, descends(row, identity), text, identity)


def _check_situate(name: str, degree: Awareness, sample: Sample) -> None:
    """Check the vectors for learners: as wide as `width` says, written throughout, and finite."""
    width, size = check_width(degree, sample.team_size), len(sample.scene.heading)
    blank = np.full((size, width), _UNWRITTEN).view(np.float32)
    entry = situate_entry(degree)
    situation = _run(degree, "situate", entry, sample, situation=blank)[1].situation
    other = np.full((size, width), 0.5, np.float32)
    again = _run(degree, "situate", entry, sample, situation=other)[1].situation
    for wrong, text in (
        (
            situation.view(np.uint32) == _UNWRITTEN,
            f"leaves input {{0}} of {width} unwritten; write every element, 1 where nothing is sensed, or correct "
            f"width({sample.team_size})",
        ),
        (
            ~(np.abs(situation) <= _MOST),
            f"writes {{1}} to input {{0}}; readings must be finite and at most {_MOST:g}: write 1 where nothing is "
            "sensed",
        ),
        (situation != again, "writes {1:g} or {2:g} to input {0}, depending on what it was; write before you read"),
    ):
        if wrong.any():
            i, j = np.argwhere(wrong)[0].tolist()
            said = text.format(j, situation[i, j], again[i, j])
            raise ValueError(f"{name}: situate, of robot {i} in a team of {sample.team_size}, {said}")
