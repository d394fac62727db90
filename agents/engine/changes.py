"""Changes of conditions since the neighbour lists were made, and how they are written into the lists."""

from __future__ import annotations

from collections.abc import Iterable

from teamsight.agents.engine.binding import Binding
from teamsight.agents.engine.condition_changes import CHANGE
from teamsight.agents.engine.records import DONE
from teamsight.agents.engine.relation import Relation
from teamsight.core.interrupts import deferred

# More changes at a time than this take longer one by one than a search.
_MOST = 12


class Changes:
    """The agents whose condition has changed, by group and row: whether one is active, or whether a sensor works."""

    def __init__(self) -> None:
        self._changed: dict[tuple[int, int], None] = {}

    def __len__(self) -> int:
        return len(self._changed)

    def note(self, group: int, row: int) -> None:
        """Note that an agent has changed."""
        self._changed[group, row] = None

    def clear(self) -> None:
        """Forget the changes, since the lists show them."""
        self._changed.clear()

    def apply(self, binding: Binding, relations: Iterable[Relation]) -> bool:
        """Write the changes into the lists; return whether that was done, or all must be searched again."""
        if len(self) > _MOST or any(relation.detection for relation in relations):
            return False
        with deferred():
            for group, row in self._changed:
                binding.progress["where"], binding.progress["need"] = group, row
                if CHANGE(binding.world) != DONE:
                    return False
        return True
