"""Reward functions of lazy memories; the memory itself holds no rewards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core.component import Allowed, Component
from teamsight.policies.interface import Floats
from teamsight.policies.memory import LazyMemory

#: Takes a memory and returns the immediate reward of each transition, shape (transitions,).
Reward: TypeAlias = Callable[[LazyMemory], npt.ArrayLike]

#: By scope the facts that count targets gained and lost.
SCOPES = {"own": ("gained", "lost"), "team": ("team_gained", "team_lost"), "alone": ("alone_gained", "alone_lost")}
#: The reward for gaining and losing targets at once.
BOTH = {"gain": 1.0, "loss": -1.0, "none": 0.0}


@dataclass(frozen=True)
class GainReward(Component):
    """+1 if one or more targets were acquired, −1 if one or more were lost, 0 otherwise.

    Parameters
    ----------
    scope : {"own", "team", "alone"}
        Which targets count: those that the robot senses, that at least one robot of the team senses, or that the robot
        senses and no teammate does.
    both : {"gain", "loss", "none", "net"}
        The reward if targets were acquired and lost at once: +1, −1, 0, or the sign of their difference.

    Raises
    ------
    ValueError
        If an option is unknown.

    Notes
    -----
    *Source:* §8.2, "+1 if one (or more) targets have been acquired compared to the previous situation, −1 if one (or
    more) targets have been lost, or 0 otherwise"; in this order, a gain takes precedence. *Departs:* the paper does not
    say whether the robot or its team acquires.
    """

    scope: Annotated[str, Allowed(choices=SCOPES)] = "own"
    both: Annotated[str, Allowed(choices=(*BOTH, "net"))] = "gain"

    def __call__(self, memory: LazyMemory) -> Floats:
        """Return the reward of each transition, shape (transitions,)."""
        gained, lost = (np.asarray(memory.fact(name), float) for name in SCOPES[self.scope])
        if self.both == "net":
            return np.asarray(np.sign(gained - lost), float)
        reward = (gained > 0).astype(float) - (lost > 0)
        reward[(gained > 0) & (lost > 0)] = BOTH[self.both]
        return reward


def keep_reward(memory: LazyMemory) -> Floats:
    """Return −1 for each target that the robot alone sensed of its team, and that it no longer senses alone.

    The paper has no such reward; docs/learning-results.md shows its effect.
    """
    return -np.asarray(memory.fact("alone_lost"), float)


def interaction_reward(memory: LazyMemory) -> Floats:
    """Return the rewards that interactions gave the robots in each transition, as recorded.

    Raises
    ------
    ValueError
        If none were recorded, since nothing interacted in the worlds that were explored.
    """
    if "reward" not in memory.facts:
        raise ValueError(
            "reward interaction: nothing interacted in the worlds that were explored, so it was not recorded; give "
            "another reward, such as keep"
        )
    return np.asarray(memory.fact("reward"), float)


own_reward = GainReward("own")
team_reward = GainReward("team")
alone_reward = GainReward("alone")


def rewards_of(memory: LazyMemory, reward: Reward) -> Floats:
    """Return the rewards of all transitions, checked.

    Parameters
    ----------
    memory : LazyMemory
        The transitions.
    reward : callable
        ``reward(memory)`` returns one finite number per transition.

    Returns
    -------
    ndarray, shape (transitions,), float64

    Raises
    ------
    TypeError, ValueError
        If it returns anything else; the message names the function, the transition and the value.
    """
    if not callable(reward):
        raise TypeError(f"reward={reward!r}: must be a callable reward(memory) -> array of shape (transitions,)")
    name = f"reward {name_of(reward)}"
    if isinstance(reward, type):
        raise TypeError(f"{name}: is a class; give an object, {reward.__name__}()")
    answer: Any = reward(memory)
    if answer is None:
        raise TypeError(f"{name}: returned None; return one number for each transition")
    try:
        if np.iscomplexobj(answer):
            # The conversion would drop the imaginary part.
            raise TypeError
        found = np.array(answer, dtype=float)
    except (TypeError, ValueError):
        kind = type(answer).__name__
        raise TypeError(f"{name}: returned {kind}; it must return one number for each transition") from None
    size = len(memory)
    if found.shape != (size,):
        raise ValueError(f"{name}: returned the shape {found.shape}; for {size} transitions it must be ({size},)")
    wrong = np.flatnonzero(~np.isfinite(found))
    if len(wrong):
        raise ValueError(
            f"{name}: is {found[wrong[0]]} for transition {wrong[0]}, and not finite for {len(wrong)} of {size}; "
            "return 0 for no reward"
        )
    return found


def name_of(reward: Any) -> str:
    """Return the name of a reward in messages: of a function its name, of an object its repr."""
    return str(getattr(reward, "__name__", None) or repr(reward))


def tabulate(reward: Reward, most: int) -> Floats:
    """Return the rewards by the numbers of targets gained and lost, for learners that learn while they act.

    Parameters
    ----------
    reward : callable
        It may read the facts `gained` and `lost` only.
    most : int
        Largest number of either.

    Returns
    -------
    ndarray, shape (most + 1, most + 1), float64
        By the number gained, then lost.

    Raises
    ------
    ValueError
        If it reads other facts.
    """
    gained, lost = (np.ravel(part) for part in np.mgrid[: most + 1, : most + 1])
    empty = np.ones((len(gained), 1))
    memory = LazyMemory.of(
        empty, np.zeros((len(gained), 2)), empty, {"gained": gained, "lost": lost}, own=1, settings={}
    )
    try:
        found = rewards_of(memory, reward)
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"reward {name_of(reward)}: for a robot that learns while it acts, it must depend only on the facts gained "
            f"and lost, at most {most} each ({error})"
        ) from error
    table = np.empty((most + 1, most + 1))
    table[memory.fact("gained").astype(int), memory.fact("lost").astype(int)] = found
    return table
