"""Rewards: what an exploration is asked afterwards; the memory itself knows of none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.policies.interface import Floats
from teamsight.policies.memory import LazyMemory

#: Takes a memory and returns what each of its pairs was worth at once, shape (pairs,).
Reward: TypeAlias = Callable[[LazyMemory], npt.ArrayLike]

#: Whose targets count, and the facts that tell of them.
SCOPES = {"own": ("gained", "lost"), "team": ("team_gained", "team_lost"), "alone": ("alone_gained", "alone_lost")}
#: What a pair is worth that gained and lost targets at once.
BOTH = {"gain": 1.0, "loss": -1.0, "none": 0.0}


@dataclass(frozen=True)
class GainReward:
    """+1 if one or more targets were acquired, −1 if one or more were lost, 0 otherwise.

    Parameters
    ----------
    scope : {"own", "team", "alone"}
        Whose targets: those that the robot senses; those that at least one robot of the team senses; or those that the
        robot senses and no teammate does.
    both : {"gain", "loss", "none", "net"}
        What counts when targets were acquired and lost at once: the gain (+1), the loss (−1), neither (0), or the sign
        of their difference.

    Raises
    ------
    ValueError
        If a rule is unknown.

    Notes
    -----
    *Source:* §8.2, "+1 if one (or more) targets have been acquired compared to the previous situation, −1 if one (or
    more) targets have been lost, or 0 otherwise"; read in this order, a gain comes first. *Departs:* the paper does not
    say whether the robot or its team acquires.
    """

    scope: str = "own"
    both: str = "gain"

    def __post_init__(self) -> None:
        checks.choice("scope", self.scope, SCOPES)
        checks.choice("both", self.both, (*BOTH, "net"))

    def __call__(self, memory: LazyMemory) -> Floats:
        """Return the reward of every pair, shape (pairs,)."""
        gained, lost = (np.asarray(memory.fact(name), float) for name in SCOPES[self.scope])
        if self.both == "net":
            return np.asarray(np.sign(gained - lost), float)
        reward = (gained > 0).astype(float) - (lost > 0)
        reward[(gained > 0) & (lost > 0)] = BOTH[self.both]
        return reward


own_reward = GainReward("own")
team_reward = GainReward("team")
alone_reward = GainReward("alone")


def rewards_of(memory: LazyMemory, reward: Reward) -> Floats:
    """Return what a reward function says of every pair, after checking it.

    Parameters
    ----------
    memory : LazyMemory
        The pairs.
    reward : callable
        ``reward(memory)`` returns one finite number a pair.

    Returns
    -------
    ndarray, shape (pairs,), float64

    Raises
    ------
    TypeError, ValueError
        If it is no such function, naming it, the pair and the value.
    """
    if not callable(reward):
        raise TypeError(f"reward={reward!r}: must be a callable reward(memory) -> array of shape (pairs,)")
    name = f"reward {name_of(reward)}"
    if isinstance(reward, type):
        raise TypeError(f"{name}: is a class; give an object, {reward.__name__}()")
    answer: Any = reward(memory)
    if answer is None:
        raise TypeError(f"{name}: returned None; is `return` missing?")
    try:
        if np.iscomplexobj(answer):
            # Half of it would get lost.
            raise TypeError
        found = np.array(answer, dtype=float)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: returned {type(answer).__name__}; it must return one number for each pair") from None
    if found.shape != (len(memory),):
        raise ValueError(
            f"{name}: returned the shape {found.shape}; the memory has {len(memory)} pairs, so it must be "
            f"({len(memory)},)"
        )
    wrong = np.flatnonzero(~np.isfinite(found))
    if len(wrong):
        raise ValueError(
            f"{name}: is {found[wrong[0]]} for pair {wrong[0]} and {len(wrong)} of {len(found)} in all; every reward "
            "must be a finite number: give 0 where there is nothing to say"
        )
    return found


def name_of(reward: Any) -> str:
    """Return how a reward is called in messages: a function's name, an object's repr."""
    return str(getattr(reward, "__name__", None) or repr(reward))


def tabulate(reward: Reward, most: int) -> Floats:
    """Return what a reward function says of a robot that gained and lost so many targets, for learners on the way.

    Parameters
    ----------
    reward : callable
        It may read the facts `gained` and `lost` only.
    most : int
        The largest number of either.

    Returns
    -------
    ndarray, shape (most + 1, most + 1), float64
        By the number gained, then lost.

    Raises
    ------
    ValueError
        If it reads other facts, naming it.
    """
    gained, lost = (np.ravel(part) for part in np.mgrid[: most + 1, : most + 1])
    nowhere = np.ones((len(gained), 1))
    memory = LazyMemory.of(
        nowhere, np.zeros((len(gained), 2)), nowhere, {"gained": gained, "lost": lost}, own=1, settings={}
    )
    try:
        found = rewards_of(memory, reward)
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"reward {name_of(reward)}: a robot that learns on the way knows only what it itself gained and lost, at "
            f"most {most} each ({error})"
        ) from error
    table = np.empty((most + 1, most + 1))
    table[memory.fact("gained").astype(int), memory.fact("lost").astype(int)] = found
    return table
