"""Contacts in the compiled loop: the motion of bodies that have a radius, and the number of bumps of each step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.agents.engine.loop import guarded
from teamsight.agents.engine.records import DONE, PROGRESS, Phase
from teamsight.core.contracts import is_own
from teamsight.core.kernel import Entry, Packed, Record
from teamsight.world.contact import ContactArrays, SolidBodies, contact_at, contact_entry
from teamsight.world.motion import is_watched

if TYPE_CHECKING:
    from teamsight.agents.group import Group
    from teamsight.agents.world_data import WorldData

Floats = npt.NDArray[np.float64]


class BumpArrays(NamedTuple):
    """The record of the number of bumps; `scores` and `progress` are as in `InteractionsArrays`."""

    progress: Annotated[npt.NDArray[Any], PROGRESS, 1]
    scores: Annotated[Floats, "score rows", "scores"]
    contacts: Packed[ContactArrays]


COUNT = Record(BumpArrays)
count_at = COUNT.at


def _record_bumps(address: int) -> int:
    here = count_at(address)
    bumped = contact_at(here.contacts).bumped[0]
    # The last column.
    here.scores[here.progress[0].row, here.scores.shape[1] - 1] = bumped
    return DONE


RECORD_BUMPS = Entry(_record_bumps)


class BoundContacts:
    """The records of the bodies of a world that meet.

    Parameters
    ----------
    data : WorldData
        The world.
    progress : ndarray of `PROGRESS`, shape (1,)
        The state of the loop.
    scores : ndarray, shape (steps, scores), float64
        As in `InteractionsArrays`.

    Attributes
    ----------
    record : Packed of BumpArrays
        The argument of `RECORD_BUMPS`.
    """

    def __init__(self, data: WorldData, progress: npt.NDArray[Any], scores: Floats) -> None:
        self._groups = data.solid
        self._entry = contact_entry(data.contact, data.arena)
        self._has_own = is_own(data.contact) or is_watched(data.arena)
        self._bodies = SolidBodies(
            data.contact, data.arena, [group.bodies for group in self._groups],
            [group.has_conditions for group in self._groups], data.arena_size,
        )  # fmt: skip
        # Where groups move in turn, each meets the others where they are.
        self._in_turn = any(one.interaction.in_turn for one in data.interactions)
        self.record = COUNT.pack(BumpArrays(progress, scores, self._bodies.record(0 if self._in_turn else -1)))

    def phases(self, group: Group | None) -> list[Phase]:
        """Return the phases that follow what a group intends; for None, what follows the intentions of all."""
        if self._in_turn is (group is None) or (group is not None and group not in self._groups):
            return []
        mover = -1 if group is None else self._groups.index(group)
        entry, record = guarded(self._entry, self._bodies.record(mover), self._has_own)
        return [Phase("contact", entry, record, self._bodies)]
