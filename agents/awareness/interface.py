"""The contract of degrees of awareness: what a robot perceives of its teammates, and the inputs that this takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from teamsight.agents.awareness.sectors import OWN_SECTORS, situate_targets
from teamsight.core.kernel import Packed, Record
from teamsight.core.neighbour_list import Filled
from teamsight.core.parameters import parameters_of

Floats = npt.NDArray[np.float64]


class Width(NamedTuple):
    """Number of inputs of a robot: `own`, and `added` for its teammates."""

    own: int
    added: int


class TeamGroup(NamedTuple):
    """One group of a team.

    Attributes
    ----------
    first : int
        The index in the team of the group's first robot.
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    sensing_range : ndarray, shape (n,), float64
        [length].
    targets : NeighbourList
        The targets that its robots sense.
    farthest : float
        As in `Scene`.
    """

    first: int
    heading: Annotated[Floats, "n", 2]
    sensing_range: Annotated[Floats, "n"]
    targets: Filled
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


class Awareness:
    """A degree of awareness of teammates.

    A subclass overrides what differs from the defaults: nothing is shown of teammates, and the inputs are the robot's
    own. Worlds accept its objects. The fields of a subclass that is a dataclass are its options.

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
        return Width(OWN_SECTORS, self.added)

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
