"""The interface of policies: the percept, the action and the state."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.card import shown
from teamsight.core.component import Component
from teamsight.core.neighbour_list import Filled, NeighbourList
from teamsight.policies.channels import NO_CHANNELS, NO_COLUMNS, Channels, PerceivedColumns

#: A need for the identities of teammates, which every degree of awareness meets that shows all of them.
IDENTITIES = "identities"
#: An array of float64.
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


# The time of percepts that were not made by a world.
_NO_TIME = np.zeros(1)
_NO_TIME.flags.writeable = False
# Those of percepts that were made without rewards; see `Percept.completed`.
_NO_REWARD, _NOT_ENDED = np.zeros(0), np.zeros(0, np.bool_)
# Those of percepts of robots without a lidar.
_NO_RAYS = np.zeros((0, 0))
# Those of percepts in which robots do not know their own identity.
_NOBODY = np.zeros(0, np.int64)


class Percept(NamedTuple):
    """What a group of n robots perceives at one decision.

    Attributes
    ----------
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    moved : ndarray, shape (n, 2), float64
        Own displacement since the last decision (odometry) [length].
    speed : ndarray, shape (n,), float64
        Largest distance per step [length].
    sensing_range, awareness_range : ndarray, shape (n,), float64
        Ranges within which targets and teammates are perceived [length].
    targets : NeighbourList
        The agents that this group senses as "targets".
    teammates : NeighbourList
        Teammates as the degree of awareness shows them.
    relayed : NeighbourList
        Targets that perceived teammates sense, o(N) only; offsets are from the robot itself.
    situation : ndarray, shape (n, width), float32
        The situation vector for learners; width 0 unless the policy declares `inputs`.
    channels : NamedTuple of NeighbourList
        What the group senses under other names: ``percept.channels.beacons``. In kernels, those that the policy
        declares as `Policy.channels`.
    time : ndarray, shape (1,), float64
        The present tick.
    reward : ndarray, shape (n,), float64
        The sum of what interactions have given each robot since its last decision; 0 without an interaction.
    ended : ndarray, shape (n,), bool
        Whether an interaction has ended a trial for each robot since its last decision.
    identity : ndarray, shape (n,), int64
        The robots' own identities; −1 if they are not known.
    columns : NamedTuple of ndarray, shape (identities,), float64
        Properties of agents, by identity, as they are at this decision; NaN for those without. Of a robot itself:
        ``percept.columns.load[percept.identity[i]]``. Those that the policy declares as `Policy.columns`.
    lidar : ndarray, shape (n, rays), float64
        The distance along each ray of the group's `Lidar` [length]; without one there are no rays.
    """

    heading: Annotated[Floats, "n", 2]
    moved: Annotated[Floats, "n", 2]
    speed: Annotated[Floats, "n"]
    sensing_range: Annotated[Floats, "n"]
    awareness_range: Annotated[Floats, "n"]
    targets: Filled
    teammates: Filled
    relayed: Filled
    situation: Annotated[npt.NDArray[np.float32], "n", "width"]
    channels: Channels[NeighbourList] = NO_CHANNELS
    time: Annotated[Floats, 1] = _NO_TIME
    reward: Annotated[Floats, "n"] = _NO_REWARD
    ended: Annotated[npt.NDArray[np.bool_], "n"] = _NOT_ENDED
    identity: Annotated[Integers, "n"] = _NOBODY
    columns: PerceivedColumns = NO_COLUMNS
    lidar: Annotated[Floats, "n", "rays"] = _NO_RAYS

    def _repr_html_(self) -> str | None:
        from teamsight.policies.percept_card import percepts_html

        return shown(lambda: percepts_html(self))

    def completed(self) -> Percept:
        """Return a percept with what it was made without: no rewards, no rays, and robots that know no identity."""
        size, percept = len(self.heading), self
        if len(self.reward) != size:
            percept = percept._replace(reward=np.zeros(size), ended=np.zeros(size, np.bool_))
        if len(self.identity) != size:
            percept = percept._replace(identity=np.full(size, -1))
        if len(self.lidar) != size:
            percept = percept._replace(lidar=np.zeros((size, 0)))
        return percept


class Action(NamedTuple):
    """The action of n robots: turn to a heading, then go a distance.

    Attributes
    ----------
    heading : ndarray, shape (n, 2), float64
        Unit vectors; (0, 0) keeps the heading. Limited by the body's turning limit.
    distance : ndarray, shape (n,), float64
        [length]; limited by the body's speed, and negative values count as 0.
    """

    heading: Annotated[Floats, "n", 2]
    distance: Annotated[Floats, "n"]


class PolicyState(NamedTuple):
    """The state that robots with a compiled policy keep between decisions: two tables with one row per robot.

    Attributes
    ----------
    floats : ndarray, shape (n, slots, fields), float64
    ints : ndarray, shape (n, slots, fields), int64
    """

    floats: Annotated[Floats, "n", "slots", "fields"]
    ints: Annotated[Integers, "n", "int slots", "int fields"]


class PolicyArrays(NamedTuple):
    """What the kernel of a policy reads besides the percept.

    Attributes
    ----------
    parameters : ndarray, shape (p,), float64
        The policy's constants.
    table : ndarray, shape (rows, columns), float32
        A table that all robots of the group share.
    state : PolicyState
        The state of each robot; the kernel changes it in place.
    """

    parameters: Annotated[Floats, "p"]
    table: Annotated[npt.NDArray[np.float32], "rows", "columns"]
    state: PolicyState


class Policy(Component, ABC):
    """A rule that maps percepts to actions: the base class of all policies.

    A subclass implements `decide`. It overrides `start` if robots keep state between decisions, and each attribute
    whose default is wrong for it. For full speed, derive from `CompiledPolicy`. The fields of a dataclass whose
    annotations say what they may be are checked, as in ``gain: Annotated[float, Allowed(above=0)] = 1.0``.

    Attributes
    ----------
    draws : int, default 0
        Uniform random numbers that each robot needs per decision.
    inputs : int, default 0
        Width of the situation vector that the policy reads; 0 if it reads none. A world whose degree of awareness has
        another width refuses the policy.
    rays : int, default 0
        Number of rays of the lidar that the policy reads; 0 if it reads none. A group whose lidar has another number
        refuses the policy.
    degree : str or None, default None
        Name of the only degree of awareness under which the policy works. Learners declare it, because situations of
        equal width can mean different things.
    channels : tuple of str, default ()
        Channels that the policy reads as ``percept.channels.NAME``. A world in which the group does not sense them
        refuses the policy.
    columns : tuple of str, default ()
        Properties of agents, its own and those of others that it perceives, that the policy reads as
        ``percept.columns.NAME``: columns of groups, such as those of an interaction, and what policies show; and of
        all agents those in `OF_BODIES`, such as "heading_x", "radius" and "blocked", unless a group has a column of
        that name. A world in which no group has them refuses the policy.
    shows : tuple of str, default ()
        What others can perceive of a robot's state, by name: the first fields of the first slot of its
        `PolicyState.floats`. Policies read it like a column.
    needs : tuple of str, default ()
        Fields of the percept that the policy requires: "targets", "teammates", "relayed"; or "identities", of
        teammates. A world whose degree of awareness never fills them refuses the policy.
        In `CMOMMT` the targets sense the robots if their policy needs "targets".
    decides_together : bool, default False
        Whether the kernel needs the state of all robots of the group at each decision. It is refused where robots
        decide at different steps, or by different policies, since its arrays then hold those that decide.
    effort : int, default 0
        Numbers that a decision of one robot compares, for policies that search a table. The worker pool estimates the
        time of a run from it.
    """

    draws: int = 0
    inputs: int = 0
    rays: int = 0
    degree: str | None = None
    channels: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    shows: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    decides_together: bool = False
    effort: int = 0

    def remedy(self, degree: str, width: int) -> str:
        """Return how the policy could be changed to fit situations of this degree and width; "" if it cannot."""
        return ""

    def start(self, size: int) -> Any:
        """Return the state of `size` robots before their first decision. Default: None.

        Use a NamedTuple of arrays with one row per robot, so that robots can leave the group.
        """
        return None

    @abstractmethod
    def decide(self, percept: Percept, state: Any, noise: Floats) -> tuple[Action, Any]:
        """Return the robots' actions and their new state.

        Parameters
        ----------
        percept : Percept
            What the robots perceive; must not be changed.
        state : object
            Their state after the last decision; must not be changed.
        noise : ndarray, shape (draws, n), float64
            Uniform numbers in (0, 1), one row per draw.
        """


def turned(heading: Floats, rotation: npt.ArrayLike) -> Floats:
    """Return headings turned by angles; the paper's action is (rotation, distance), §8.

    Parameters
    ----------
    heading : ndarray, shape (n, 2), float64
        Unit vectors.
    rotation : array_like, shape (n,)
        Anticlockwise [rad].

    Returns
    -------
    ndarray, shape (n, 2), float64
    """
    cosine, sine = np.cos(rotation), np.sin(rotation)
    x, y = heading[..., 0], heading[..., 1]
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
