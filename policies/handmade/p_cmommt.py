"""P-CMOMMT: A-CMOMMT in which a robot prefers the targets that it knows to have been observed least."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from teamsight.core.component import Count, NonNegative
from teamsight.core.elementary import log, power
from teamsight.core.kernel import inlined, lowest_bit
from teamsight.policies.handmade.a_cmommt import ACmommt, act, expectation, lost_tracks, pull, push
from teamsight.policies.handmade.target_tracks import IDENTITY, no_target_tracks
from teamsight.policies.interface import PolicyState

# Float fields of the state after the four of target tracks: the identity of a target, plus 1 (0 ends the list), the
# number of decisions at which it was known to be observed, and 1 while it was counted at the present one.
KNOWN, OBSERVED, _IS_COUNTED, _FIELDS = 4, 5, 6, 7


@inlined
def _slot_of(known: Any, identity: int) -> int:
    """Return the slot of a target, or the first free one; −1 if it has none and none is free."""
    for slot in range(known.shape[0]):
        if known[slot, KNOWN] == identity + 1 or known[slot, KNOWN] == 0.0:
            return slot
    return -1


@inlined
def _count(known: Any, seen: Any, i: int) -> None:
    """Count the targets of a neighbour list, each once for a decision."""
    for k in range(seen.start[i], seen.start[i + 1]):
        slot = _slot_of(known, seen.identity[k])
        if slot >= 0 and known[slot, _IS_COUNTED] == 0.0:
            known[slot, KNOWN] = seen.identity[k] + 1
            known[slot, OBSERVED] += 1.0
            known[slot, _IS_COUNTED] = 1.0


@inlined
def _totals(known: Any) -> tuple[float, float]:
    """Return the number of known targets, and the sum of their counts with 1 more for each; end the decision."""
    number = 0.0
    total = 0.0
    for slot in range(known.shape[0]):
        if known[slot, KNOWN] == 0.0:
            break
        number += 1.0
        total += 1.0 + known[slot, OBSERVED]
        known[slot, _IS_COUNTED] = 0.0
    return number, total


@inlined
def _novelty(identity: int, known: Any, most: float, total: float, evenness: float) -> float:
    """Return the factor on the force of a target: −log p / log m to the power of `evenness`; 1 if it knows one only."""
    if most <= 0.0:
        return 1.0
    slot = _slot_of(known, identity)
    observed = known[slot, OBSERVED] if slot >= 0 else 0.0
    return power(log(total / (1.0 + observed)) / most, evenness)


@inlined
def _decide(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    parameters = arrays.parameters
    evenness = parameters[parameters.shape[0] - 1]
    targets = percept.targets
    for i in range(percept.heading.shape[0]):
        known = arrays.state.floats[i]
        _count(known, targets, i)
        _count(known, percept.relayed, i)
        number, total = _totals(known)
        most = log(number)
        per_reach = 1.0 / percept.sensing_range[i]
        x, y = push(per_reach, percept, i, parameters)
        for k in range(targets.start[i], targets.start[i + 1]):
            pull_x, pull_y = pull(
                targets.offset[k, 0], targets.offset[k, 1], targets.distance[k], per_reach, percept, i, parameters
            )
            novelty = _novelty(targets.identity[k], known, most, total, evenness)
            x += novelty * pull_x
            y += novelty * pull_y
        lost_x = 0.0
        lost_y = 0.0
        lost = lost_tracks(i, percept, arrays)
        slots = lost
        while slots != 0:
            slot, slots = lowest_bit(slots)
            pull_x, pull_y = expectation(i, slot, per_reach, percept, arrays)
            novelty = _novelty(arrays.state.ints[i, slot, IDENTITY], known, most, total, evenness)
            lost_x += novelty * pull_x
            lost_y += novelty * pull_y
        act(x + lost_x, y + lost_y, lost != 0, i, percept, parameters, noise, action)


@dataclass(frozen=True)
class PCmommt(ACmommt):
    """A-CMOMMT with evenness: targets that a robot knows to have been observed less attract it more.

    A robot counts for each target the decisions at which it sensed it, or a teammate relayed it. With p the share of a
    target in these counts, each with 1 added, and m the number of targets that it has met, the force of the target is
    multiplied by (−log p / log m) to the power of `evenness`: its information, as a multiple of that of m targets that
    were observed alike.

    Parameters
    ----------
    evenness : float
        The exponent, at least 0. With 0 the policy is A-CMOMMT, to the last bit.
    observation_counts : int
        The number of targets that a robot can count, or `target_tracks` if that is more; a target beyond counts as not
        yet observed.
    idle, idle_when, weights, … : object
        As in `ACmommt`.

    Raises
    ------
    ValueError, TypeError
        If an option is unknown, or a constant is outside its limits.

    Notes
    -----
    *Source:* Ding, Zhu, He and Jiang, "P-CMOMMT algorithm for the cooperative multi-robot observation of multiple
    moving targets" (WCICA 2006), of which we know that it adds evenness over targets to A-CMOMMT, by information
    entropy. *Departs:* its formula and constants are not known to us. That the information −log p of each target
    weights its force, that a robot counts what it senses and what is relayed to it alone, and that counts never decay,
    is our choice.
    """

    evenness: NonNegative = 1.0
    observation_counts: Count = 64

    kernel = _decide

    @property
    def parameters(self) -> tuple[float, ...]:
        return (*super().parameters, self.evenness)

    def start(self, size: int) -> PolicyState:
        tracks = no_target_tracks(size, self.target_tracks)
        slots = max(self.observation_counts, self.target_tracks)
        return PolicyState(np.zeros((size, slots, _FIELDS)), tracks.ints)
