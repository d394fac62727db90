"""Slow twins of B-CMOMMT and P-CMOMMT."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from naive.paper import ACmommtRobot, Vector, repulsion, search


class PCmommtRobot(ACmommtRobot):
    """A robot under A-CMOMMT that counts how often it has known each target to be observed."""

    def __init__(self, policy: Any) -> None:
        super().__init__(policy)
        self.counts: Counter[int] = Counter()

    def decide(self, one: Any, noise: list[float]) -> tuple[Vector, float]:
        """Count each target once that it or a teammate senses, if there is room; then decide as A-CMOMMT."""
        room = max(self.policy.observation_counts, self.policy.target_tracks)
        for identity in dict.fromkeys([*one.targets.identity.tolist(), *one.relayed.identity.tolist()]):
            if identity in self.counts or len(self.counts) < room:
                self.counts[identity] += 1
        return super().decide(one, noise)

    def _share(self, identity: int) -> float:
        """The information of the target over that of an average one, to a power."""
        if len(self.counts) < 2:
            return 1.0
        p = (1 + self.counts.get(identity, 0)) / sum(1 + count for count in self.counts.values())
        return (-math.log(p) / math.log(len(self.counts))) ** self.policy.evenness


def requests(policy: Any, one: Any) -> list[Vector]:
    """The places of the targets with which the robot could help: only others sense them, all from far away."""
    own, teammates = set(one.targets.identity.tolist()), one.teammates.offset.tolist()
    relayed = dict(reversed([*zip(one.relayed.identity.tolist(), one.relayed.offset.tolist(), strict=True)]))
    return [
        tuple(place)
        for identity, place in relayed.items()
        if identity not in own
        and all(math.dist(place, teammate) >= policy.escape * one.sensing_range for teammate in teammates)
    ]


def share_in(policy: Any, one: Any, identity: int, target: Vector) -> float:
    """The weight of a sensed target."""
    if policy.weights == "nearest":
        return float(all(math.dist(target, mate) >= math.hypot(*target) for mate in one.teammates.offset.tolist()))
    return 1 / (1 + one.relayed.identity.tolist().count(identity)) if policy.weights == "shared" else 1.0


def b_cmommt(policy: Any, one: Any, noise: list[float]) -> tuple[Vector, float]:
    """Help if there is little to follow, follow if there is something, otherwise keep away from teammates."""
    sensed = [*zip(one.targets.identity.tolist(), map(tuple, one.targets.offset.tolist()), strict=True)]
    weights = [share_in(policy, one, identity, target) for identity, target in sensed]
    asked = requests(policy, one)
    if asked and sum(weights) < policy.answer:
        way = min(asked, key=lambda place: math.hypot(*place))
        return (way[0] / math.hypot(*way), way[1] / math.hypot(*way)), one.speed
    if sum(weights):
        x, y = (sum(w * target[axis] for w, (_, target) in zip(weights, sensed, strict=True)) / sum(weights) for axis in (0, 1))
        length = math.hypot(x, y)
        return ((x / length, y / length) if length else (0.0, 0.0)), length
    force = sum(
        repulsion(math.hypot(*mate) / one.sensing_range, policy.dr1, policy.dr2) * complex(*mate) / math.hypot(*mate)
        for mate in one.teammates.offset.tolist()
    )
    if abs(force) > 1e-9:
        return (force.real / abs(force), force.imag / abs(force)), min(abs(force), 1.0) * one.speed
    return search(policy, tuple(one.heading), noise, one.speed)
