"""Learners by name: what each makes of a memory and a reward, with the constants that they have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from teamsight.agents.awareness import AWARENESS, Awareness, NoAwareness
from teamsight.core import checks
from teamsight.policies.eager import LinearQ, TabularQ
from teamsight.policies.interface import Floats
from teamsight.policies.lazy.action_values import MOST_MATCHES, check_constants, next_matches
from teamsight.policies.lazy.lazy_q import LazyQ
from teamsight.policies.lazy.pessimistic_lazy_q import PessimisticLazyQ
from teamsight.policies.lazy.sheppard_lazy_q import SheppardLazyQ
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import Reward, alone_reward, own_reward, team_reward


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
    discount : float
        Discount factor γ, in [0, 1].
    """

    reward: Reward = own_reward
    k: int | None = None
    discount: float = 0.7


#: Called with the work done and the work in all.
Progress = Callable[[float, float], None]


def _silent(done: float, total: float) -> None:
    pass


def _lazy(kind: type[Any]) -> Callable[[LazyMemory, int, Lesson, Progress], Any]:
    def learn(memory: LazyMemory, inputs: int, lesson: Lesson, progress: Progress) -> Any:
        k = kind.k if lesson.k is None else lesson.k
        check_constants(memory, k, lesson.discount, kind.sweeps)
        if lesson.discount > 0:
            # The learner would search them when it is made, and tell nothing meanwhile.
            next_matches(memory, k, inputs, progress)
        return kind(memory, lesson.reward, inputs=inputs, discount=lesson.discount, k=k)

    return learn


def _eager(kind: type[Any]) -> Callable[[LazyMemory, int, Lesson, Progress], Any]:
    def learn(memory: LazyMemory, inputs: int, lesson: Lesson, progress: Progress) -> Any:
        return kind(memory, lesson.reward, inputs=inputs, discount=lesson.discount)

    return learn


def _sheppard(memory: LazyMemory, inputs: int, lesson: Lesson, progress: Progress) -> Any:
    return SheppardLazyQ(inputs, lesson.reward, discount=lesson.discount, capacity=max(len(memory), 600), memory=memory)


#: Every learner by name.
LEARNERS: Mapping[str, Callable[[LazyMemory, int, Lesson, Progress], Any]] = MappingProxyType(
    {
        "lazy": _lazy(LazyQ),
        "pessimistic": _lazy(PessimisticLazyQ),
        "sheppard": _sheppard,
        "tabular": _eager(TabularQ),
        "linear": _eager(LinearQ),
    }
)
#: Those that match situations, and how many pairs match unless `k` is given.
MATCHING: Mapping[str, int] = MappingProxyType({"lazy": LazyQ.k, "pessimistic": PessimisticLazyQ.k})

# Pairs² × inputs that are compared in a second.
_COMPARED_A_SECOND = 30_000.0**2 * 32


def check_lesson(learners: Sequence[str], reward: str, k: int | None, pairs: int | None = None) -> None:
    """Refuse what one of the learners cannot learn; better now than in the middle of the work.

    Parameters
    ----------
    learners : sequence of str
        Names of learners.
    reward : str
        The name of the reward.
    k : int or None
        How many pairs match a situation, for those that match any; None for the learner's own default.
    pairs : int, optional
        How many pairs there are at least, where that is known.

    Raises
    ------
    ValueError
        Naming the value, the limit and the cure.
    """
    if "sheppard" in learners and REWARDS[reward] is not own_reward:
        raise ValueError(
            f"reward={reward}: sheppard goes on learning while it acts, and a robot knows only what it itself gained "
            "and lost; give the reward own, or another learner"
        )
    matching = [name for name in learners if name in MATCHING]
    if k is not None and not matching:
        verb = "matches" if len(learners) == 1 else "match"
        raise ValueError(f"k={k}: {' and '.join(learners)} {verb} no fixed number of pairs; leave it out")
    for name in matching:
        wanted = MATCHING[name] if k is None else k
        if wanted > MOST_MATCHES:
            raise ValueError(f"k={wanted}: must be at most {MOST_MATCHES}, which is what a decision has room for")
        if pairs is not None and wanted > pairs:
            raise ValueError(
                f"k={wanted}: the memory has only {pairs} pairs, and {name} matches so many; use a smaller k, or more "
                "pairs"
            )


def search_seconds(name: str, memory: LazyMemory, lesson: Lesson) -> float:
    """Return about how long a learner searches before it can act, with all inputs and with the robot's own [s]."""
    if name not in MATCHING or lesson.discount == 0:
        return 0.0
    inputs = memory.own + (memory.inputs if memory.added else 0)
    return float(len(memory)) ** 2 * inputs / _COMPARED_A_SECOND


def learn(
    name: str,
    memory: LazyMemory,
    lesson: Lesson | None = None,
    *,
    inputs: int | None = None,
    progress: Progress = _silent,
) -> Any:
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
    progress : callable
        Called with the pairs done and the pairs in all, by learners that search.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or the learner refuses what it is given.
    """
    chosen = LEARNERS[checks.choice("learner", name, LEARNERS)]
    return chosen(memory, memory.inputs if inputs is None else inputs, lesson or Lesson(), progress)


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
    if not isinstance(name, str) or name not in AWARENESS:
        raise ValueError(
            f"memory: was explored under the degree of awareness {checks.shown(name)}, which is not one of "
            f"{', '.join(AWARENESS)}; give the policy and its degree to CMOMMT as objects"
        )
    return AWARENESS[name].adding(memory.added)
