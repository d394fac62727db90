"""`Vehicle`: what all robots with Braitenberg behaviours have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from teamsight.core import checks
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import PolicyState

# The numbers and the whole numbers that a robot keeps; see `recovery`.
_NUMBERS, _COUNTERS = 3, 5


@dataclass(frozen=True)
class Vehicle(CompiledPolicy):
    """The base class of policies with the behaviours avoid, goal, slow, follow and find.

    Each behaviour is a Braitenberg vehicle: a left and a right reading drive a left and a right wheel. The mean of the
    wheels is the distance of the step, as a share of the speed; half their difference, times `agility`, is the
    rotation. An arbiter selects the behaviour by twelve cues, thresholded readings.

    Parameters
    ----------
    obstacle_range : float
        Distance within which robots ahead are obstacles [length].
    slow_range : float
        Distance within which the nearest perceived teammate slows a robot down [length].
    agility : float
        The rotation of one wheel at full speed against the other at full speed backwards [turns], at most 1/2.
    swerve : float
        How much a robot without a goal swerves: the largest difference of its wheels, in [0, 1].
    recovery : bool
        Whether a robot that pushes in vain turns its push, and then goes to another side of the box. It notices by
        odometry whether the box moves.
    patience : int
        Steps of stagnation after which it recovers, and steps that a recovery takes.
    contact : float
        Distance from the centre of the box within which it touches the box [length].

    Raises
    ------
    TypeError, ValueError
        If a value is of the wrong type or outside its limits.
    """

    obstacle_range: float = 1.5
    slow_range: float = 3.0
    agility: float = 0.25
    swerve: float = 0.5
    recovery: bool = True
    patience: int = 20
    contact: float = 2.6

    channels = ("obstacles",)
    draws = 1

    def __post_init__(self) -> None:
        for name in ("obstacle_range", "slow_range", "contact"):
            checks.number(name, getattr(self, name), above=0)
        checks.number("agility", self.agility, above=0, most=0.5)
        checks.number("swerve", self.swerve, least=0, most=1)
        checks.flag("recovery", self.recovery)
        checks.count("patience", self.patience)

    @property
    def parameters(self) -> tuple[float, ...]:
        patience = float(self.patience) if self.recovery else 0.0
        return self.obstacle_range, self.slow_range, self.agility, self.swerve, patience, self.contact

    def start(self, size: int) -> PolicyState:
        """Return the state of robots that do not recover: see `recovery`."""
        return PolicyState(np.zeros((size, 1, _NUMBERS)), np.zeros((size, 1, _COUNTERS), np.int64))
