"""Provenance: the explorations that the transitions of a memory come from, and which memories can be merged."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from teamsight.agents.recording.transitions import FACTS
from teamsight.agents.resolve import awareness_of
from teamsight.analysis.learning.explore import Exploration
from teamsight.policies.memory import LazyMemory

#: Speeds and ranges of bodies, as they are named in settings and in `CMOMMT`.
BODIES = ("robot_speed", "target_speed", "sensing_range", "awareness_range")


def explorations_of(memory: LazyMemory) -> list[dict[str, Any]]:
    """Return the settings of each exploration whose transitions a memory holds."""
    found = memory.settings.get("merged")
    # A user's settings may have any form; those of another form count as one exploration.
    if isinstance(found, list) and found and all(isinstance(one, dict) for one in found):
        return found
    return [dict(memory.settings)]


def distinct(memories: Iterable[LazyMemory]) -> list[LazyMemory]:
    """Return the memories without those whose explorations are all contained in earlier memories.

    Raises
    ------
    ValueError
        If only some are: the transitions of one exploration cannot be taken out of a memory.
    """
    kept: list[LazyMemory] = []
    have: list[dict[str, Any]] = []
    for memory in memories:
        stored = explorations_of(memory)
        new = [one for one in stored if one not in have]
        if new and len(new) < len(stored):
            raise ValueError(
                f"{memory!r}: holds {len(stored)} explorations, of which {len(stored) - len(new)} are also in another "
                "memory; merge the files that it was made from"
            )
        if new:
            kept.append(memory)
            have += new
    return kept


def unlike(memory: LazyMemory, plan: Exploration) -> str:
    """Return the differences between the settings of a memory and of an exploration, for an error."""
    wanted, held = plan.settings(), memory.settings
    if "merged" in held:
        return f"{len(held['merged'])} explorations, not this one alone"
    found = [f"{name}={held.get(name)} (here {value})" for name, value in wanted.items() if held.get(name) != value]
    return f"{len(memory)} transitions of " + (", ".join(found) or "more settings")


def check_alike(plan: Exploration, memories: Iterable[LazyMemory]) -> None:
    """Raise an error if one of the memories cannot be merged with the memory of an exploration.

    Raises
    ------
    ValueError
        If one has a different degree of awareness, or other facts.
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
    """Return the speeds and ranges that differ between the explorations of a memory, with their values."""
    found: dict[str, list[Any]] = {}
    for name in BODIES:
        values: list[Any] = []
        for settings in explorations_of(memory):
            if settings.get(name) not in values:
                values.append(settings.get(name))
        if len(values) > 1:
            found[name] = values
    return found
