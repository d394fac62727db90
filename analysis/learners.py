"""Learners by name: what each makes of a memory and a reward, with the constants that they have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from teamsight import checks
from teamsight.agents.awareness import AWARENESS, Awareness, NoAwareness, RingAwareness
from teamsight.policies.eager import LinearQ, TabularQ
from teamsight.policies.interface import Floats
from teamsight.policies.lazy_memory import LazyMemory
from teamsight.policies.lazy_q import LazyQ
from teamsight.policies.pessimistic_lazy_q import PessimisticLazyQ
from teamsight.policies.rewards import Reward, alone_reward, own_reward, team_reward
from teamsight.policies.sheppard_lazy_q import SheppardLazyQ


def keep_reward(memory: LazyMemory) -> Floats:
    """Return −1 for each target that the robot sensed and no teammate did, and that it senses so no longer.

    It is no reward of the paper; docs/learning.md shows what it teaches.
    """
    return -np.asarray(memory.fact("alone_lost"), float)


#: Rewards by name: whose targets count, and whether gaining counts as well as losing.
REWARDS: Mapping[str, Reward] = MappingProxyType(
    {"own": own_reward, "team": team_reward, "alone": alone_reward, "keep": keep_reward}
)


class Lesson(NamedTuple):
    """What is to be learned, and how.

    Attributes
    ----------
    reward : callable
        See `teamsight.policies.rewards`.
    k : int or None
        How many pairs match a situation, for lazy learners; None for the learner's own default.
    gamma : float
        What a step later is worth now.
    """

    reward: Reward = own_reward
    k: int | None = None
    gamma: float = 0.7


def _lazy(kind: type[Any]) -> Callable[[LazyMemory, int, Lesson], Any]:
    def learn(memory: LazyMemory, inputs: int, lesson: Lesson) -> Any:
        constants = {"k": lesson.k} if lesson.k is not None else {}
        return kind(memory, lesson.reward, inputs=inputs, gamma=lesson.gamma, **constants)

    return learn


def _eager(kind: type[Any]) -> Callable[[LazyMemory, int, Lesson], Any]:
    def learn(memory: LazyMemory, inputs: int, lesson: Lesson) -> Any:
        return kind(memory, lesson.reward, inputs=inputs, gamma=lesson.gamma)

    return learn


def _sheppard(memory: LazyMemory, inputs: int, lesson: Lesson) -> Any:
    return SheppardLazyQ(inputs, lesson.reward, gamma=lesson.gamma, capacity=max(len(memory), 600), memory=memory)


#: Every learner by name.
LEARNERS: Mapping[str, Callable[[LazyMemory, int, Lesson], Any]] = MappingProxyType(
    {
        "lazy": _lazy(LazyQ),
        "pessimistic": _lazy(PessimisticLazyQ),
        "sheppard": _sheppard,
        "tabular": _eager(TabularQ),
        "linear": _eager(LinearQ),
    }
)
#: Those that match situations, to which `k` means something.
MATCHING = ("lazy", "pessimistic")


def learn(name: str, memory: LazyMemory, lesson: Lesson | None = None, *, inputs: int | None = None) -> Any:
    """Return the policy that a learner makes of a memory.

    Parameters
    ----------
    name : str
        "lazy", "pessimistic", "sheppard", "tabular" or "linear".
    memory : LazyMemory
        The pairs.
    lesson : Lesson, optional
        What is to be learned.
    inputs : int, optional
        How many components of a situation are used; by default all.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or the learner refuses what it is given.
    """
    chosen = LEARNERS[checks.choice("learner", name, LEARNERS)]
    return chosen(memory, memory.inputs if inputs is None else inputs, lesson or Lesson())


def awareness_for(memory: LazyMemory, inputs: int | None = None) -> Awareness:
    """Return the degree of awareness that shows robots the situations of a memory.

    Parameters
    ----------
    memory : LazyMemory
        The pairs; its settings name the degree.
    inputs : int, optional
        How many components are used; with the robot's own alone, it needs no awareness.

    Raises
    ------
    ValueError
        If the memory does not tell, or was explored under a degree of the user's own.
    """
    if (memory.inputs if inputs is None else inputs) == memory.own:
        return NoAwareness()
    name = memory.settings.get("degree")
    if name not in AWARENESS:
        raise ValueError(
            f"memory: was explored under the degree of awareness {name!r}, which is not one of "
            f"{', '.join(AWARENESS)}; give the policy and its degree to CMOMMT as objects"
        )
    return RingAwareness(memory.added) if name == "ring" else AWARENESS[name]()
