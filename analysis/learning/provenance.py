"""Provenance: which explorations the pairs of memories come from, and whether memories can be put together."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from teamsight.agents.recording.transition_kernels import FACTS
from teamsight.agents.resolve import awareness_of
from teamsight.analysis.learning.explore import Exploration
from teamsight.policies.memory import LazyMemory

#: What a robot's body can do, by the name that settings and `CMOMMT` have for it.
BODIES = ("robot_speed", "target_speed", "sensing_range", "awareness_range")


def explorations_of(memory: LazyMemory) -> list[dict[str, Any]]:
    """Return the settings of each exploration whose pairs a memory holds."""
    found = memory.settings.get("merged")
    # Settings are whatever a user gave; those of another form tell of one exploration.
    if isinstance(found, list) and found and all(isinstance(one, dict) for one in found):
        return found
    return [dict(memory.settings)]


def distinct(memories: Iterable[LazyMemory]) -> list[LazyMemory]:
    """Return the memories without those whose explorations are all in memories before them.

    Raises
    ------
    ValueError
        If some are and others are not: their pairs cannot be told apart any more.
    """
    kept: list[LazyMemory] = []
    have: list[dict[str, Any]] = []
    for memory in memories:
        told = explorations_of(memory)
        new = [one for one in told if one not in have]
        if new and len(new) < len(told):
            raise ValueError(
                f"{memory!r}: holds {len(told)} explorations, of which {len(told) - len(new)} are in another memory "
                "too; merge the files that it was made of"
            )
        if new:
            kept.append(memory)
            have += new
    return kept


def unlike(memory: LazyMemory, plan: Exploration) -> str:
    """Return in which settings the exploration of a memory differs from one, for an error."""
    told, held = plan.settings(), memory.settings
    if "merged" in held:
        return f"{len(held['merged'])} explorations, not this one alone"
    found = [f"{name}={held.get(name)} (here {value})" for name, value in told.items() if held.get(name) != value]
    return f"{len(memory)} pairs of " + (", ".join(found) or "more settings")


def check_alike(plan: Exploration, memories: Iterable[LazyMemory]) -> None:
    """Refuse memories that what an exploration will give cannot be merged with; better now than after it.

    Raises
    ------
    ValueError
        If one is of another degree of awareness, or holds other facts.
    """
    awareness = awareness_of(plan.awareness)
    width = awareness.width(plan.robots)
    for memory in memories:
        held = memory.settings.get("awareness")
        if (held, memory.own, memory.added) != (repr(awareness), width.own, width.added):
            raise ValueError(
                f"merge: a memory of {held} with {memory.own} + {memory.added} inputs, and an exploration of "
                f"{awareness!r} with {width.own} + {width.added}; explore both under the same degree of awareness"
                f"{' and with teams of one size' if held == repr(awareness) else ''}"
            )
        if memory.facts != tuple(sorted(FACTS)):
            raise ValueError(
                f"merge: a memory of the facts {memory.facts}, and an exploration of {tuple(sorted(FACTS))}; explore "
                "both with the same facts recorded"
            )


def differing(memory: LazyMemory) -> dict[str, list[Any]]:
    """Return what bodies could do that was not the same in all explorations of a memory, and what it was."""
    found: dict[str, list[Any]] = {}
    for name in BODIES:
        values: list[Any] = []
        for settings in explorations_of(memory):
            if settings.get(name) not in values:
                values.append(settings.get(name))
        if len(values) > 1:
            found[name] = values
    return found
