"""The automaton of robots with motor schemas, what they communicate, and the action for a mode and a goal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.component import Allowed, Count, NonNegative, Positive
from teamsight.core.kernel import inlined
from teamsight.policies.actions import go
from teamsight.policies.channels import column_of
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState
from teamsight.policies.schemas.vectors import avoid_obstacles, avoid_teammates, home_offset, persistent_noise

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
