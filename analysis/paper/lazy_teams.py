"""The learned teams of Fig. 11: one short exploration, and the two learners that read their behaviour from it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.policies.lazy.lazy_q import LazyQ, shipped
from teamsight.policies.memory import LazyMemory

COOPERATIVE, COLLECTIVE = "lazy-cooperative", "lazy-collective"
#: What of a setting changes what robots meet while they explore.
WORLD = ("sensing_range", "awareness_range", "robot_speed", "target_speed", "uniform_target_speed", "target_policy")

#: Seeds of the explorations that were chosen for other worlds than that of the defaults: a seed that is lucky at one
#: speed is like any other at another. docs/lazy-search.md tells how it was chosen.
SEEDS: Mapping[tuple[tuple[str, Any], ...], int] = MappingProxyType({(("robot_speed", 0.2), ("target_speed", 0.1)): 30})


def memory_for(setting: Mapping[str, Any]) -> LazyMemory:
    """Return the 600 pairs that robots explore in a world of this setting.

    It is the exploration that ships with the package where the setting leaves the world as it is; otherwise one of the
    same size at the setting's own speeds and ranges, of the seed that was chosen for them, or of the shipped one's seed
    where none was. It is a part of the behaviour like the constants of A-CMOMMT, so that it does not depend on the root
    seed of a study.

    Parameters
    ----------
    setting : mapping
        Keyword parameters of CMOMMT.

    Notes
    -----
    *Source:* §8.2: the exploration phase is unique.
    """
    return _explored(tuple(world_of(setting).items()))


def world_of(setting: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a setting changes of the world that is explored, in a fixed order."""
    return {name: setting[name] for name in WORLD if setting.get(name, DEFAULTS[name]) != DEFAULTS[name]}


@cache
def _explored(world: tuple[tuple[str, Any], ...]) -> LazyMemory:
    if not world:
        return shipped()
    seed = SEEDS.get(world, shipped().settings["seed"])
    return explore(Exploration(seed=seed, world=dict(world)))


def treatments(setting: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the treatments of the two surfaces of Fig. 11, learned in a world of this setting."""
    return dict(_treatments(memory_for(setting)))


@cache
def _treatments(memory: LazyMemory) -> dict[str, dict[str, Any]]:
    return treatments_on(memory)


def treatments_on(memory: LazyMemory, **constants: Any) -> dict[str, dict[str, Any]]:
    """Return the treatments of the two surfaces of Fig. 11: both read one memory, each what its awareness shows.

    Parameters
    ----------
    memory : LazyMemory
        What was explored, under ring awareness.
    **constants
        Of `LazyQ`.
    """
    return {
        COOPERATIVE: {"policy": LazyQ(memory, **constants), "awareness": "ring"},
        COLLECTIVE: {"policy": LazyQ(memory, inputs=memory.own, **constants), "awareness": "none"},
    }
