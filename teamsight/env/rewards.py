"""The facts of a step, and rewards: by name, as a weighted sum of names, or by a function of the facts."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from teamsight.core import checks

Floats = npt.NDArray[np.float64]


class Facts:
    """What has happened in a step, robot by robot, in one or more worlds.

    All are float64 arrays that cannot be written to; those of robots have the shape (worlds, robots), those of worlds
    (worlds, 1), so that both can be combined. They hold until the next step.

    Attributes
    ----------
    sensed : ndarray, shape (worlds, robots)
        The number of targets that each robot senses.
    gained, lost : ndarray, shape (worlds, robots)
        Of these, those that it did not sense before the step; and those that it senses no longer. Both are 0 after a
        step in which bodies came or left.
    alone, alone_gained, alone_lost : ndarray, shape (worlds, robots)
        The same for targets that the robot senses and no teammate does.
    team_sensed, team_gained, team_lost : ndarray, shape (worlds, robots)
        The same for targets that at least one robot of the team senses; equal for all robots.
    share : ndarray, shape (worlds, robots)
        Each robot's share of the targets that the team senses: a target sensed by k robots counts 1/k for each.
    neighbours : ndarray, shape (worlds, robots)
        The number of teammates within its awareness range.
    travelled : ndarray, shape (worlds, robots)
        The length of its way in this step, as a share of its speed, in [0, 1].
    active : ndarray, shape (worlds, robots)
        1, or 0 for a robot that is inactive: one that has failed or has no energy.
    reward : ndarray, shape (worlds, robots)
        What interactions gave each robot in the step; 0 in worlds without an interaction.
    ended : ndarray, shape (worlds, robots)
        1 if an interaction ended a trial for the robot, else 0.
    observed : ndarray, shape (worlds, 1)
        The number of targets that are observed.
    targets : ndarray, shape (worlds, 1)
        The number of active targets.
    neighbours_in_all, max_neighbours : ndarray, shape (worlds, 1)
        The sum of the numbers of neighbours of all teams, and the largest of them.
    robots : ndarray, shape (worlds, 1)
        The number of active robots of all teams.
    teammates : ndarray, shape (worlds, 1)
        The number of teammates of a robot, in range or not, at the start of the episode.
    mean_neighbours : ndarray, shape (worlds, 1)
        The mean number of neighbours of active robots; 0 without robots.
    observed_fraction : ndarray, shape (worlds, 1)
        The share of targets that are observed; 0 without targets.
    """

    sensed: Floats
    gained: Floats
    lost: Floats
    alone: Floats
    alone_gained: Floats
    alone_lost: Floats
    team_sensed: Floats
    team_gained: Floats
    team_lost: Floats
    share: Floats
    neighbours: Floats
    travelled: Floats
    active: Floats
    reward: Floats
    ended: Floats
    observed: Floats
    targets: Floats
    neighbours_in_all: Floats
    max_neighbours: Floats
    robots: Floats
    teammates: Floats

    def __init__(self, robots: Floats, worlds: Floats, teammates: Floats) -> None:
        """Show arrays of shape (`OF_ROBOTS`, worlds, robots), (worlds, `OF_WORLDS`) and (worlds, 1)."""
        ofs = ((OF_ROBOTS, robots), (OF_WORLDS, worlds.T[..., np.newaxis]), (("teammates",), teammates[np.newaxis]))
        for names, array in ofs:
            shown = array.view()
            shown.flags.writeable = False
            for name, fact in zip(names, shown, strict=True):
                setattr(self, name, fact)

    @property
    def observed_fraction(self) -> Floats:
        return self.observed / np.maximum(self.targets, 1.0)

    @property
    def mean_neighbours(self) -> Floats:
        return self.neighbours_in_all / np.maximum(self.robots, 1.0)

    def fact(self, name: str) -> Floats:
        """Return a fact by its name, as `LazyMemory.fact` does, so that the rewards of learners read facts too.

        Raises
        ------
        ValueError
            If there is no such fact.
        """
        found: Floats = getattr(self, checks.choice("name", name, (*OF_ROBOTS, *OF_WORLDS)))
        return found


_NAMES = tuple(Facts.__annotations__)
#: What is known of each robot, in the order of the columns that the kernel writes, and of each world.
OF_ROBOTS, OF_WORLDS = _NAMES[:15], _NAMES[15:20]

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
        if not value:
            raise ValueError("reward={}: must have a term; give names with weights, as in {'observed': 1.0}")
        return _Weighted(tuple(
            (checks.choice("reward", name, REWARDS), checks.number(f"reward[{name!r}]", weight))
            for name, weight in value.items()
        ))  # fmt: skip
    if isinstance(value, type):
        raise TypeError(f"reward={checks.shown(value)}: is a class; give an object, {value.__name__}()")
    if not callable(value):
        raise TypeError(
            f"reward={checks.shown(value)}: must be a name ({', '.join(REWARDS)}), a mapping of names to weights, or a "
            "function of the facts of a step"
        )
    return value


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
        raise TypeError(f"{_name(reward)}: returned {kind}; it must return one number for each robot") from None
    if given.shape not in (shape, (shape[0], 1)) or answer is None:
        what = "None" if answer is None else f"the shape {given.shape}"
        raise ValueError(
            f"{_name(reward)}: returned {what}; it must be {shape}, as facts.sensed is: (worlds, robots)"
        )
    found = np.empty(shape)
    found[:] = given
    # If the sum is finite, all are; else look at each.
    if not math.isfinite(np.add.reduce(found, axis=None)) and not np.isfinite(found).all():
        world, robot = np.argwhere(~np.isfinite(found))[0].tolist()
        raise ValueError(
            f"{_name(reward)}: is {found[world, robot]} for robot {robot} of world {world}; return a finite number, 0 "
            "for none"
        )
    return found


def _name(reward: Reward) -> str:
    return f"reward {getattr(reward, '__name__', None) or checks.shown(reward)}"
