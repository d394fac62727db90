"""Watchers: compiled code that looks at a world after each step, and can stop a run there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from teamsight.agents.engine.binding import Binding
    from teamsight.agents.engine.records import GroupArrays, RelationArrays
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group
    from teamsight.core.kernel import Entry, Packed


class Bound(NamedTuple):
    """What a watcher can read: the groups and neighbour searches of a world as they are bound.

    Attributes
    ----------
    groups, group_records : list of Group, list of Packed of GroupArrays
        The groups and their records, in the same order.
    relations, relation_records : list of Relation, list of Packed of RelationArrays
        The neighbour searches and their records, in the same order.
    first_body : dict of int to int
        For each group's number, the index of its first agent among all bodies, as in ``RelationArrays.met``.
    moment : ndarray, shape (1,), int64
        The tick of the present positions.
    """

    groups: list[Group]
    group_records: list[Packed[GroupArrays]]
    relations: list[Relation]
    relation_records: list[Packed[RelationArrays]]
    first_body: dict[int, int]
    moment: npt.NDArray[np.int64]

    def relation(self, observers: Group, channel: str) -> Packed[RelationArrays] | None:
        """Return the record of what a group senses in a channel; None if it has no such channel."""
        for relation, record in zip(self.relations, self.relation_records, strict=True):
            if relation.observers is observers and relation.name == channel:
                return record
        return None


class Watcher:
    """Compiled code that is called after each step: bodies have moved, neighbours are found, the step is recorded.

    ``engine.watch(watcher)`` begins, ``engine.unwatch(watcher)`` ends. Results must not depend on how a run is divided
    into calls, so what changes lies in arrays that the watcher owns and keeps when it is bound again.

    Attributes
    ----------
    entry : Entry
        The compiled function. It takes the address of `record` and returns 0, or another number if the run is to stop
        after this step, so that `happened` is called.
    record : Packed
        The record that `bind` has packed.
    sees_changes : bool
        Whether it is also called before a step when positions, groups or ranges were changed after the last one: by
        an event, or between steps. It must then do nothing if it sees the same world twice.
    """

    entry: Entry
    record: Packed[Any]
    sees_changes: bool = False

    def bind(self, bound: Bound) -> None:
        """Pack `record` from the present arrays.

        Called before the first step, and whenever groups, agents or room for neighbours have changed. Rows may have
        changed since the last call; `Bodies.member` says which agents they are now. It must change nothing else.
        """
        raise NotImplementedError

    def happened(self) -> None:
        """Plan events at the present tick; called after `entry` has stopped a run.

        The events are processed before the next step. Called by Python, after the step is complete; the neighbour lists
        are those of the present positions.
        """
        raise NotImplementedError

    def tidy(self) -> None:
        """End watching by ``engine.unwatch(self)`` if there is nothing to watch; called before steps are made."""

    def forget(self) -> None:
        """Drop what was planned or waited for; called when a world begins anew or goes back to a state."""

    def close(self) -> None:
        """End what depends on the world; called when it is closed."""


def report(binding: Binding) -> bool:
    """Call `happened` of the watchers that have stopped the loop; return whether there are any."""
    if not binding.progress["stopped"][0]:
        return False
    binding.progress["stopped"] = 0
    for watcher, result in zip(list(binding.watchers), binding.watching.value.watchers[:, 3].tolist(), strict=True):
        if result:
            watcher.happened()
    return True
