"""The contract of a degree of awareness, and the sectors of situation vectors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.angles import ANGLE_MARGIN, near_angle
from teamsight.core.component import Component
from teamsight.core.contracts import parameters_of
from teamsight.core.elementary import atan2
from teamsight.core.kernel import Entry, Packed, Record, inlined, kernel, specialise
from teamsight.core.neighbour_list import Filled, NeighbourList, neighbour_room, no_neighbours

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class Width(NamedTuple):
    """Number of inputs of a robot: `own`, and `added` for its teammates."""

    own: int
    added: int


class KeptLists(NamedTuple):
    """The neighbour lists of the last ticks, one per slot; that of tick t is in slot ``t % slots``.

    Attributes
    ----------
    tick : ndarray, shape (slots,), int64
        The tick of each list; −1 for none.
    start, identity, place, offset, distance
        As in `NeighbourList`, with an axis of slots; `place` holds indices among the observed.
    """

    tick: Annotated[Integers, ".slots"]
    start: Annotated[Integers, ".slots", "n + 1"]
    identity: Annotated[Integers, ".slots", ".kept"]
    place: Annotated[Integers, ".slots", ".kept"]
    offset: Annotated[Floats, ".slots", ".kept", 2]
    distance: Annotated[Floats, ".slots", ".kept"]


def kept_lists(slots: int, observers: int, room: int) -> KeptLists:
    """Return empty lists of this many observers, with room for this many entries each."""
    return KeptLists(
        np.full(slots, -1), np.zeros((slots, observers + 1), np.int64), np.zeros((slots, room), np.int64),
        np.zeros((slots, room), np.int64), np.zeros((slots, room, 2)), np.zeros((slots, room)),
    )  # fmt: skip


class Past(NamedTuple):
    """What the robots of one group have reported at the last ticks.

    Attributes
    ----------
    newest : ndarray, shape (1,), int64
        The tick of the newest reports, which is the present one.
    links, targets : KeptLists
        The teammates and the targets that they sensed. Teammates whose reports were lost are left out.
    heading : ndarray, shape (slots, n, 2), float64
        Where they faced.
    reach : ndarray, shape (n,) or (0,), float64
        Below 0 for a robot that senses no teammates now; empty if that is never so.
    x, target_x : ndarray, shape (robots,) or (0,), and (targets,) or (0,), float64
        NaN for a robot of the team, and for a target, that is inactive now; empty if none ever is. Their indices are
        those of `place`.
    """

    newest: Annotated[Integers, 1]
    links: KeptLists
    targets: KeptLists
    heading: Annotated[Floats, ".slots", "n", 2]
    reach: Annotated[Floats, ".reach"]
    x: Annotated[Floats, ".x"]
    target_x: Annotated[Floats, ".targets"]


PAST = Record(Past)
#: For kernels: return the `Past` at an address from `TeamGroup.past`.
past_at = PAST.at


class TeamGroup(NamedTuple):
    """One group of a team.

    Attributes
    ----------
    first : int
        The index in the team of the group's first robot.
    identity : ndarray, shape (n,), int64
        The identities of its robots.
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    sensing_range : ndarray, shape (n,), float64
        [length].
    targets, teammates : NeighbourList
        The targets and the teammates that its robots sense.
    place : ndarray, shape (k,), int64
        For each entry of `teammates`, its index in the team.
    past : ndarray, shape (1,) or (0,), int64
        The same at the last ticks, for a degree with `Awareness.memory` or `Awareness.loss`; kernels read it with
        `past_at`.
    farthest : float
        As in `Scene`.
    """

    first: int
    identity: Annotated[Integers, "n"]
    heading: Annotated[Floats, "n", 2]
    sensing_range: Annotated[Floats, "n"]
    targets: Filled
    teammates: Filled
    place: Annotated[Integers, ".k"]
    past: list[Packed[Past]]
    farthest: float = 1.0


TEAM_GROUP = Record(TeamGroup)
#: For kernels: return the `TeamGroup` at an address from `Scene.team`.
team_group_at = TEAM_GROUP.at


class Scene(NamedTuple):
    """The true surroundings of a group of n robots, of which a degree of awareness shows a part.

    Attributes
    ----------
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    sensing_range, awareness_range : ndarray, shape (n,), float64
        [length].
    targets, teammates : NeighbourList
        All in range.
    place : ndarray, shape (k,), int64
        For each entry of `teammates`, its index in the team.
    first : int
        The index in the team of the group's first robot.
    team : ndarray, shape (groups,), int64
        The groups of the team; kernels read them with `team_group_at`.
    farthest : float
        The largest distance in range, over the range: 1 for discs, √2 for squares. Readings are shares of
        ``awareness_range[i] * farthest``.
    marks : ndarray, shape (team, 4) or (0, 4), int64
        Room to work in, with a row for each robot of the team, if `Awareness.spreads`. Kernels write before they read.
    sums : ndarray, shape (team, 7) or (0, 7), float64
        As `marks`.
    """

    heading: Annotated[Floats, "n", 2]
    sensing_range: Annotated[Floats, "n"]
    awareness_range: Annotated[Floats, "n"]
    targets: Filled
    teammates: Filled
    place: Annotated[npt.NDArray[np.int64], ".k"]
    first: int
    team: list[Packed[TeamGroup]]
    farthest: float = 1.0
    marks: Annotated[Integers, ".work", 4] = np.zeros((0, 4), np.int64)
    sums: Annotated[Floats, ".work", 7] = np.zeros((0, 7))


#: Number of sectors of the ring with which a robot senses targets: the inputs of its own.
OWN_SECTORS = 16

_FULL_TURN = 2.0 * math.pi


@inlined
def sector_of(x: float, y: float, heading_x: float, heading_y: float, sectors: int) -> int:
    """Return the number of the sector of an offset, anticlockwise; the centre of sector 0 is straight ahead."""
    ahead = x * heading_x + y * heading_y
    left = y * heading_x - x * heading_y
    scale = sectors / _FULL_TURN
    at = near_angle(left, ahead) * scale + 0.5
    number = math.floor(at)
    # Near the edge of a sector, and for NaN, the exact angle decides, so that it decides everywhere.
    if not ANGLE_MARGIN * scale < at - number < 1.0 - ANGLE_MARGIN * scale:
        number = math.floor(atan2(left, ahead) * scale + 0.5)
    return number + sectors if number < 0 else number % sectors


@kernel
def read_ring(
    row: Any, first: int, sectors: int, heading: Any, seen: Any, edges: tuple[int, int], reach: float
) -> None:
    """Write the readings of one robot's ring to ``row[first:]``.

    For each sector the smallest distance divided by `reach`, or 1 if the sector is empty. `edges` are the robot's first
    entry in the neighbour list `seen`, and the next robot's.
    """
    for sector in range(sectors):
        row[first + sector] = 1.0
    for k in range(edges[0], edges[1]):
        sector = first + sector_of(seen.offset[k, 0], seen.offset[k, 1], heading[0], heading[1], sectors)
        reading = seen.distance[k] / reach
        if reading < row[sector]:
            row[sector] = reading


@kernel
def situate_targets(scene: Any, parameters: Any, situation: Any) -> None:
    """Write the own part of the situation: a heading-relative ring of `OWN_SECTORS` target sectors."""
    targets = scene.targets
    for i in range(situation.shape[0]):
        edges = (targets.start[i], targets.start[i + 1])
        reach = scene.sensing_range[i] * scene.farthest
        read_ring(situation[i], 0, OWN_SECTORS, scene.heading[i], targets, edges, reach)


class Awareness(Component):
    """A degree of awareness of teammates.

    A subclass overrides what differs from the defaults: nothing is shown of teammates, and the inputs are the robot's
    own. Worlds accept its objects. The fields of a subclass that is a frozen dataclass are its options; `Component`
    says how they are checked.

    Attributes
    ----------
    name : str
        Its name in errors and records; by default that of the class. With a line in
        `teamsight.agents.awareness.registry`, users can choose it by this name.
    order : str
        The paper's name for how it grows with the team; for figures and tables.
    formula : str
        The formula for the number of inputs d, in the paper's letters: n own inputs, δ sectors or places of a list,
        σ readings per teammate, N robots.
    shows : str
        What it shows of teammates, for legends.
    shows_teammates : bool
        Whether the percept holds every teammate in range, with identity and exact offset.
    teammate_layout : {"", "sectors", "offsets"}
        How the added inputs show where teammates are: the nearest distance in each sector of one ring; distance and
        bearing of each teammate, in turn; or, by default, not at all.
    perceive : kernel or None
        ``perceive(scene, parameters, teammates, relayed)`` writes the neighbour lists of the percept: `teammates`
        (unless `shows_teammates`) and `relayed`. It returns the number of entries that the longer list needs. If there
        is less room than that, it is called again with more. None if there is nothing to write.
    situate : kernel
        ``situate(scene, parameters, situation)`` writes the situations, the vectors for learners, shape (n, width)
        float32: every element, with 1 where nothing is sensed. By default the ring of target sectors. Override it
        together with `added` or `width`.
    added : int
        Number of inputs that it adds to the robot's own, if that does not depend on the team.
    delivers : tuple of str
        The neighbour lists of the percept that may have entries: by default "targets", and "teammates" if they are
        shown or there is a kernel `perceive`. Add "relayed" if that writes relayed targets, and "identities" if it
        writes those of teammates.
    spreads : bool
        Whether its kernels use `Scene.marks` and `Scene.sums`, which have a row for each robot of the team.
    loss : float
        The probability that a report of a teammate is lost on its way, for each pair of robots and tick on its own; 0
        by default. Above 0, kernels find what has arrived in `TeamGroup.past`.
    """

    name: ClassVar[str] = ""
    order: ClassVar[str] = ""
    formula: ClassVar[str] = ""
    shows: ClassVar[str] = ""
    shows_teammates: ClassVar[bool] = False
    teammate_layout: ClassVar[str] = ""
    perceive: ClassVar[Callable[..., int] | None] = None
    situate: ClassVar[Callable[..., None]] = situate_targets
    added: ClassVar[int] = 0
    delivers: ClassVar[tuple[str, ...]] = ("targets",)
    spreads: ClassVar[bool] = False

    def __init_subclass__(cls, **named: Any) -> None:
        super().__init_subclass__(**named)
        if not cls.name:
            cls.name = cls.__name__
        if cls.delivers is Awareness.delivers and (cls.shows_teammates or cls.perceive):
            cls.delivers = (*cls.delivers, "teammates")
        if "situate" in cls.__dict__ and cls.width is Awareness.width and "added" not in cls.__dict__:
            raise TypeError(
                f"{cls.__name__}: has a kernel situate, and does not say how many inputs that writes; define added, "
                f"their number beyond the robot's own {OWN_SECTORS}, or width(team_size)"
            )

    @property
    def parameters(self) -> npt.NDArray[np.float64]:
        """The constants that the kernels read, shape (p,); by default the fields of a dataclass, in order."""
        return np.array(parameters_of(self, Awareness))

    def width(self, team_size: int) -> Width:
        """Return the number of inputs of a robot in a team of this size; by default its own and `added`."""
        checks.count("team_size", team_size)
        return Width(OWN_SECTORS, self.added)

    @property
    def loss(self) -> float:
        return 0.0

    def memory(self, team_size: int) -> int:
        """Return the number of ticks before the present one that its kernels read in `TeamGroup.past`; 0 by default."""
        return 0

    def check_team(self, team_size: int, present: int) -> None:
        """Refuse a team that the options do not fit; by default all fit.

        Parameters
        ----------
        team_size, present : int
            The number of robots, with those that have left and without.
        """

    def rings(self, team_size: int) -> tuple[int, ...]:
        """Return the numbers of sectors of the rings with which the added inputs begin; none by default.

        `TabularQ` merges neighbouring sectors of a ring; it keeps inputs that belong to no ring as they are.
        """
        return ()

    @classmethod
    def dimensions(cls, own: int, delta: int, sigma: int, team_size: int) -> int:
        """Return d, the number of inputs by `formula`; by default own, and those that `width` adds.

        Parameters
        ----------
        own, delta, sigma, team_size : int
            The paper's n, δ, σ and N; it counts the robot itself as a teammate.
        """
        return own + cls.adding(delta).width(team_size).added

    @classmethod
    def adding(cls, added: int) -> Self:
        """Return the degree whose option adds this number of inputs; the default if no option does."""
        return cls()

    @classmethod
    def options(cls) -> tuple[str, ...]:
        """Return the names of the degree's options."""
        return tuple(field.name for field in fields(cls)) if is_dataclass(cls) else ()


def check_width(degree: Awareness, team_size: int) -> int:
    """Return how many inputs a degree of awareness has in a team of this size; refuse what is not a `Width`.

    Raises
    ------
    TypeError
        If `width` does not return two whole numbers of at least 0.
    """
    width: Any = degree.width(team_size)
    is_pair = isinstance(width, tuple) and len(width) == 2
    if not is_pair or any(isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 0 for n in width):
        shown = f"{type(degree).__name__}.width({team_size})={width!r}"
        raise TypeError(f"{shown}: must be Width(own, added), whole numbers of at least 0")
    return int(sum(width))


class Sensing(NamedTuple):
    """The record of a degree of awareness: the arguments of its two kernels; see `Awareness`."""

    scene: Scene
    parameters: Annotated[npt.NDArray[np.float64], "p"]
    teammates: NeighbourList
    relayed: NeighbourList
    situation: Annotated[npt.NDArray[np.float32], "n", "width"]


SENSING = Record(Sensing)
sensing_at = SENSING.at


def perceive_at(address: int) -> int:
    """Call `perceive` of a degree of awareness on the arrays of a record."""
    s = sensing_at(address)
    return perceive_kernel(s.scene, s.parameters, s.teammates, s.relayed)  # type: ignore[name-defined,no-any-return]  # noqa: F821


def situate_at(address: int) -> int:
    """Call `situate` of a degree of awareness on the arrays of a record."""
    s = sensing_at(address)
    situate_kernel(s.scene, s.parameters, s.situation)  # type: ignore[name-defined]  # noqa: F821
    return 0


def perceive_entry(awareness: Awareness) -> Entry | None:
    """Return the entry that writes the percept under this degree, or None if there is nothing to write."""
    rule = type(awareness).perceive
    return None if rule is None else specialise(perceive_at, awareness.name, perceive_kernel=rule)


def situate_entry(awareness: Awareness) -> Entry:
    """Return the entry that writes the situation vectors under this degree."""
    return specialise(situate_at, awareness.name, situate_kernel=type(awareness).situate)


class Perception:
    """The arrays that a degree of awareness writes for n robots.

    Parameters
    ----------
    size, rows : int
        The number of robots, and the number for which there is room.

    Attributes
    ----------
    nothing : NeighbourList
        An empty list.
    shown, relayed : NeighbourList
        Room for teammates, and for the targets that they sense.
    situation : ndarray, shape (n, width), float32
        The vectors for learners; of width 0 unless the policy reads them.
    room : int
        The number of entries for which `shown` and `relayed` have room.
    is_situated : bool
        Whether the policy reads situation vectors.
    record : Packed
        The argument of the degree's kernels; see `teamsight.agents.engine.binding`.
    """

    def __init__(self, size: int, rows: int) -> None:
        self._rows = rows
        nothing = no_neighbours(rows)
        self._lists, self._situations_room = (nothing, nothing, nothing), np.zeros((rows, 0), np.float32)
        self.room = 0
        self.is_situated = False
        self.record: Packed[Sensing]
        self.fit(size)

    def fit(self, size: int) -> None:
        """Follow the number of robots; arrays stay where they are."""
        self.nothing, self.shown, self.relayed = (
            one if size == self._rows else one._replace(start=one.start[: size + 1]) for one in self._lists
        )
        self.situation = self._situations_room[:size]
        self._situated_at: tuple[int, int] | None = None

    @property
    def size(self) -> int:
        """The number of robots."""
        return len(self.situation)

    def make_room(self, awareness: Awareness, team_size: int, teammates: int, inputs: int) -> None:
        """Make the arrays anew.

        Parameters
        ----------
        awareness : Awareness
            The degree that writes them.
        team_size : int
            The number of robots in the team.
        teammates : int
            The number of neighbours for which there is room; −1 for a group without a team.
        inputs : int
            The width of the situation vector that the policy reads; 0 for none.
        """
        nothing = shown = relayed = self._lists[0]
        if type(awareness).perceive is not None and teammates >= 0:
            self.room = max(self.room, teammates)
            relayed = neighbour_room(self._rows, self.room)
            if not awareness.shows_teammates:
                shown = neighbour_room(self._rows, self.room)
        self._lists = nothing, shown, relayed
        self.is_situated = bool(inputs)
        # Situations can be huge in a large team: if the policy does not read them, `situate` makes them on demand.
        width = sum(awareness.width(max(team_size, 1))) if inputs else 0
        self._situations_room = np.zeros((self._rows, width), np.float32)
        self.fit(self.size)

    def grow(self, need: int) -> None:
        """Make room for at least this many entries; it takes effect when the group is bound again."""
        self.room = max(need + need // 4, 16)

    def perceive(self, awareness: Awareness) -> bool:
        """Update the arrays to the present neighbour lists; return whether there was room."""
        entry = perceive_entry(awareness)
        need = entry(self.record) if entry else 0
        if need > self.room:
            self.grow(need)
            return False
        if self.is_situated:
            situate_entry(awareness)(self.record)
        return True

    def situate(self, awareness: Awareness, moment: tuple[int, int]) -> npt.NDArray[np.float32]:
        """Return the situation vectors of the present moment, shape (n, width)."""
        if self._situated_at != moment:
            sensing = self.record.value
            team_size = sum(len(one.value.sensing_range) for one in sensing.scene.team)
            self._situations = np.zeros((self.size, sum(awareness.width(max(team_size, 1)))), np.float32)
            situate_entry(awareness)(SENSING.pack(sensing._replace(situation=self._situations)))
            self._situated_at = moment
        return self._situations
