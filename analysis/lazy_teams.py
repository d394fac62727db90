"""The learned teams of Fig. 11: one short exploration, and the two learners that read their behaviour from it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from teamsight.agents.cmommt import DEFAULTS
from teamsight.analysis.explore import Exploration, explore
from teamsight.policies.lazy_memory import LazyMemory
from teamsight.policies.lazy_q import LazyQ, shipped

COOPERATIVE, COLLECTIVE = "lazy-cooperative", "lazy-collective"
# What of a setting changes what robots meet while they explore.
_WORLD = ("sensing_range", "awareness_range", "robot_speed", "target_speed", "uniform_target_speed", "target_policy")


def memory_for(setting: Mapping[str, Any]) -> LazyMemory:
    """Return the 600 pairs that robots explore in a world of this setting.

    It is the exploration that ships with the package where the setting leaves the world as it is; otherwise the same
    exploration, of the same seed, at the setting's own speeds and ranges. It is a part of the behaviour like the
    constants of A-CMOMMT, so that it does not depend on the root seed of a study.

    Parameters
    ----------
    setting : mapping
        Keyword parameters of CMOMMT.

    Notes
    -----
    *Source:* §8.2: the exploration phase is unique.
    """
    return _explored(
        tuple((name, setting[name]) for name in _WORLD if setting.get(name, DEFAULTS[name]) != DEFAULTS[name])
    )


@cache
def _explored(world: tuple[tuple[str, Any], ...]) -> LazyMemory:
    if not world:
        return shipped()
    return explore(Exploration(seed=shipped().settings["seed"], world=dict(world)))


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
