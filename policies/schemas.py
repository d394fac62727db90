"""Motor schemas: robots that add up the vectors of simple behaviours."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.angles import direction
from teamsight.core.component import Allowed, Count, Flag, NonNegative, Positive
from teamsight.core.kernel import inlined
from teamsight.policies.actions import go
from teamsight.policies.channels import column_of
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState


@inlined
def repulsion(distance: float, sphere: float) -> float:
    """Return the length of the vector away from something: 1 at distance 0, 0 from the sphere on, linear in between."""
    return min(max((sphere - distance) / sphere, 0.0), 1.0)


@inlined
def home_offset(i: int, percept: Any) -> tuple[float, float]:
    """Return the offset from robot `i` to its home; (0, 0) if it does not sense it."""
    seen = percept.channels.home
    if seen.start[i] == seen.start[i + 1]:
        return 0.0, 0.0
    return seen.offset[seen.start[i], 0], seen.offset[seen.start[i], 1]


@inlined
def avoid_obstacles(home_x: float, home_y: float, obstacles: Any, sphere: float) -> tuple[float, float]:
    """Return the sum of the vectors away from round obstacles: rows of x and y from home, and radius."""
    sum_x = 0.0
    sum_y = 0.0
    for row in range(obstacles.shape[0]):
        x = -home_x - obstacles[row, 0]
        y = -home_y - obstacles[row, 1]
        reach = obstacles[row, 2] + sphere
        square = x * x + y * y
        if 0.0 < square < reach * reach:
            length = math.sqrt(square)
            share = repulsion(length - obstacles[row, 2], sphere) / length
            sum_x += share * x
            sum_y += share * y
    return sum_x, sum_y


@inlined
def avoid_teammates(i: int, percept: Any, sphere: float) -> tuple[float, float]:
    """Return the sum of the vectors away from teammates; those at the same place do not count."""
    seen = percept.teammates
    sum_x = 0.0
    sum_y = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        distance = seen.distance[k]
        if 1e-9 < distance < sphere:
            share = repulsion(distance, sphere) / distance
            sum_x -= share * seen.offset[k, 0]
            sum_y -= share * seen.offset[k, 1]
    return sum_x, sum_y


@inlined
def persistent_noise(i: int, state: Any, persistence: float, share: float) -> tuple[float, float]:
    """Return a random direction that stays for some steps; `share` of a turn is the next one."""
    if state.ints[i, 0, 0] <= 0:
        x, y = direction(share)
        state.floats[i, 0, 3] = x
        state.floats[i, 0, 4] = y
        state.ints[i, 0, 0] = int(persistence)
    state.ints[i, 0, 0] -= 1
    return state.floats[i, 0, 3], state.floats[i, 0, 4]


#: What a robot does. One that follows a teammate is not followed itself.
WANDER, FOLLOW, ACQUIRE, WORK = 0.0, 1.0, 2.0, 3.0
#: What robots communicate.
COMMUNICATION = ("none", "state", "goal")
# The parameters that all kernels have.
(_COMMUNICATION, _GOAL, _OBSTACLE, _OBSTACLE_SPHERE, _ROBOT, _ROBOT_AT_WORK, _ROBOT_SPHERE, _NOISE, _NOISE_AT_WORK,
 _PERSISTENCE) = range(10)  # fmt: skip


@inlined
def followed(i: int, percept: Any, arrays: Any) -> tuple[float, float, float]:
    """Return whether a perceived teammate is at work, and where robot `i` goes for it: the nearest, or its goal."""
    seen = percept.teammates
    kind = arrays.parameters[_COMMUNICATION]
    nearest = math.inf
    x = 0.0
    y = 0.0
    home_x, home_y = home_offset(i, percept)
    for k in range(seen.start[i], seen.start[i + 1] if kind > 0.0 else seen.start[i]):
        mode = column_of(percept.columns.mode, seen.identity[k])
        if mode >= ACQUIRE and seen.distance[k] < nearest:
            nearest = seen.distance[k]
            x = seen.offset[k, 0]
            y = seen.offset[k, 1]
            if kind == 2.0:
                # Goals are communicated as places: offsets from home.
                x = home_x + column_of(percept.columns.goal_x, seen.identity[k])
                y = home_y + column_of(percept.columns.goal_y, seen.identity[k])
    return 1.0 if nearest < math.inf else 0.0, x, y


@inlined
def drive(i: int, percept: Any, arrays: Any, noise: Any, action: Any, mode: float, x: float, y: float) -> None:
    """Write the action of robot `i` with a mode and the offset (x, y) to its goal, and what it shows of its state."""
    parameters = arrays.parameters
    state = arrays.state
    home_x, home_y = home_offset(i, percept)
    state.floats[i, 0, 0] = mode
    state.floats[i, 0, 1] = x - home_x
    state.floats[i, 0, 2] = y - home_y
    works = mode >= FOLLOW
    avoid_x, avoid_y = avoid_obstacles(home_x, home_y, arrays.table, parameters[_OBSTACLE_SPHERE])
    apart_x, apart_y = avoid_teammates(i, percept, parameters[_ROBOT_SPHERE])
    noise_x, noise_y = persistent_noise(i, state, parameters[_PERSISTENCE], noise[0, i])
    apart = parameters[_ROBOT_AT_WORK] if works else parameters[_ROBOT]
    random = parameters[_NOISE_AT_WORK] if works else parameters[_NOISE]
    sum_x = parameters[_OBSTACLE] * avoid_x + apart * apart_x + random * noise_x
    sum_y = parameters[_OBSTACLE] * avoid_y + apart * apart_y + random * noise_y
    length = math.sqrt(x * x + y * y)
    limit = percept.speed[i]
    if works and length > 1e-9:
        sum_x += parameters[_GOAL] * x / length
        sum_y += parameters[_GOAL] * y / length
        # It does not overshoot.
        limit = min(limit, length)
    go(action, i, sum_x, sum_y, min(math.sqrt(sum_x * sum_x + sum_y * sum_y) * percept.speed[i], limit))


@dataclass(frozen=True)
class Schemas(CompiledPolicy):
    """The base class of policies that add up motor schemas: what they have in common.

    Parameters
    ----------
    communication : {"none", "state", "goal"}
        What robots perceive of teammates besides their places. "state": whether they are at work; a robot without a
        goal goes to the nearest that is. "goal": also the place to which they go, and it goes there.
    obstacles : tuple of (float, float, float)
        The round obstacles that robots know: x and y from home, and radius [length].
    goal : float
        Gain of going to the goal.
    obstacle : float
        Gain of keeping away from obstacles.
    robot, robot_at_work : float
        Gain of keeping away from teammates: for a robot without a goal, and for one with a goal, "at work".
    noise, noise_at_work : float
        Gain of the random direction: for a robot without a goal, and for one with a goal.
    obstacle_sphere : float
        Distance from the rim of an obstacle at which repulsion begins [length].
    robot_sphere : float
        Distance from a teammate at which repulsion begins [length].
    persistence : int
        Steps for which a random direction stays.

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits.
    """

    communication: Annotated[str, Allowed(choices=COMMUNICATION)] = "none"
    obstacles: tuple[tuple[float, float, float], ...] = ()
    goal: NonNegative = 1.0
    obstacle: NonNegative = 1.0
    obstacle_sphere: Positive = 2.0
    robot: NonNegative = 1.0
    robot_at_work: NonNegative = 0.1
    robot_sphere: Positive = 5.0
    noise: NonNegative = 1.0
    noise_at_work: NonNegative = 0.2
    persistence: Count = 8

    channels = ("home",)
    shows = ("mode", "goal_x", "goal_y")
    draws = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.array(self.obstacles, float).shape not in ((0,), (len(self.obstacles), 3)):
            raise ValueError(f"obstacles={checks.shown(self.obstacles)}: must be a tuple of (x, y, radius)")

    @property
    def parameters(self) -> tuple[float, ...]:
        return (
            COMMUNICATION.index(self.communication), self.goal, self.obstacle, self.obstacle_sphere, self.robot,
            self.robot_at_work, self.robot_sphere, self.noise, self.noise_at_work, self.persistence,
        )  # fmt: skip

    @property
    def table(self) -> npt.NDArray[np.float32]:
        return np.array(self.obstacles, np.float32).reshape(-1, 3)

    def start(self, size: int) -> PolicyState:
        """Return the state of robots that wander: mode, goal and direction; steps that it still stays."""
        return PolicyState(np.zeros((size, 1, 5)), np.zeros((size, 1, 1), np.int64))


_DELIVERS = 10


@inlined
def _nearest_attractor(i: int, percept: Any) -> tuple[float, float, float]:
    """Return whether robot `i` senses an attractor that still has mass, and the offset to the nearest."""
    seen = percept.targets
    nearest = math.inf
    x = 0.0
    y = 0.0
    for k in range(seen.start[i], seen.start[i + 1]):
        if seen.distance[k] < nearest and column_of(percept.columns.mass, seen.identity[k]) > 0.0:
            nearest = seen.distance[k]
            x = seen.offset[k, 0]
            y = seen.offset[k, 1]
    return 1.0 if nearest < math.inf else 0.0, x, y


@inlined
def _forage(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        mode = WANDER
        x = 0.0
        y = 0.0
        if column_of(percept.columns.attached, percept.identity[i]) > 0.0:
            mode = WORK
            if arrays.parameters[_DELIVERS] > 0.0:
                x, y = home_offset(i, percept)
        else:
            found, x, y = _nearest_attractor(i, percept)
            if found > 0.0:
                mode = ACQUIRE
            else:
                found, x, y = followed(i, percept, arrays)
                mode = FOLLOW if found > 0.0 else WANDER
        drive(i, percept, arrays, noise, action, mode, x, y)
        if mode == WORK:
            # The goal that others can help with is the attractor, which is here, and not home.
            home_x, home_y = home_offset(i, percept)
            arrays.state.floats[i, 0, 1] = -home_x
            arrays.state.floats[i, 0, 2] = -home_y


@dataclass(frozen=True)
class ForageSchemas(Schemas):
    """Wander until an attractor is sensed, go to it, and deliver it at home, or stay with it.

    Parameters
    ----------
    communication, obstacles, goal, obstacle, obstacle_sphere, robot, robot_at_work, robot_sphere, noise, noise_at_work,
    persistence
        As for `Schemas`.
    delivers : bool
        Whether an attached robot goes home; otherwise it stays where it is.

    Notes
    -----
    *Source:* Balch and Arkin (1994); their gains are unknown, and these are plausible ones.
    *Departs:* a robot that follows another does not show that it is at work, so that two robots cannot follow each
    other; the goal that a robot shows is its attractor, also while it carries it; repulsion is at most 1 instead of
    infinite. The robots know where obstacles are, and how far home is.
    """

    delivers: Flag = True

    columns = ("attached", "mass", "mode", "goal_x", "goal_y")
    kernel = _forage

    @property
    def parameters(self) -> tuple[float, ...]:
        return (*super().parameters, float(self.delivers))


@inlined
def _graze(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        x = column_of(percept.columns.probe_x, percept.identity[i])
        y = column_of(percept.columns.probe_y, percept.identity[i])
        mode = WORK
        # Not a number for a robot that does not probe.
        if (x == 0.0 and y == 0.0) or math.isnan(x) or math.isnan(y):
            found, x, y = followed(i, percept, arrays)
            mode = FOLLOW if found > 0.0 else WANDER
        drive(i, percept, arrays, noise, action, mode, x, y)


@dataclass(frozen=True)
class GrazeSchemas(Schemas):
    """Wander until there is fresh ground within reach of the probe, then go to the nearest.

    Parameters
    ----------
    communication, obstacles, goal, obstacle, obstacle_sphere, robot, robot_at_work, robot_sphere, noise, noise_at_work,
    persistence
        As for `Schemas`.

    Notes
    -----
    *Source:* Balch and Arkin (1994). *Departs:* as `ForageSchemas`; their probe schema is unknown, this one goes to the
    nearest fresh ground.
    """

    columns = ("probe_x", "probe_y", "mode", "goal_x", "goal_y")
    kernel = _graze
