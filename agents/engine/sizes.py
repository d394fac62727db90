"""Sizes: how the records of a world follow agents who come and leave, without binding anything again.

All arrays have room for more agents and stay where they are. What changes are words of records: lengths, and indices of
first agents. Each of them is the sum of the sizes of some groups, so one kernel writes them all.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from teamsight.core.kernel import Entry, Packed, Record, array_at
from teamsight.world.noise import LANES
from teamsight.world.proximity.search import FAR_AWAY

if TYPE_CHECKING:
    from teamsight.agents.engine.relation import Relation
    from teamsight.agents.group import Group

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class GroupOfSize(NamedTuple):
    """The record of a group: its columns with all room, and what depends on who is in it.

    Attributes
    ----------
    identity, member, last_rewards, aim, distance : ndarray, shape (room, …)
        As in `BODIES`.
    lanes : ndarray, shape (lanes,), int64
        `Group.whole_lanes`.
    block : ndarray, shape (1,), int64
        As in `GroupArrays`.
    forgets : bool
        Whether it decides at every step, so that nothing is left of the last action.
    """

    identity: Annotated[Integers, "room"]
    member: Annotated[Integers, "room"]
    last_rewards: Annotated[Floats, "room", 2]
    aim: Annotated[Floats, "room", 2]
    distance: Annotated[Floats, "room"]
    lanes: Annotated[Integers, "lanes"]
    block: Annotated[Integers, 1]
    forgets: bool


class RelationOfSize(NamedTuple):
    """The record of a relation: who is observed, with all room; see `RelationArrays`.

    Attributes
    ----------
    groups : ndarray, shape (k,), int64
        The indices of the observed groups.
    everyone, rows, x, y : ndarray, shape (observed, or lanes)
        As in `RelationArrays` and `Observed`.
    """

    groups: Annotated[Integers, "groups"]
    everyone: Annotated[Integers, "observed"]
    rows: Annotated[Integers, "observed"]
    x: Annotated[Floats, "lanes"]
    y: Annotated[Floats, "lanes"]


class SizesArrays(NamedTuple):
    """The record of the sizes of a world.

    Attributes
    ----------
    sizes : ndarray, shape (groups,), int64
        The present number of agents of each group.
    changed : ndarray, shape (1,), int64
        The index of the group whose agents have come or left.
    words : ndarray, shape (words, 2), int64
        The address of each word, and the number to a multiple of which it is rounded up.
    terms : ndarray, shape (words, groups), bool
        The groups whose sizes it adds up.
    groups, relations : list of Packed
        What else follows.
    """

    sizes: Annotated[Integers, "groups"]
    changed: Annotated[Integers, 1]
    words: Annotated[Integers, "words", 2]
    terms: Annotated[npt.NDArray[np.bool_], "words", "groups"]
    groups: list[Packed[GroupOfSize]]
    relations: list[Packed[RelationOfSize]]


_GROUP, _RELATION, _SIZES = Record(GroupOfSize), Record(RelationOfSize), Record(SizesArrays)
_group_at, _relation_at, _sizes_at = _GROUP.at, _RELATION.at, _SIZES.at


def _follow(address: int) -> int:
    here = _sizes_at(address)
    for w in range(here.words.shape[0]):
        total = 0
        for g in range(here.sizes.shape[0]):
            if here.terms[w, g]:
                total += here.sizes[g]
        unit = here.words[w, 1]
        array_at(here.words[w, 0], 1, np.int64)[0] = (total + unit - 1) // unit * unit
    changed = _group_at(here.groups[here.changed[0]])
    size = here.sizes[here.changed[0]]
    changed.block[0] = -1
    for i in range(changed.lanes.shape[0]):
        changed.lanes[i] = changed.member[i] if i < size else 0
    for i in range(size):
        changed.last_rewards[i, 0] = 0.0
        changed.last_rewards[i, 1] = 0.0
        if changed.forgets:
            changed.aim[i, 0] = 0.0
            changed.aim[i, 1] = 0.0
            changed.distance[i] = 0.0
    for r in range(here.relations.shape[0]):
        relation = _relation_at(here.relations[r])
        at = 0
        for place in range(relation.groups.shape[0]):
            number = relation.groups[place]
            first = 0
            for g in range(number):
                first += here.sizes[g]
            group = _group_at(here.groups[number])
            for i in range(here.sizes[number]):
                relation.everyone[at] = group.identity[i]
                relation.rows[at] = first + i
                at += 1
        for j in range(at, relation.x.shape[0]):
            relation.x[j] = FAR_AWAY
            relation.y[j] = FAR_AWAY
    return 0


FOLLOW = Entry(_follow)


class Sizes:
    """The words of the records of a world that follow the sizes of its groups.

    Parameters
    ----------
    groups : list of Group
        The groups of the world.
    blocks : list of ndarray
        The block of the random numbers of each; see `GroupArrays`.
    """

    def __init__(self, groups: Sequence[Group], blocks: Sequence[Integers]) -> None:
        self._groups = groups
        self._index = {group.number: index for index, group in enumerate(groups)}
        self._words: list[tuple[int, int]] = []
        self._terms: list[list[int]] = []
        self._of_groups = [
            _GROUP.pack(GroupOfSize(
                whole("identity"), whole("member"), whole("last_rewards"), whole("aim"), whole("distance"),
                group.whole_lanes, block, group.timetable is None,
            ))
            for group, block in zip(groups, blocks, strict=True) for whole in [group.bodies.whole]
        ]  # fmt: skip
        self._of_relations: list[Packed[RelationOfSize]] = []
        self._packed: Packed[SizesArrays] | None = None

    def add(self, address: int, groups: Iterable[Group], unit: int = 1) -> None:
        """Let a word be the sum of the sizes of some groups, rounded up to a multiple of `unit`."""
        self._words.append((address, unit))
        self._terms.append([self._index[group.number] for group in groups])

    def add_rows(self, packed: Packed[Any], group: Group, *, is_decision: bool = False) -> None:
        """Let a record have a row for each agent of a group; that of a decision has its random numbers too."""
        self.add(packed.word("n"), [group])
        if is_decision:
            self.add(packed.word("lanes"), [group], LANES)

    def add_relation(self, relation: Relation, rows: Integers) -> None:
        """Let the lists of who is observed follow; `rows` are those of `RelationArrays`, with all room."""
        groups = np.array([self._index[group.number] for group in relation.observed], np.int64)
        x, y = relation.search.lanes
        self._of_relations.append(_RELATION.pack(RelationOfSize(groups, relation.identities, rows, x, y)))

    def follow(self, group: Group) -> None:
        """Write all words anew, after agents have come to a group or left it."""
        sizes = [len(group) for group in self._groups]
        if self._packed is None:
            terms = np.zeros((len(self._terms), len(sizes)), np.bool_)
            for row, groups in zip(terms, self._terms, strict=True):
                row[groups] = True
            self._sizes, self._changed = np.array(sizes, np.int64), np.zeros(1, np.int64)
            words = np.array(self._words, np.int64).reshape(-1, 2)
            self._packed = _SIZES.pack(
                SizesArrays(self._sizes, self._changed, words, terms, self._of_groups, self._of_relations)
            )
        self._sizes[:], self._changed[0] = sizes, self._index[group.number]
        FOLLOW(self._packed)
