"""Drives: how the bodies of a group carry out their actions, within what their wheels can do.

A policy's action is what it wants: a turn and a distance. A drive makes of it what happens: how far the body goes ahead
and to the left, and how far it turns. `Drive.state` is what it remembers of the step before, such as wheel speeds.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.core.component import Allowed, Component
from teamsight.core.contracts import check_names, numbers, object_of, parameters_of
from teamsight.core.elementary import atan2, cos_sin
from teamsight.core.kernel import inlined, plain
from teamsight.core.kernel.parts import Kernel
from teamsight.world.registry import DRIVES

Floats = npt.NDArray[np.float64]
Carry = Callable[..., tuple[float, float, float]]

Base = Annotated[float, Allowed(above=0, unit="length", cure="give the distance between the wheels")]
Change = Annotated[float, Allowed(above=0, cure="give None for wheels that reach any speed in one step")]
Steering = Annotated[
    float,
    Allowed(above=0, most=1.5, unit="rad", cure="give less than a quarter of a turn"),
]

# Of turns below it, the arc is as long as its chord.
_STRAIGHT = 1e-8
# Stands for no limit: constants of kernels are finite.
_ANY = 1e300


@inlined
def along_arc(length: float, turn: float) -> tuple[float, float, float]:
    """Return how far a body gets ahead and to the left on an arc of this length and turn [rad], and the turn."""
    half_cosine, half_sine = cos_sin(0.5 * turn)
    chord = length if abs(turn) < _STRAIGHT else length * half_sine / (0.5 * turn)
    return chord * half_cosine, chord * half_sine, turn


@inlined
def _limited(wanted: float, before: float, change: float) -> float:
    return min(max(wanted, before - change), before + change)


@inlined
def _differential(
    turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any
) -> tuple[float, float, float]:
    base, change = parameters[0], parameters[1]
    left = distance - 0.5 * base * turn
    right = distance + 0.5 * base * turn
    # Slower on the same arc, if a wheel would be too fast.
    fastest = max(abs(left), abs(right))
    share = speed / fastest if fastest > speed else 1.0
    if is_blocked:
        state[0] = 0.0
        state[1] = 0.0
    left = min(max(_limited(left * share, state[0], change), -speed), speed)
    right = min(max(_limited(right * share, state[1], change), -speed), speed)
    state[0] = left
    state[1] = right
    return along_arc(0.5 * (left + right), (right - left) / base)


@inlined
def _car(
    turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any
) -> tuple[float, float, float]:
    base, largest, rate, change = parameters[0], parameters[1], parameters[2], parameters[3]
    wanted = min(max(atan2(turn * base, distance), -largest), largest)
    steering = min(max(_limited(wanted, state[1], rate), -largest), largest)
    before = 0.0 if is_blocked else state[0]
    velocity = min(_limited(distance, before, change), speed)
    state[0] = velocity
    state[1] = steering
    cosine, sine = cos_sin(steering)
    return along_arc(velocity, velocity * sine / (cosine * base))


class Drive(Component):
    """How the bodies of a group carry out their actions: the base class.

    A subclass defines `carry`. The fields of one that is a dataclass are the constants of the kernel.

    Attributes
    ----------
    state : tuple of str
        The names of the numbers that it keeps for each body from step to step, such as wheel speeds. They begin at 0,
        and are 0 after a step in which the body was inactive.
    carry : kernel
        ``carry(turn, distance, speed, is_blocked, state, parameters)`` returns how far the body goes ahead and to the
        left of its heading before the step [length], and how far it turns anticlockwise [rad]. The policy asks for the
        turn, from −π to π and within the group's turning limit, and for the distance, from 0 to the speed, which is the
        largest distance of a step. `is_blocked` says whether another body was in its way in the last step. `state` are
        its own numbers, in the order of their names, which the kernel rewrites.

    Examples
    --------
    >>> @kernel
    ... def glide(turn, distance, speed, is_blocked, state, parameters):
    ...     state[0] += parameters[0] * (distance - state[0])
    ...     return state[0], 0.0, turn
    >>> @dataclass(frozen=True)
    ... class Glider(Drive):
    ...     state = ("velocity",)
    ...     carry = glide
    ...     response: float = 0.2
    """

    state: ClassVar[tuple[str, ...]] = ()
    carry: ClassVar[Carry]

    @property
    def parameters(self) -> tuple[float, ...] | Floats:
        """The constants, in the order in which the kernel reads them; by default the fields of a dataclass."""
        return parameters_of(self, Drive)


@dataclass(frozen=True)
class Free(Drive):
    """Bodies turn at once, within the turning limit of their group, and go straight ahead."""

    @property
    def parameters(self) -> tuple[float, ...]:
        """None."""
        return ()


@dataclass(frozen=True)
class DifferentialDrive(Drive):
    """Two wheels side by side, each with a speed of its own: the body goes along an arc, or turns on the spot.

    The wheels are set for the arc that has the turn and the length of the action. Where one of them would be faster
    than the group's `speed`, both are slower, on the same arc. A body that another one blocks loses its speed.

    Parameters
    ----------
    wheel_base : float
        The distance between the wheels [length].
    acceleration : float, optional
        How much the speed of a wheel changes in a step at most [length a tick, in each tick]; by default any.

    Notes
    -----
    With wheel speeds l and r and wheel base b, the body turns by (r − l)/b in a step on an arc of the length (l + r)/2.
    In the world it moves straight from the beginning of the arc to its end.
    """

    state: ClassVar[tuple[str, ...]] = ("left", "right")
    carry = _differential

    wheel_base: Base = 0.1
    acceleration: Change | None = None

    @property
    def parameters(self) -> tuple[float, ...]:
        """The wheel base, and the acceleration; 1e300 for any."""
        return self.wheel_base, _or_any(self.acceleration)


@dataclass(frozen=True)
class Car(Drive):
    """Steered front wheels: the body goes ahead along an arc, and cannot turn on the spot.

    The wheels are steered for the arc that has the turn and the length of the action, as far as they can be. An action
    without a distance stops the car. A body that another one blocks loses its speed.

    Parameters
    ----------
    wheel_base : float
        The distance between the axles [length].
    largest_steering : float
        The largest steering angle, to either side [rad].
    steering_rate : float, optional
        How much the steering angle changes in a step at most [rad]; by default any.
    acceleration : float, optional
        How much the speed changes in a step at most [length a tick, in each tick]; by default any.

    Notes
    -----
    The kinematic bicycle with the rear axle as its place: at a steering angle φ the radius of the arc is
    wheel_base / tan φ. In the world the body moves straight from the beginning of the arc to its end.
    """

    state: ClassVar[tuple[str, ...]] = ("velocity", "steering")
    carry = _car

    wheel_base: Base = 0.1
    largest_steering: Steering = 0.6
    steering_rate: Change | None = None
    acceleration: Change | None = None

    @property
    def parameters(self) -> tuple[float, ...]:
        """Wheel base, largest steering angle, steering rate and acceleration; 1e300 for any."""
        return self.wheel_base, self.largest_steering, _or_any(self.steering_rate), _or_any(self.acceleration)


def _or_any(limit: float | None) -> float:
    return _ANY if limit is None else limit


def drive_of(value: Any) -> Drive:
    """Return the drive that a user gives, as an object or by name.

    Raises
    ------
    TypeError, ValueError
        If it is no drive, its name is unknown, or a declaration is wrong.
    """
    drive: Drive = object_of("drive", value, DRIVES, Drive)
    name = type(drive).__name__
    if type(drive) is Free:
        return drive
    carry, example = getattr(drive, "carry", None), "carry(turn, distance, speed, is_blocked, state, parameters)"
    if isinstance(drive, Free) or not isinstance(carry, Kernel):
        cure = "derive from Drive, and give" if isinstance(drive, Free) else "give"
        raise TypeError(f"drive={name}: has no kernel 'carry'; {cure} {example} -> (ahead, left, turn), with @kernel")
    taken = list(inspect.signature(plain(carry)).parameters)
    if len(taken) != example.count(",") + 1:
        raise TypeError(f"drive={name}: its carry takes ({', '.join(taken)}), and must take those of {example}")
    check_names(f"{name}.state", drive.state, "('left', 'right')")
    if len(set(drive.state)) < len(drive.state):
        raise ValueError(f"{name}.state={drive.state}: give each number a name of its own")
    numbers(f"{name}.parameters", drive.parameters)
    return drive
