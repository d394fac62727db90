"""The base of eager learners: values of a few actions, computed from all transitions when the policy is made."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.policies.actions import ActionGrid
from teamsight.policies.learner import Learner


@dataclass(frozen=True, eq=False, repr=False)
class EagerLearner(Learner):
    """A learner whose values are computed beforehand, so that decisions need no transitions.

    Parameters
    ----------
    memory, reward, inputs
        As for `Learner`.
    discount : float, default 0.7
        Discount factor γ, in [0, 1].
    actions : ActionGrid
        The actions to choose from.

    Raises
    ------
    TypeError, ValueError
        If a constant is outside its limits, or the reward does not return a finite number for each transition.
    """

    discount: float = 0.7
    actions: ActionGrid = ActionGrid()  # noqa: RUF009 (frozen)

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.number("discount", self.discount, least=0, most=1)
        if not isinstance(self.actions, ActionGrid):
            raise TypeError(f"actions={self.actions!r}: must be an ActionGrid(rotations, distances)")

    @property
    def learned(self) -> npt.NDArray[np.float32]:
        return self.table
