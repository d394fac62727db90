"""Avoiding: robots that do not bump, whatever policy moves them.

By velocity obstacles: optimal reciprocal collision avoidance (ORCA), within buffered Voronoi cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Flag, NonNegative
from teamsight.core.kernel import Entry, inlined, kernel, scratch, specialise
from teamsight.policies.actions import check_action, check_answer, go
from teamsight.policies.channels import column_of
from teamsight.policies.compiled import CompiledPolicy, check_declarations, decides_in_kernel, decision_record
from teamsight.policies.interface import IDENTITIES, Action, Floats, Percept, Policy, PolicyArrays, PolicyState, turned
from teamsight.policies.percept_of_one import Rule, percept_of_one
from teamsight.policies.registry import POLICIES, label, policy_named
from teamsight.policies.steered import Steered

#: The most bodies that a robot can avoid at a time.
MOST = 64
# Lines between which the sine of the angle is not above this are taken for parallel.
_PARALLEL = 1e-9
# Of each body two half planes: that of the Voronoi cell, and that of the velocity obstacle.
_PLANES = 2 * MOST
# By which share Voronoi cells are farther apart than bodies must be, so that rounding makes no bumps.
_RIM = 1e-6
# The parameters, which stand behind those of the wrapped policy.
_HORIZON, _MARGIN, _NEIGHBOURS, _TARGETS, _STRICT, _OWN = range(6)


@inlined
def escape(
    x: float, y: float, velocity_x: float, velocity_y: float, reach: float, horizon: float, side: float
) -> tuple[float, float, float]:
    """Return the least change of the relative velocity of two bodies after which they do not meet for some time.

    Parameters
    ----------
    x, y : float
        From the one body to the other [length].
    velocity_x, velocity_y : float
        The velocity of the one minus that of the other [length/tick].
    reach : float
        The sum of their radii, above 0 [length].
    horizon : float
        How long they shall not meet [ticks]. Those that overlap shall be apart after one tick.
    side : float
        To which side the one goes, 1 or −1, if both are at the same place at the same velocity; for the other it is
        the opposite.

    Returns
    -------
    normal_x, normal_y : float
        The direction of the change, a unit vector that points out of the velocity obstacle.
    depth : float
        Its length [length/tick]; below 0 if they do not meet anyway, and the velocity may change by as much.
    """
    square = x * x + y * y
    overlap = square <= reach * reach
    time = 1.0 if overlap else horizon
    # The velocities that lead to a meeting are a cone, whose tip is cut off by a disc: those that meet at that time.
    from_x = velocity_x - x / time
    from_y = velocity_y - y / time
    along = from_x * x + from_y * y
    length = from_x * from_x + from_y * from_y
    if overlap or (along < 0.0 and along * along > reach * reach * length):
        root = math.sqrt(length)
        depth = reach / time - root
        if root > 0.0:
            return from_x / root, from_y / root, depth
        # From the centre of the disc all ways out are equally long.
        root = math.sqrt(square)
        if root > 0.0:
            return -x / root, -y / root, depth
        return side, 0.0, depth
    leg = math.sqrt(square - reach * reach)
    turn = 1.0 if x * from_y - y * from_x > 0.0 else -1.0
    normal_x = -(x * reach + turn * y * leg) / square
    normal_y = (turn * x * leg - y * reach) / square
    return normal_x, normal_y, -(velocity_x * normal_x + velocity_y * normal_y)


class HalfPlanes(NamedTuple):
    """Half planes of allowed velocities, each to the left of a line: a point of the line, and its direction.

    Attributes
    ----------
    x, y, along_x, along_y : ndarray, shape (planes,), float64
        The first ones are in use.
    """

    x: npt.NDArray[np.float64]
    y: npt.NDArray[np.float64]
    along_x: npt.NDArray[np.float64]
    along_y: npt.NDArray[np.float64]


@inlined
def _put(planes: Any, at: int, x: float, y: float, along_x: float, along_y: float) -> None:
    planes.x[at] = x
    planes.y[at] = y
    planes.along_x[at] = along_x
    planes.along_y[at] = along_y


@inlined
def _outside(planes: Any, at: int, x: float, y: float) -> float:
    """Return how far a point is outside of a half plane; below 0 inside."""
    return planes.along_x[at] * (planes.y[at] - y) - planes.along_y[at] * (planes.x[at] - x)  # type: ignore[no-any-return]


@inlined
def _crossing(planes: Any, i: int, j: int) -> tuple[float, float]:
    """Return the sine of the angle from line `i` to line `j`, and that times the way along `i` to where they cross."""
    sine = planes.along_x[i] * planes.along_y[j] - planes.along_y[i] * planes.along_x[j]
    return sine, -_outside(planes, j, planes.x[i], planes.y[i])


@inlined
def _on_line(
    planes: Any, i: int, speed: float, aim_x: float, aim_y: float, is_direction: bool
) -> tuple[bool, float, float]:
    """Solve the linear programme of `allowed_velocity` on line `i`, with the half planes before it.

    Returns
    -------
    exists : bool
        Whether there is such a velocity.
    x, y : float
    """
    x, y, along_x, along_y = planes.x[i], planes.y[i], planes.along_x[i], planes.along_y[i]
    middle = -(x * along_x + y * along_y)
    square = middle * middle + speed * speed - (x * x + y * y)
    if square < 0.0:
        return False, 0.0, 0.0
    half = math.sqrt(square)
    low, high = middle - half, middle + half
    for j in range(i):
        sine, way = _crossing(planes, i, j)
        if abs(sine) <= _PARALLEL:
            if way < 0.0:
                return False, 0.0, 0.0
        elif sine > 0.0:
            high = min(high, way / sine)
        else:
            low = max(low, way / sine)
        if low > high:
            return False, 0.0, 0.0
    if is_direction:
        best = high if aim_x * along_x + aim_y * along_y > 0.0 else low
    else:
        best = min(max(along_x * (aim_x - x) + along_y * (aim_y - y), low), high)
    return True, x + best * along_x, y + best * along_y


@kernel
def allowed_velocity(
    planes: Any, count: int, speed: float, aim_x: float, aim_y: float, is_direction: bool
) -> tuple[int, float, float]:
    """Return the velocity in all half planes, and not above a speed, that is nearest to an aim or farthest that way.

    Parameters
    ----------
    planes : HalfPlanes
        The half planes.
    count : int
        Their number.
    speed : float
        The greatest speed.
    aim_x, aim_y : float
        The aim, a velocity; or the direction, a unit vector.
    is_direction : bool
        Which of both.

    Returns
    -------
    first : int
        The first half plane that leaves no velocity; `count` if there is none.
    x, y : float
        The velocity; that of the half planes before it, if they leave none.

    Notes
    -----
    *Source:* de Berg et al., "Computational Geometry", the incremental linear programme in two dimensions.
    *Departs:* the half planes are taken in their order, nearest first, not at random.
    """
    x, y = aim_x, aim_y
    square = x * x + y * y
    if is_direction:
        x, y = speed * x, speed * y
    elif square > speed * speed:
        share = speed / math.sqrt(square)
        x, y = share * x, share * y
    for i in range(count):
        if _outside(planes, i, x, y) > 0.0:
            exists, new_x, new_y = _on_line(planes, i, speed, aim_x, aim_y, is_direction)
            if not exists:
                return i, x, y
            x, y = new_x, new_y
    return count, x, y


@kernel
def safest_velocity(
    planes: Any, hard: int, first: int, count: int, speed: float, x: float, y: float, others: Any
) -> tuple[float, float]:
    """Return the velocity that is least far outside of the half planes, where none is in all: in a dense crowd.

    Parameters
    ----------
    planes, count, speed
        As for `allowed_velocity`.
    hard : int
        The number of half planes, the first ones, in which it must be.
    first, x, y
        What `allowed_velocity` returned; `first` is not below `hard`.
    others : HalfPlanes
        Room for as many half planes.

    Notes
    -----
    *Source:* van den Berg et al. (2011), §5.3: the linear programme in three dimensions, of which the third is the
    distance by which half planes are moved outwards.
    """
    farthest = 0.0
    for i in range(hard):
        _put(others, i, planes.x[i], planes.y[i], planes.along_x[i], planes.along_y[i])
    for i in range(first, count):
        if not _outside(planes, i, x, y) > farthest:
            continue
        # Where a velocity is as far outside of this half plane as of one before it, is a line; to its left, it is
        # farther outside of this one.
        kept = hard
        along_x, along_y = planes.along_x[i], planes.along_y[i]
        for j in range(hard, i):
            sine, way = _crossing(planes, i, j)
            if abs(sine) > _PARALLEL:
                on_x = planes.x[i] + way / sine * along_x
                on_y = planes.y[i] + way / sine * along_y
            elif along_x * planes.along_x[j] + along_y * planes.along_y[j] > 0.0:
                continue
            else:
                on_x = 0.5 * (planes.x[i] + planes.x[j])
                on_y = 0.5 * (planes.y[i] + planes.y[j])
            way_x = planes.along_x[j] - along_x
            way_y = planes.along_y[j] - along_y
            length = math.sqrt(way_x * way_x + way_y * way_y)
            _put(others, kept, on_x, on_y, way_x / length, way_y / length)
            kept += 1
        failed, new_x, new_y = allowed_velocity(others, kept, speed, -along_y, along_x, True)
        # By rounding alone there may seem to be none.
        if failed == kept:
            x, y = new_x, new_y
        farthest = _outside(planes, i, x, y)
    return x, y


@inlined
def _nearest(seen: Any, i: int, percept: Any, most: int, chosen: Any, distance: Any, count: int, sign: int) -> int:
    """Add the bodies that robot `i` perceives in a neighbour list to the nearest ones, in order; return their number.

    A body is listed by its entry k in the first list, and by −1 − k in the second, whose `sign` is −1.
    """
    for k in range(seen.start[i], seen.start[i + 1]):
        # Bodies without a radius meet nobody; and NaN is not above 0.
        if not column_of(percept.columns.radius, seen.identity[k]) > 0.0:
            continue
        at = count
        if count == most:
            if not seen.distance[k] < distance[most - 1]:
                continue
            at = most - 1
        else:
            count += 1
        while at > 0 and seen.distance[k] < distance[at - 1]:
            chosen[at] = chosen[at - 1]
            distance[at] = distance[at - 1]
            at -= 1
        chosen[at] = k if sign > 0 else -1 - k
        distance[at] = seen.distance[k]
    return count


@inlined
def _pair(percept: Any, i: int, at: int) -> tuple[bool, float, float, float, float, int]:
    """Return what robot `i` perceives of a body that `_nearest` has listed.

    Returns
    -------
    is_teammate : bool
    x, y, distance : float
        From the robot to the body.
    reach : float
        The sum of the radii.
    other : int
        The identity of the body.
    """
    is_teammate = at >= 0
    seen = percept.teammates if is_teammate else percept.targets
    k = at if is_teammate else -1 - at
    other, radius = seen.identity[k], percept.columns.radius
    reach = column_of(radius, percept.identity[i]) + column_of(radius, other)
    return is_teammate, seen.offset[k, 0], seen.offset[k, 1], seen.distance[k], reach, other


@inlined
def _stay_in_cell(i: int, percept: Any, chosen: Any, count: int, planes: Any) -> int:
    """Write the half planes of velocities with which robot `i` stays in its Voronoi cell; return their number.

    Of the gap to a teammate each may use one half in a step. The velocity 0 is in all of them.
    """
    hard = 0
    for at in range(count):
        is_teammate, x, y, distance, reach, other = _pair(percept, i, chosen[at])
        gap = distance - (1.0 + _RIM) * reach
        # What does not avoid may use all of it.
        way = max(0.5 * gap if is_teammate else gap - column_of(percept.columns.speed, other), 0.0)
        if way < percept.speed[i] and distance > 0.0:
            x, y = x / distance, y / distance
            _put(planes, hard, way * x, way * y, -y, x)
            hard += 1
    return hard


@inlined
def _shun(i: int, percept: Any, parameters: Any, chosen: Any, count: int, planes: Any, hard: int) -> None:
    """Write the half plane of velocities with which robot `i` meets none of the bodies within the horizon, for each."""
    columns, own = percept.columns, percept.identity[i]
    velocity_x, velocity_y = column_of(columns.moved_x, own), column_of(columns.moved_y, own)
    for at in range(count):
        is_teammate, x, y, _, reach, other = _pair(percept, i, chosen[at])
        normal_x, normal_y, depth = escape(
            x, y, velocity_x - column_of(columns.moved_x, other), velocity_y - column_of(columns.moved_y, other),
            (1.0 + parameters[_MARGIN]) * reach, parameters[_HORIZON], 1.0 if own < other else -1.0,
        )  # fmt: skip
        # A teammate does the other half.
        share = 0.5 * depth if is_teammate else depth
        _put(planes, hard + at, velocity_x + share * normal_x, velocity_y + share * normal_y, normal_y, -normal_x)


@kernel
def _avoid(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    """Change the actions that the wrapped policy has written, where they could end in a bump."""
    parameters = arrays.parameters[arrays.parameters.shape[0] - _OWN :]
    most = int(parameters[_NEIGHBOURS])
    chosen, distance = scratch(MOST, np.int64), scratch(MOST, np.float64)
    planes = HalfPlanes(
        scratch(_PLANES, np.float64), scratch(_PLANES, np.float64), scratch(_PLANES, np.float64),
        scratch(_PLANES, np.float64),
    )  # fmt: skip
    others = HalfPlanes(
        scratch(_PLANES, np.float64), scratch(_PLANES, np.float64), scratch(_PLANES, np.float64),
        scratch(_PLANES, np.float64),
    )  # fmt: skip
    for i in range(percept.heading.shape[0]):
        if not column_of(percept.columns.radius, percept.identity[i]) > 0.0:
            continue
        count = _nearest(percept.teammates, i, percept, most, chosen, distance, 0, 1)
        if parameters[_TARGETS] > 0.0:
            count = _nearest(percept.targets, i, percept, most, chosen, distance, count, -1)
        hard = _stay_in_cell(i, percept, chosen, count, planes) if parameters[_STRICT] > 0.0 else 0
        _shun(i, percept, parameters, chosen, count, planes, hard)
        count += hard
        x, y = action.heading[i, 0], action.heading[i, 1]
        if x == 0.0 and y == 0.0:
            x, y = percept.heading[i, 0], percept.heading[i, 1]
        speed = percept.speed[i]
        way = min(max(action.distance[i], 0.0), speed)
        x, y = way * x, way * y
        # What is NaN is outside of nothing, and left for the check of actions.
        is_safe = True
        for at in range(count):
            is_safe = is_safe and not _outside(planes, at, x, y) > 0.0
        # What is safe is not changed, not even by rounding.
        if is_safe:
            continue
        first, x, y = allowed_velocity(planes, count, speed, x, y, False)
        if first < hard:
            # By rounding alone.
            x, y = 0.0, 0.0
        elif first < count:
            x, y = safest_velocity(planes, hard, first, count, speed, x, y, others)
        go(action, i, x, y, math.sqrt(x * x + y * y))


def _decide_and_avoid(address: int) -> int:
    """Call the kernel of the wrapped policy on the arrays of a decision record, then that of `Avoiding`."""
    decision = decision_at(address)  # type: ignore[name-defined]  # noqa: F821
    arrays = decision.arrays
    noise = decision.noise[decision.tick[0] % decision.noise.shape[0]]
    own = PolicyArrays(arrays.parameters[: arrays.parameters.shape[0] - _OWN], arrays.table, arrays.state)
    wrapped_kernel(decision.percept, own, noise, decision.action)  # type: ignore[name-defined]  # noqa: F821
    _avoid(decision.percept, arrays, noise, decision.action)
    return 0


@dataclass(frozen=True)
class _OfOne(Policy):
    """A function for one robot as a policy.

    Parameters
    ----------
    rule : callable
        ``rule(percept, rng)`` returns (turn, distance).
    """

    rule: Rule

    # Of the words that seed the generator of a robot.
    draws = 2

    def decide(self, percept: Percept, state: Any, noise: Floats) -> tuple[Action, Any]:
        size, name = len(percept.heading), label(self.rule)
        turn, distance = np.zeros(size), np.zeros(size)
        for i in range(size):
            rng = np.random.default_rng(noise[:, i].copy().view(np.uint64))
            turn[i], distance[i] = check_answer(name, self.rule(percept_of_one(percept, i), rng), i)
        return Action(turned(percept.heading, turn), distance), state


def _wrapped(name: str, value: Any) -> Policy:
    """Return the policy that a user gives to be wrapped."""
    if isinstance(value, str):
        value = policy_named(value, parameter=name)
    if isinstance(value, Avoiding):
        raise ValueError(f"{name}={checks.shown(value)}: avoids already; give the policy that it wraps")
    if isinstance(value, Policy):
        return value
    if isinstance(value, type) or not callable(value):
        raise TypeError(
            f"{name}={checks.shown(value)}: must be the name of a policy, a Policy, or a function f(percept, rng) -> "
            "(turn, distance)"
        )
    return _OfOne(value)


@dataclass(frozen=True)
class Avoiding(CompiledPolicy):
    """Do what another policy decides, and deviate from it as little as possible where bodies would bump.

    A robot avoids the nearest teammates that it perceives; of each it must know the displacement in the last step and
    the radius, so the degree of awareness must show who they are. Teammates are taken to avoid too: each does one half.
    What has no radius bumps into nobody, and is not avoided; nor are walls, which policies do not perceive. An action
    that is safe is not changed.

    Parameters
    ----------
    policy : Policy, str or callable
        The policy that is wrapped, as an object, by name, or as a function for one robot.
    horizon : float
        For how long the velocity of a robot leads to no bump if the others do likewise [ticks]. With a longer one
        robots deviate earlier.
    margin : float
        By which share of their radii bodies are taken to be larger, so that in a crowd some room is left.
    neighbours : int
        How many bodies a robot avoids at a time, the nearest.
    targets : bool
        Whether it avoids what it senses as targets too. They are taken not to avoid: the robot does all.
    strict : bool
        Whether robots also stay in their buffered Voronoi cells: of the gap to a teammate each uses at most one half in
        a step. Without, this is ORCA alone, and in dense crowds robots bump.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits.

    Notes
    -----
    *Source:* J. van den Berg, S. J. Guy, M. Lin, D. Manocha, "Reciprocal n-body collision avoidance" (Robotics
    Research, 2011): each neighbour leaves a half plane of velocities; a linear programme finds the one that is nearest
    to what the policy prefers or, in a crowd that leaves none, another the one that is least far outside of all half
    planes. D. Zhou, Z. Wang, S. Bandyopadhyay, M. Schwager, "Fast, on-line collision avoidance for dynamic vehicles
    using buffered Voronoi cells" (IEEE RA-L 2, 2017): robots that each stay in their own cell do not meet. *Departs:*
    the static obstacles of §6 are left out. The cell is that of one step; its half planes are constraints of both
    linear programmes, which always have a solution, since to stay is allowed.
    """

    policy: Annotated[Any, Allowed(check=_wrapped, choices=POLICIES)]
    horizon: Annotated[float, Allowed(least=1, cure="a step takes one tick", unit="ticks")] = 10.0
    margin: NonNegative = 0.2
    neighbours: Annotated[int, Allowed(least=1, most=MOST, cure="those that are farther are avoided later")] = 10
    targets: Flag = False
    strict: Flag = True

    kernel = _avoid

    def __post_init__(self) -> None:
        super().__post_init__()
        check_declarations(f"policy={label(self.policy)}", self.policy)
        # What it declares is what the other policy does, and more.
        declared = {name: getattr(self.policy, name) for name in Policy.__annotations__}
        declared["columns"] = tuple(dict.fromkeys((*declared["columns"], "moved_x", "moved_y", "radius", "speed")))
        declared["needs"] = tuple(dict.fromkeys((*declared["needs"], IDENTITIES)))
        for name, value in declared.items():
            object.__setattr__(self, name, value)

    @property
    def is_compiled(self) -> bool:
        return decides_in_kernel(self.policy)

    @property
    def parameters(self) -> Floats:
        own = (self.horizon, self.margin, self.neighbours, self.targets, self.strict)
        return np.append(np.asarray(self.policy.parameters, float), own)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return self.policy.table if self.is_compiled else super().table

    def start(self, size: int) -> Any:
        """Return the first state of the wrapped policy."""
        return self.policy.start(size)

    def remedy(self, degree: str, width: int) -> str:
        return self.policy.remedy(degree, width)  # type: ignore[no-any-return]

    def check_percept(self, percept: Percept) -> None:
        self.policy.check_percept(percept)
        if len(percept.identity) != len(percept.heading) or (percept.identity < 0).any():
            raise ValueError(
                "Avoiding: the percept does not say who the robots are, so that their own radius is unknown; give "
                "percept.identity, with indices of percept.columns"
            )

    def entry(self) -> Entry:
        """Return the compiled decision."""
        name, read = type(self.policy).__name__.lower(), decision_record(self.channels, self.columns).at
        bound = {"wrapped_kernel": type(self.policy).kernel, "decision_at": read, "declared_channels": self.channels}
        return specialise(_decide_and_avoid, f"avoiding-{name}", **bound)

    def decide(self, percept: Percept, state: Any, noise: Floats) -> tuple[Action, Any]:
        """Return the robots' actions and their new state; the arguments are not changed.

        Parameters
        ----------
        percept, state, noise
            As for `Policy.decide`.
        """
        if self.is_compiled:
            return super().decide(percept, state, noise)
        size = len(percept.heading)
        action, after = self.policy.decide(percept, state, noise)
        check_action(label(self.policy), action, size)
        # The same kernel, around a policy that carries out what was decided.
        steered = replace(self, policy=Steered("heading"))
        given = np.concatenate([action.heading, np.reshape(action.distance, (-1, 1))], axis=1)
        asked = PolicyState(np.ascontiguousarray(given, float)[:, np.newaxis], np.zeros((size, 0, 0), np.int64))
        return steered.decide(percept, asked, noise[:0])[0], after
