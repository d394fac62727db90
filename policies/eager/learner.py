"""What eager learners have in common: pairs, a reward, and a few actions."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from functools import cached_property

from teamsight.core import checks
from teamsight.policies.actions import ActionGrid
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.interface import Floats, Percept
from teamsight.policies.lazy.action_values import components, degree_of, remedy
from teamsight.policies.lazy.learner import check_situation, digest_of
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, name_of, own_reward, rewards_of


@dataclass(frozen=True, eq=False, repr=False)
class EagerLearner(CompiledPolicy):
    """A policy that was worked out beforehand from the pairs of a memory and a reward.

    Parameters
    ----------
    memory : LazyMemory
        What was explored: the same samples that lazy learners have.
    reward : callable
        What is wanted; see `teamsight.policies.rewards`.
    inputs : int, optional
        How many components of a situation are used: the robot's own, or all of them, which is the default.
    discount : float, default 0.7
        Discount factor γ, in [0, 1].
    actions : ActionGrid
        Among what it chooses.

    Raises
    ------
    TypeError, ValueError
        If the memory is empty, a constant is outside its limits, or the reward function returns something else than a
        finite number for each pair.
    """

    memory: LazyMemory
    reward: Reward = own_reward
    inputs: int = None  # type: ignore[assignment]  # None means all; a number from here on
    discount: float = 0.7
    actions: ActionGrid = field(default_factory=ActionGrid)

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", components(self.memory, self.inputs))
        if not len(self.memory):
            raise ValueError("memory: holds no pair; explore first")
        checks.number("discount", self.discount, least=0, most=1)
        if not isinstance(self.actions, ActionGrid):
            raise TypeError(f"actions={self.actions!r}: must be an ActionGrid(turns, paces)")

    @property
    def width(self) -> int:
        """How many components of a situation it uses."""
        return self.inputs

    @property
    def degree(self) -> str | None:  # type: ignore[override]
        """The name of the degree of awareness whose situations it knows; None if the memory does not tell."""
        return degree_of(self.memory, self.inputs)

    def rewards(self) -> Floats:
        """Return the reward of every pair, shape (pairs,)."""
        return rewards_of(self.memory, self.reward)

    def __repr__(self) -> str:
        given = [part.name for part in fields(self) if part.init and part.name not in ("memory", "reward")]
        told = ", ".join(f"{name}={getattr(self, name)!r}" for name in given)
        # Two reward functions may share a name: the numbers learned tell equal policies from others.
        return f"{type(self).__name__}({self.memory!r}, {name_of(self.reward)}, {told}, learned={self._learned})"

    @cached_property
    def _learned(self) -> str:
        return digest_of(self.table)

    def remedy(self, degree: str, width: int) -> str:
        return remedy(self.memory, self.inputs, degree, width)

    def check_percept(self, percept: Percept) -> None:
        check_situation(type(self).__name__, percept, self.inputs)
