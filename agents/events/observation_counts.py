"""Observation counts: for how many steps each target is observed, and how evenly."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from teamsight.agents.engine.records import Bound, GroupArrays, RelationArrays, group_at, relation_at
from teamsight.agents.events.contact_log import places
from teamsight.agents.events.sources import Watching
from teamsight.core.kernel import Entry, Packed, Record, kernel
from teamsight.world.motion import move_at

if TYPE_CHECKING:
    from teamsight.agents.world import World


def spread(world: World) -> float:
    """Return the standard deviation over the targets of the observed share of each; see `ObservationCounts.spread`.

    Raises
    ------
    ValueError
        If the world does not count observations.
    """
    return _counts(world, "spread").spread


def entropy(world: World) -> float:
    """Return the entropy of the targets' shares of all observation [nat]; see `ObservationCounts.entropy`.

    Raises
    ------
    ValueError
        If the world does not count observations.
    """
    return _counts(world, "entropy").entropy


def redundancy(world: World) -> float:
    """Return the mean number of robots that sense an observed target; see `ObservationCounts.redundancy`.

    Raises
    ------
    ValueError
        If the world does not count observations.
    """
    return _counts(world, "redundancy").redundancy


def _counts(world: World, name: str) -> ObservationCounts:

    for source in world.sources:
        if isinstance(source, ObservationCounts):
            return source
    raise ValueError(
        f"{name}({type(world).__name__}): the world does not count how often each target is observed; call "
        "world.count_observations() before the run"
    )


Integers = npt.NDArray[np.int64]

#: The columns of the counts: steps in which a target was present and active, in which a robot sensed it, and the sum
#: over these of the number of robots that did.
COLUMNS = ("steps", "observed", "sightings")
_STEPS, _OBSERVED, _SIGHTINGS = range(3)


class ObservationArrays(NamedTuple):
    """The record of observation counts.

    Attributes
    ----------
    relations : list of Packed of RelationArrays
        The relations that count in the observed fraction.
    same : ndarray, shape (relations,), int64
        For each, the first of them with the same observers.
    groups : list of Packed of GroupArrays
        The groups that are observed in any of them, each once.
    first : ndarray, shape (groups,), int64
        The index of the first agent of each among all bodies.
    observers : ndarray, shape (1,), int64
        The number of observers that were looked at so far, over all steps.
    last : ndarray, shape (bodies, 2), int64
        For each body, the value of `observers` when it was last counted, and at the beginning of that step.
    counts : ndarray, shape (bodies, 3), int64
        See `COLUMNS`.
    """

    relations: list[Packed[RelationArrays]]
    same: Annotated[Integers, "relations"]
    groups: list[Packed[GroupArrays]]
    first: Annotated[Integers, "groups"]
    observers: Annotated[Integers, 1]
    last: Annotated[Integers, "bodies", 2]
    counts: Annotated[Integers, "bodies", 3]


OBSERVATIONS = Record(ObservationArrays)
observations_at = OBSERVATIONS.at


@kernel
def _count_of(address: int, i: int, before: int, here: Any) -> None:
    """Count what observer `i` of a relation senses, each body once for this observer."""
    relation = relation_at(address)
    number = here.observers[0]
    for k in range(relation.true_start[i], relation.true_start[i + 1]):
        body = relation.rows[relation.true_index[k]]
        if here.last[body, 0] != number:
            here.counts[body, _SIGHTINGS] += 1
            here.counts[body, _OBSERVED] += here.last[body, 1] != before
        here.last[body, 0] = number
        here.last[body, 1] = before


@kernel
def _count_present(address: int, first: int, counts: Any) -> None:
    """Count the active bodies of a group."""
    move = move_at(group_at(address).move)
    has_inactive = move.active.shape[0] > 0
    for j in range(move.position.shape[0]):
        counts[first + j, _STEPS] += not has_inactive or move.active[j]


def _count(address: int) -> int:
    here = observations_at(address)
    # No step begins with the number with which another began, since a step without observers counts nothing.
    before = here.observers[0]
    for a in range(here.same.shape[0]):
        if here.same[a] != a:
            continue
        for i in range(relation_at(here.relations[a]).true_start.shape[0] - 1):
            here.observers[0] += 1
            for b in range(a, here.same.shape[0]):
                if here.same[b] == a:
                    _count_of(here.relations[b], i, before, here)
    for g in range(here.first.shape[0]):
        _count_present(here.groups[g], here.first[g], here.counts)
    return 0


COUNT_OBSERVATIONS = Entry(_count)


class Counted(NamedTuple):
    """The counts of all targets that were ever there, in the order in which they came.

    Attributes
    ----------
    identity, group : ndarray, shape (m,), int64
        The `unique_id` of each, and the number of its group.
    counts : ndarray, shape (m, 3), int64
        See `COLUMNS` of the kernel.
    """

    identity: Integers
    group: Integers
    counts: Integers


_NOBODY = Counted(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, len(COLUMNS)), np.int64))


class ObservationCounts(Watching):
    """Counts for each target the steps in which robots observe it, in compiled code.

    `World.count_observations` attaches it. A reset begins anew. What counts as observed is what counts in
    `World.observed_fraction`; a target counts in the steps in which it is present and active.

    Attributes
    ----------
    table : DataFrame
        One row for each target; see there.
    spread, entropy, redundancy : float
        What follows for the team; each is NaN where it is undefined.
    """

    needs_group = False
    entry = COUNT_OBSERVATIONS

    def begin(self) -> None:
        """Count from now on."""
        self.load(_NOBODY)

    def save(self) -> Counted:
        """Return the counts of all bodies that were ever there."""
        known, new = self._earlier, self._now
        at = places(known.identity, new.identity)
        counts, is_new = known.counts.copy(), at < 0
        counts[at[~is_new]] = new.counts[~is_new]
        return Counted(
            np.concatenate([known.identity, new.identity[is_new]]),
            np.concatenate([known.group, new.group[is_new]]),
            np.concatenate([counts, new.counts[is_new]]),
        )

    def load(self, data: Counted) -> None:
        """Go on from what `save` returned; the next `bind` finds the rows."""
        self._earlier, self._now = data, _NOBODY
        self.world._engine.rewatch()

    @property
    def table(self) -> pd.DataFrame:
        """One row for each target that was there for a step, those that have left included.

        The columns are target (`unique_id`), group, steps (in which it was there), observed (in which at least one
        robot sensed it), sightings (the sum over the steps of the number of robots that sensed it) and share
        (observed / steps).
        """
        identity, group, counts = self._present()
        names = np.array([one.name for one in self.world.groups], object)
        table = pd.DataFrame({"target": identity, "group": names[group]})
        for column, name in enumerate(COLUMNS):
            table[name] = counts[:, column]
        return table.assign(share=counts[:, 1] / counts[:, 0])

    @property
    def spread(self) -> float:
        """The standard deviation over the targets of the observed share of each, in [0, 0.5]; NaN without targets.

        A target's observed share is the fraction of its steps in which at least one robot senses it. 0 if all are
        observed for the same share; the deviation is that of these targets, with the number of targets as divisor.
        """
        steps, observed, _ = self._present().counts.T
        return float(np.std(observed / steps)) if len(steps) else float("nan")

    @property
    def entropy(self) -> float:
        """H = −Σ p log p [nat], where p is a target's share of the steps in which any is observed.

        From 0, if only one target is ever observed, to the logarithm of the number of targets, if all are for the same
        number of steps. NaN if none was observed.
        """
        observed = self._present().counts[:, 1]
        shares = observed[observed > 0] / max(observed.sum(), 1)
        return float(-(shares * np.log(shares)).sum()) + 0.0 if len(shares) else float("nan")

    @property
    def redundancy(self) -> float:
        """The mean number of robots that sense an observed target, over targets and steps, at least 1.

        NaN if none was observed.
        """
        _, observed, sightings = self._present().counts.sum(axis=0)
        return float(sightings / observed) if observed else float("nan")

    def _present(self) -> Counted:
        """Return the counts of the targets that were there for a step."""
        identity, group, counts = self.save()
        there = counts[:, 0] > 0
        return Counted(identity[there], group[there], counts[there])

    def bind(self, bound: Bound) -> None:
        """Find the rows of the bodies that were counted before."""
        self._earlier = known = self.save()
        relations = [r for r, relation in enumerate(bound.relations) if relation.counts]
        sides = [bound.relations[r].observers.number for r in relations]
        seen = {group.number for r in relations for group in bound.relations[r].observed}
        targets = [g for g, group in enumerate(bound.groups) if group.number in seen]
        identity = np.concatenate([np.zeros(0, np.int64), *(group.bodies.identity for group in bound.groups)])
        group = np.repeat([one.number for one in bound.groups], [len(one) for one in bound.groups]).astype(np.int64)
        counts = np.zeros((len(identity), len(COLUMNS)), np.int64)
        at = places(known.identity, identity)
        counts[at >= 0] = known.counts[at[at >= 0]]
        self._now = Counted(identity, group, counts)
        self.record = OBSERVATIONS.pack(ObservationArrays(
            [bound.relation_records[r] for r in relations],
            np.array([sides.index(side) for side in sides], np.int64),
            [bound.group_records[g] for g in targets],
            np.array([bound.first_body[bound.groups[g].number] for g in targets], np.int64),
            np.zeros(1, np.int64), np.full((len(identity), 2), -1), counts,
        ))  # fmt: skip

    def happened(self) -> None:
        """Plan nothing: the counts never stop a run."""
