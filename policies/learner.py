"""The bases of policies that learn from the transitions of a lazy memory: learners, and those that learn beforehand."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, fields
from functools import cached_property
from hashlib import blake2b
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.core.card import card, shown
from teamsight.core.component import Probability
from teamsight.core.kernel import inlined
from teamsight.policies.actions import ActionGrid
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Percept, Policy
from teamsight.policies.memory import LazyMemory
from teamsight.policies.memory.transitions import MOST
from teamsight.policies.rewards import Reward, name_of, own_reward


@inlined
def is_situation(situation: Any, inputs: int) -> bool:
    """Return whether all readings are numbers within the limits of a lazy memory."""
    for component in range(inputs):  # noqa: SIM110 (kernels have no generators)
        # Written so that NaN fails too.
        if not abs(situation[component]) <= MOST:
            return False
    return True


@inlined
def refuse(i: int, percept: Any, action: Any) -> None:
    """Write an invalid action for robot `i`, so that the world stops with an error."""
    action.heading[i, 0] = percept.heading[i, 0]
    action.heading[i, 1] = percept.heading[i, 1]
    action.distance[i] = np.nan


@dataclass(frozen=True, eq=False, repr=False)
class Learner(CompiledPolicy):
    """A policy that is made from explored transitions and a reward.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    reward : callable
        The reward function; see `teamsight.policies.rewards`.
    inputs : int, optional
        Number of components of a situation that are used: the robot's own (collective, for `NoAwareness`), or, by
        default, all (cooperative, for the degree of awareness of the exploration).

    Attributes
    ----------
    title : str
        What figures call the learner; by default its name.

    Raises
    ------
    TypeError, ValueError
        If a parameter is outside its limits, or the reward does not return a finite number for each transition.
    """

    title: ClassVar[str] = ""

    memory: LazyMemory
    reward: Reward = own_reward
    inputs: int = None  # type: ignore[assignment]  # replaced by a number in __post_init__

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "inputs", components(self.memory, self.inputs))

    @property
    @abstractmethod
    def learned(self) -> npt.NDArray[np.floating[Any]]:
        """The numbers that were learned from memory and reward."""

    @property
    def degree(self) -> str | None:  # type: ignore[override]
        """Name of the degree of awareness of the situations used; None if it is not in the memory's settings."""
        return "none" if self.inputs == self.memory.own else self.memory.settings.get("degree")

    def remedy(self, degree: str, width: int) -> str:
        fits = self.memory.inputs == width != self.inputs and self.memory.settings.get("degree", degree) == degree
        return f", or leave out inputs={self.inputs}" if fits else ""

    @property
    def reads_teammates(self) -> bool:
        return False  # A learner reads the situation vector.

    def check_percept(self, percept: Percept) -> None:
        check_situations(self, percept)

    @cached_property
    def _digest(self) -> str:
        return blake2b(self.learned.tobytes(), digest_size=4).hexdigest()

    def __repr__(self) -> str:
        names = [part.name for part in fields(self) if part.init and part.name not in ("memory", "reward")]
        constants = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        # Different reward functions may share a name; the digest of the learned numbers distinguishes such policies.
        return f"{type(self).__name__}({self.memory!r}, {name_of(self.reward)}, {constants}, learned={self._digest})"

    def _repr_html_(self) -> str | None:
        return shown(self._card)

    def _card(self) -> str:
        # Without what was learned, which may have to be computed first.
        rows = [("learned from", f"{len(self.memory):,} transitions"), ("reward", name_of(self.reward))]
        names = (part.name for part in fields(self) if part.init and part.name not in ("memory", "reward"))
        return card(type(self).__name__, [*rows, *((name, repr(getattr(self, name))) for name in names)])


def check_situations(policy: Policy, percept: Percept) -> None:
    """Raise an error if the situations of a percept are not as wide as those of a policy, or no numbers."""
    name, width = type(policy).__name__, percept.situation.shape[1]
    if width != policy.inputs:
        raise ValueError(f"{name}: the percept's situations have {width} components; it compares {policy.inputs}")
    # Written so that NaN is found too.
    wrong = np.flatnonzero(~(np.abs(percept.situation) <= MOST).all(axis=1))
    if len(wrong):
        raise ValueError(
            f"{name}: the situation of robot {wrong[0]} holds NaN or more than {MOST:g}; give 1 where nothing is sensed"
        )


def components(memory: LazyMemory, inputs: int | None) -> int:
    """Return the number of components of situations that are used: `inputs`, or all for None; refuse other numbers."""
    if not isinstance(memory, LazyMemory):
        raise TypeError(f"memory={memory!r}: must be a LazyMemory; load one with LazyMemory.load(path)")
    if inputs is None:
        return memory.inputs
    width = checks.count("inputs", inputs)
    if width not in (memory.own, memory.inputs):
        raise ValueError(
            f"inputs={width}: the memory has {memory.own} components for targets and {memory.added} for teammates; "
            f"use {memory.own} (collective) or all {memory.inputs} (cooperative)"
        )
    return width


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

    discount: Probability = 0.7
    actions: ActionGrid = ActionGrid()  # noqa: RUF009 (frozen)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.actions, ActionGrid):
            raise TypeError(f"actions={self.actions!r}: must be an ActionGrid(rotations, distances)")

    @property
    def learned(self) -> npt.NDArray[np.float32]:
        return self.table
