"""The learned teams of Fig. 11: explorations, and the learners that use their transitions.

Two readings of the paper's lazy learning are compared. Explorations and learners are made, and their modules imported,
when an experiment's runs are listed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache, partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import kolmogorov

from teamsight.analysis.runs.experiment import Variant
from teamsight.analysis.runs.seeds import model_seed, root

if TYPE_CHECKING:
    from teamsight.policies.learner import Learner
    from teamsight.policies.memory import LazyMemory

#: Explorations for each run of a cell: five runs give 25. Each exploration runs every cell once.
EXPLORATIONS = 5
#: Parameters of a setting that change the world that is explored.
WORLD = ("sensing_range", "awareness_range", "robot_speed", "target_speed", "uniform_target_speed", "target_policy")


class Reading(NamedTuple):
    """A way to read the paper's lazy learning.

    Attributes
    ----------
    title : str
        In words.
    learner, reward : str
        Names of the learner and of the reward.
    cooperative, collective : str
        Names of its two experiments: with all 32 inputs under ring awareness, and with the robot's own 16 inputs of the
        same transitions without awareness.
    alone : tuple of (str, value)
        Constants of the collective learner that differ from the defaults.
    """

    title: str
    learner: str
    reward: str
    cooperative: str
    collective: str
    alone: tuple[tuple[str, Any], ...] = ()


#: As the paper describes it: the best action of the nearest situations (eq. 1), rewarded by the robot's own targets.
LITERAL = Reading("lazy Q-learning, the literal reading", "lazy", "own", "literal-cooperative", "literal-collective")
#: Slopes of the reward of the team, by locally weighted regression. The default bandwidth is bad for the collective
#: team, and a gain over a team that is weaker than need be would not be one from awareness.
SLOPES = Reading(
    "slopes by local regression", "regression", "team", "slopes-cooperative", "slopes-collective",
    (("bandwidth", 0.2),),
)  # fmt: skip
#: Both readings.
READINGS = (LITERAL, SLOPES)
#: Experiments whose policy was learned from transitions.
LEARNED = frozenset(name for reading in READINGS for name in (reading.cooperative, reading.collective))


def learned(reading: Reading, *, cooperative: bool) -> Callable[[Mapping[str, Any]], Callable[[int], Variant]]:
    """Return the treatment of an experiment of a reading: by setting, then by number of the exploration."""
    return lambda setting: partial(_variant, reading, cooperative, tuple(world_of(setting).items()))


def world_of(setting: Mapping[str, Any]) -> dict[str, Any]:
    """Return those parameters of a setting that make the explored world differ from the default, in a fixed order."""
    from teamsight.agents.cmommt import DEFAULTS

    return {name: setting[name] for name in WORLD if setting.get(name, DEFAULTS[name]) != DEFAULTS[name]}


@cache
def exploration(number: int, world: tuple[tuple[str, Any], ...] = ()) -> LazyMemory:
    """Return the 600 transitions of an exploration of the paper's size.

    Its seed derives from a root that serves nothing else: none is searched for, and none left out. It does not depend
    on the root seed of the reproduction.

    Parameters
    ----------
    number : int
        Number of the exploration, from 0.
    world : tuple of (str, value)
        Parameters in which its world differs from the default.

    Notes
    -----
    *Source:* §8.2: the exploration phase is unique. *Departs:* here each of several explorations gives a team, because
    one exploration says little about the others.
    """
    from teamsight.analysis.learning.explore import Exploration, explore

    plan = Exploration(world=MappingProxyType(dict(world)))
    scenario = plan.scenario
    seed = model_seed(
        root("figure 11: explore"), number, scenario["robots"], scenario["targets"], scenario["radius"]
    )  # fmt: skip
    return explore(Exploration(seed=seed, world=plan.world))


@cache
def _learner(reading: Reading, cooperative: bool, world: tuple[tuple[str, Any], ...], number: int) -> Learner:
    from teamsight.analysis.learning.registry import LEARNERS, REWARDS

    memory = exploration(number, world)
    inputs, constants = (memory.inputs, ()) if cooperative else (memory.own, reading.alone)
    return LEARNERS[reading.learner](memory, REWARDS[reading.reward], inputs, **dict(constants))


def _variant(reading: Reading, cooperative: bool, world: tuple[tuple[str, Any], ...], number: int) -> Variant:
    policy = _learner(reading, cooperative, world, number)
    treatment = {"policy": policy, "awareness": "ring" if cooperative else "none"}
    return Variant(treatment, described(policy.memory))


def described(memory: LazyMemory) -> dict[str, Any]:
    """Return the columns that describe an exploration in a table of runs.

    Returns
    -------
    dict
        exploration (its seed), transitions, explorers, explored_targets, explored_radius, explored_steps, and the
        p-values of rotations and distances against a uniform distribution (Kolmogorov and Smirnov): rotation_p and
        distance_p.
    """
    settings = memory.settings
    turn = memory.action[:, 0] / (2 * np.pi) % 1.0
    return {
        "exploration": settings["seed"],
        "transitions": len(memory),
        "explorers": settings["robots"],
        "explored_targets": settings["targets"],
        "explored_radius": settings["radius"],
        "explored_steps": settings["steps"],
        "rotation_p": _uniform_p(turn),
        "distance_p": _uniform_p(memory.action[:, 1]),
    }


def _uniform_p(shares: npt.NDArray[np.floating[Any]]) -> float:
    """Return the p-value of numbers against a uniform distribution on [0, 1], after Kolmogorov and Smirnov."""
    found = np.sort(shares.astype(float))
    steps = np.arange(len(found) + 1) / len(found)
    deviation = max(float((steps[1:] - found).max()), float((found - steps[:-1]).max()))
    return float(kolmogorov(np.sqrt(len(found)) * deviation))
