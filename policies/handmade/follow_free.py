"""Follow free targets: the form of `LazyRegression` with a force that is set by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from teamsight.core.component import Count, Index, NonNegative
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, Percept
from teamsight.policies.lazy.lazy_regression import POINTS, follow_forces, parameters_of
from teamsight.policies.lazy.readings import FREE, KINDS
from teamsight.policies.learner import check_situations


@dataclass(frozen=True)
class FollowFree(CompiledPolicy):
    """Turn along the sum of the forces of free targets, f(d) = d^exponent, and make full steps.

    A target is free if no perceived teammate is nearer to it than the robot. Taken targets and teammates exert no
    force; without a free target in sight a robot goes straight on. These are the decisions of a `LazyRegression` that
    has learned this law. So it is the control of what that learns: what a learned team observes beyond this one was
    learned, and the rest is the design of both.

    Parameters
    ----------
    exponent : float
        Exponent of the force, at least 0; 0 for one that does not depend on the distance.
    teammates : int
        Number of sectors of the ring in which teammates are perceived; 0 for a robot without awareness, to which all
        targets are free.
    targets : int
        Number of sectors in which targets are sensed.

    Raises
    ------
    TypeError, ValueError
        If a parameter is outside its limits.
    """

    exponent: NonNegative = 1.0
    teammates: Index = 16
    targets: Count = 16

    kernel = follow_forces

    @property
    def inputs(self) -> int:  # type: ignore[override]
        return self.targets + self.teammates

    @property
    def degree(self) -> str:  # type: ignore[override]
        return "ring" if self.teammates else "none"

    @property
    def reads_teammates(self) -> bool:
        return False  # It reads the situation vector.

    def check_percept(self, percept: Percept) -> None:
        check_situations(self, percept)

    @property
    def table(self) -> npt.NDArray[np.float32]:
        forces = np.zeros((len(KINDS), POINTS), np.float32)
        forces[FREE] = np.linspace(0.0, 1.0, POINTS) ** self.exponent
        return forces

    @property
    def parameters(self) -> Floats:
        return parameters_of(self.targets, self.teammates, "sectors" if self.teammates else "")
