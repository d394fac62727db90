"""Rewards of environments: by name, as a weighted sum of names, or by a function of the facts of a step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core import checks
from teamsight.env.facts import Facts

Floats = npt.NDArray[np.float64]

#: Takes the facts of a step and returns one number for each robot, shape (worlds, robots).
Reward: TypeAlias = Callable[[Facts], npt.ArrayLike]
#: What users give as `reward`.
RewardLike: TypeAlias = str | Mapping[str, float] | Reward


def _gain(facts: Facts, scope: str) -> Floats:
    """Return +1 for targets gained, else −1 for targets lost, else 0: `GainReward` of this scope."""
    gained, lost = facts.fact(f"{scope}gained") > 0, facts.fact(f"{scope}lost") > 0
    return np.where(gained, 1.0, -1.0 * lost)


REWARDS: dict[str, Reward] = {
    "observed": lambda facts: facts.observed_fraction,
    "share": lambda facts: facts.share / np.maximum(facts.targets, 1.0),
    "sensed": lambda facts: facts.sensed / np.maximum(facts.targets, 1.0),
    "alone": lambda facts: facts.alone / np.maximum(facts.targets, 1.0),
    "gain": lambda facts: _gain(facts, ""),
    "team-gain": lambda facts: _gain(facts, "team_"),
    "alone-gain": lambda facts: _gain(facts, "alone_"),
    "neighbours": lambda facts: facts.neighbours / np.maximum(facts.teammates, 1.0),
    "travelled": lambda facts: facts.travelled,
    "interaction": lambda facts: facts.reward,
}
"""The rewards by name: functions of the facts of a step. All but those of gains, and what an interaction has given, are
shares, in [0, 1]."""


def reward_of(value: RewardLike) -> Reward:
    """Return the reward that a user gives.

    Parameters
    ----------
    value : str, mapping of str to float, or callable
        See `parallel_env`.

    Raises
    ------
    TypeError, ValueError
        If a name is unknown, a weight is not a finite number, or it is none of these.
    """
    if isinstance(value, str):
        return _Weighted(((checks.choice("reward", value, REWARDS), 1.0),))
    if isinstance(value, Mapping):
        return _weighted(value)
    if isinstance(value, type):
        raise TypeError(f"reward={checks.shown(value)}: is a class; give an object, {value.__name__}()")
    if not callable(value):
        raise TypeError(
            f"reward={checks.shown(value)}: must be a name ({', '.join(REWARDS)}), a mapping of names to weights, or a "
            "function of the facts of a step"
        )
    return value


def _weighted(weights: Mapping[Any, Any]) -> Reward:
    if not weights:
        raise ValueError("reward={}: must have a term; give names with weights, as in {'observed': 1.0}")
    return _Weighted(tuple(
        (checks.choice("reward", name, REWARDS), checks.number(f"reward[{name!r}]", weight))
        for name, weight in weights.items()
    ))  # fmt: skip


@dataclass(frozen=True)
class _Weighted:
    """A weighted sum of rewards by name: an object, since functions made in functions cannot be pickled."""

    terms: tuple[tuple[str, float], ...]

    def __call__(self, facts: Facts) -> Floats:
        return np.asarray(sum(weight * np.asarray(REWARDS[name](facts)) for name, weight in self.terms))


def rewards_of(reward: Reward, facts: Facts) -> Floats:
    """Return the rewards of a step, checked.

    Parameters
    ----------
    reward : callable
        The reward.
    facts : Facts
        The facts of the step.

    Returns
    -------
    ndarray, shape (worlds, robots), float64
        A new array.

    Raises
    ------
    TypeError, ValueError
        If it returns anything but one finite number for each robot.
    """
    answer, shape = reward(facts), facts.sensed.shape
    try:
        array = np.asarray(answer)
        # A part of complex numbers would be lost.
        given = array.astype(float, casting="unsafe" if array.dtype.kind != "c" else "same_kind", copy=False)
    except (TypeError, ValueError):
        kind = type(answer).__name__
        raise TypeError(f"reward {_name(reward)}: returned {kind}; it must return one number for each robot") from None
    if given.shape not in (shape, (shape[0], 1)) or answer is None:
        what = "None" if answer is None else f"the shape {given.shape}"
        raise ValueError(
            f"reward {_name(reward)}: returned {what}; it must be {shape}, as facts.sensed is: (worlds, robots)"
        )
    found = np.empty(shape)
    found[:] = given
    # If the sum is finite, all are; else look at each.
    if not math.isfinite(np.add.reduce(found, axis=None)) and not np.isfinite(found).all():
        world, robot = np.argwhere(~np.isfinite(found))[0].tolist()
        raise ValueError(
            f"reward {_name(reward)}: is {found[world, robot]} for robot {robot} of world {world}; return a finite "
            "number, 0 for none"
        )
    return found


def _name(reward: Any) -> str:
    return str(getattr(reward, "__name__", None) or checks.shown(reward))
