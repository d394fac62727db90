"""The learned teams of Fig. 11: one exploration, and the two learners that use its transitions.

Explorations and learners are made, and their modules imported, when a treatment is first asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teamsight.policies.memory import LazyMemory

#: Names of the two experiments.
COOPERATIVE, COLLECTIVE = "lazy-cooperative", "lazy-collective"
#: Parameters of a setting that change the world that is explored.
WORLD = ("sensing_range", "awareness_range", "robot_speed", "target_speed", "uniform_target_speed", "target_policy")


def memory_for(setting: Mapping[str, Any]) -> LazyMemory:
    """Return the 600 transitions explored in the world of a setting, which holds keyword parameters of CMOMMT.

    In the default world this is the exploration that ships with the package. In any other world, an exploration of
    the same size and seed is made there. Like the constants of A-CMOMMT, the exploration is part of the policy: it does
    not depend on the root seed.

    Notes
    -----
    *Source:* §8.2: the exploration phase is unique.
    """
    return _explored(tuple(world_of(setting).items()))


def world_of(setting: Mapping[str, Any]) -> dict[str, Any]:
    """Return those parameters of a setting that make the explored world differ from the default, in a fixed order."""
    from teamsight.agents.cmommt import DEFAULTS

    return {name: setting[name] for name in WORLD if setting.get(name, DEFAULTS[name]) != DEFAULTS[name]}


@cache
def _explored(world: tuple[tuple[str, Any], ...]) -> LazyMemory:
    from teamsight.analysis.learning.explore import Exploration, explore
    from teamsight.policies.lazy.lazy_q import shipped

    if not world:
        return shipped()
    return explore(Exploration(world=dict(world)))


def treatments(setting: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the treatments of the two surfaces of Fig. 11, learned in the world of a setting."""
    return _learned_from(memory_for(setting))


def treatments_on(memory: LazyMemory, **constants: Any) -> dict[str, dict[str, Any]]:
    """Return the treatments of the two surfaces of Fig. 11, learned from one memory.

    Parameters
    ----------
    memory : LazyMemory
        Transitions explored under ring awareness.
    **constants
        Parameters of `LazyQ`.
    """
    from teamsight.policies.lazy.lazy_q import LazyQ

    return {
        COOPERATIVE: {"policy": LazyQ(memory, **constants), "awareness": "ring"},
        COLLECTIVE: {"policy": LazyQ(memory, inputs=memory.own, **constants), "awareness": "none"},
    }


# A figure and its claims learn once.
_learned_from = cache(treatments_on)
