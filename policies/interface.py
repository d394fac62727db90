"""The contract between a mind and the rest: what a policy is told, what it answers, what it may remember."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.neighbour_list import Filled, NeighbourList

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class Percept(NamedTuple):
    """What a group of n robots knows at one decision.

    Attributes
    ----------
    heading : ndarray, shape (n, 2), float64
        Which way each faces: unit vectors.
    moved : ndarray, shape (n, 2), float64
        The own displacement since the last decision (odometry) [length].
    speed : ndarray, shape (n,), float64
        The farthest that each can go a step [length].
    sensing_range, awareness_range : ndarray, shape (n,), float64
        How far each senses targets and teammates [length].
    targets : NeighbourList
        The agents of the groups that this group senses.
    teammates : NeighbourList
        Teammates, as the degree of awareness shows them.
    relayed : NeighbourList
        Targets that perceived teammates sense (o(N) only), from the robot's own place.
    situation : ndarray, shape (n, width), float32
        The vector for learners; of width 0 unless the policy declares `inputs`.
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


class Action(NamedTuple):
    """What a group of n robots wants to do: face that way, then go that far.

    Attributes
    ----------
    heading : ndarray, shape (n, 2), float64
        Unit vectors; (0, 0) keeps the heading. The body's turning limit applies.
    distance : ndarray, shape (n,), float64
        [length]; the body's speed applies, and below 0 counts as 0.
    """

    heading: Annotated[Floats, "n", 2]
    distance: Annotated[Floats, "n"]


class PolicyState(NamedTuple):
    """What robots with a compiled policy remember: two tables, one row a robot.

    Attributes
    ----------
    real : ndarray, shape (n, slots, fields), float64
    whole : ndarray, shape (n, slots, fields), int64
    """

    floats: Annotated[Floats, "n", "slots", "fields"]
    ints: Annotated[Integers, "n", "int slots", "int fields"]


class PolicyArrays(NamedTuple):
    """What a policy's kernel has besides the percept.

    Attributes
    ----------
    parameters : ndarray, shape (p,), float64
        The policy's constants.
    knowledge : ndarray, shape (rows, columns), float32
        A table that all robots of the group share.
    state : PolicyState
        What each robot remembers; the kernel changes it in place.
    """

    parameters: Annotated[Floats, "p"]
    table: Annotated[npt.NDArray[np.float32], "rows", "columns"]
    state: PolicyState


@runtime_checkable
class Policy(Protocol):
    """A rule that turns percepts into actions.

    Attributes
    ----------
    draws : int
        How many uniform random numbers each robot needs for a decision.

    Notes
    -----
    Three more attributes are optional: ``inputs``, the width of the situation vector that the policy reads; ``degree``,
    the name of the degree of awareness whose situations it knows, for equal widths can mean different things; and
    ``needs``, the names of the percept's fields that it cannot do without. A world whose degree of awareness does not
    deliver them is refused. For full speed, derive from `CompiledPolicy`.
    """

    draws: int

    def start(self, size: int) -> Any:
        """Return what `size` robots remember before their first decision."""

    def decide(self, percept: Percept, memory: Any, noise: Floats) -> tuple[Action, Any]:
        """Return the robots' action and what they remember from now on.

        Parameters
        ----------
        percept : Percept
            What they know; not to be changed.
        memory : object
            What they remember.
        noise : ndarray, shape (draws, n), float64
            Uniform numbers in (0, 1), one row for each draw.
        """


class NeighboursOfOne(NamedTuple):
    """Who one robot sees: `identity` (k,), `offset` (k, 2) along the arena's axes, `distance` (k,)."""

    identity: Integers
    offset: Floats
    distance: Floats


class PerceptOfOne(NamedTuple):
    """What one robot knows; fields as in `Percept`, without the axis of robots."""

    heading: Floats
    moved: Floats
    speed: float
    sensing_range: float
    awareness_range: float
    targets: NeighboursOfOne
    teammates: NeighboursOfOne
    relayed: NeighboursOfOne
    situation: npt.NDArray[np.float32]


Rule = Callable[[PerceptOfOne, np.random.Generator], tuple[float, float]]


def percept_of_one(percept: Percept, i: int) -> PerceptOfOne:
    """Return what robot `i` of a group knows."""
    return PerceptOfOne(
        percept.heading[i],
        percept.moved[i],
        float(percept.speed[i]),
        float(percept.sensing_range[i]),
        float(percept.awareness_range[i]),
        _neighbours_of_one(percept.targets, i),
        _neighbours_of_one(percept.teammates, i),
        _neighbours_of_one(percept.relayed, i),
        percept.situation[i],
    )


def _neighbours_of_one(seen: NeighbourList, i: int) -> NeighboursOfOne:
    mine = slice(seen.start[i], seen.start[i + 1])
    return NeighboursOfOne(seen.identity[mine], seen.offset[mine], seen.distance[mine])


def percept_of_group_of_one(percept: PerceptOfOne) -> Percept:
    """Return what one robot knows as the percept of a group of one.

    Raises
    ------
    TypeError, ValueError
        If a field has the wrong type or shape, or its arrays differ in length: a kernel would read beyond their ends.
    """
    if not isinstance(percept, PerceptOfOne):
        raise TypeError(f"percept={type(percept).__name__}: must be a percept; change fields with percept._replace(…)")
    situation = np.asarray(percept.situation, np.float32)
    if situation.ndim != 1:
        raise ValueError(f"percept.situation: has the shape {situation.shape}; it must be (width,)")
    return Percept(
        _row("heading", percept.heading),
        _row("moved", percept.moved),
        _number("speed", percept.speed),
        _number("sensing_range", percept.sensing_range),
        _number("awareness_range", percept.awareness_range),
        _sightings_of_group_of_one("targets", percept.targets),
        _sightings_of_group_of_one("teammates", percept.teammates),
        _sightings_of_group_of_one("relayed", percept.relayed),
        np.ascontiguousarray(situation[None]),
    )


def _number(name: str, value: Any) -> Floats:
    return np.array([checks.number(f"percept.{name}", value, least=0)])


def _row(name: str, value: npt.ArrayLike) -> Floats:
    array = np.asarray(value, float)
    if array.shape != (2,):
        raise ValueError(f"percept.{name}: has the shape {array.shape}; it must be (2,)")
    if not np.isfinite(array).all():
        raise ValueError(f"percept.{name}={tuple(array.tolist())}: must be two finite numbers")
    return np.ascontiguousarray(array[None])


def _sightings_of_group_of_one(name: str, seen: NeighboursOfOne) -> NeighbourList:
    if not isinstance(seen, tuple) or len(seen) != len(NeighboursOfOne._fields):
        raise TypeError(f"percept.{name}: must be NeighboursOfOne(identity, offset, distance)")
    identity, offset, distance = (
        np.ascontiguousarray(part, kind) for part, kind in zip(seen, (np.int64, float, float), strict=True)
    )
    k = len(distance) if distance.ndim == 1 else -1
    if identity.shape != (k,) or offset.shape != (k, 2):
        shapes = f"{identity.shape}, {offset.shape} and {distance.shape}"
        raise ValueError(f"percept.{name}: identity, offset and distance are {shapes}; they must be (k,), (k, 2), (k,)")
    return NeighbourList(np.array([0, k]), identity, offset, distance)


def turned(heading: Floats, rotation: npt.ArrayLike) -> Floats:
    """Turn headings by angles: the paper's action is (rotation, distance), §8.

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
