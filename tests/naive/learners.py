"""Slow twins of the lazy learners: written like the sentences that describe them, one transition at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from naive import lazy as naive_lazy

Numbers = Sequence[float]


def matches(situations: Any, situation: Any, k: int) -> list[int]:
    """The k nearest; of equally near ones those that stand first."""
    return [place for _, place in naive_lazy.nearest(situations, situation, k)]


def gain_reward(gained: float, lost: float, both: str) -> float:
    """+1 for targets acquired, −1 for targets lost, and a rule for both at once."""
    if gained and lost:
        return {"gain": 1.0, "loss": -1.0, "none": 0.0, "net": float((gained > lost) - (gained < lost))}[both]
    return 1.0 if gained else -1.0 if lost else 0.0


def action_values(memory: Any, rewards: Numbers, inputs: int, k: int, discount: float, sweeps: int) -> list[float]:
    """Q_i ← r_i + γ max Q_j over the k transitions whose situations are nearest to the next situation of i."""
    known = memory.situation[:, :inputs]
    values = list(rewards)
    follow = [matches(known, leads, k) for leads in memory.next_situation[:, :inputs]]
    for _ in range(sweeps):
        values = [r + discount * max(values[j] for j in near) for r, near in zip(rewards, follow, strict=True)]
    return values


def lazy_q(memory: Any, values: Numbers, situation: Any, inputs: int, k: int) -> tuple[float, float]:
    """The action of the highest value among the k nearest; the first of equals."""
    near = matches(memory.situation[:, :inputs], situation, k)
    best = max(near, key=lambda j: values[j])
    rotation, share = memory.action[best]
    return float(rotation), float(share)


def pessimistic(
    memory: Any, values: Numbers, situation: Any, inputs: int, k: int, rotations: int, distances: Numbers
) -> tuple[float, float]:
    """The action of a grid whose lowest matching value is highest; of equals that of the nearer match."""
    grid = [(2 * math.pi * turn / rotations, distance) for turn in range(rotations) for distance in distances]
    worst: dict[int, float] = {}
    for j in matches(memory.situation[:, :inputs], situation, k):
        rotation, share = (float(number) for number in memory.action[j])

        def unlike(one: int, rotation: float = rotation, share: float = share) -> tuple[float, float]:
            turn = abs(math.remainder(grid[one][0] - rotation, 2 * math.pi))
            return turn, abs(grid[one][1] - share)

        nearest = min(range(len(grid)), key=unlike)
        worst[nearest] = min(worst.get(nearest, math.inf), values[j])
    return grid[max(worst, key=lambda one: worst[one])]


class SheppardRobot:
    """One robot that stores transitions with their utilities; its random numbers are parameters."""

    def __init__(self, policy: Any, rewards: Any) -> None:
        self.policy, self.rewards = policy, rewards
        self.store: list[dict[str, Any]] = []
        self.pending: dict[str, Any] | None = None
        self.stored = 0
        self.seen: set[int] = set()

    def know(self, memory: Any, values: Numbers) -> None:
        """Begin with the transitions of a memory."""
        for situation, action, value in zip(memory.situation, memory.action, values, strict=True):
            rotation, share = (float(number) for number in action)
            self.store.append({"situation": situation, "rotation": rotation, "share": share, "q": value})
        self.stored = len(self.store)

    def similar(self, situation: Any) -> list[tuple[float, int]]:
        found = []
        for j, one in enumerate(self.store):
            apart = 0.0
            for a, b in zip(one["situation"], situation, strict=True):
                apart += abs(float(a) - float(b))
            if apart <= self.policy.threshold:
                found.append((apart, j))
        return found

    def best(self, situation: Any) -> dict[str, Any] | None:
        found = self.similar(situation)
        if not found:
            return None
        return self.store[max(found, key=lambda match: (self.store[match[1]]["q"], -match[0], -match[1]))[1]]

    def decide(self, situation: Any, targets: set[int], noise: Numbers) -> tuple[float, float]:
        policy = self.policy
        gained, lost = len(targets - self.seen), len(self.seen - targets)
        self.seen = targets
        if self.pending is not None:
            ahead = self.best(situation)
            goal = self.rewards[gained][lost] + policy.discount * (ahead["q"] if ahead else 0.0)
            tried = dict(self.pending)
            for _, j in self.similar(tried["situation"]):
                one = self.store[j]
                turn = abs(one["rotation"] - tried["rotation"]) / math.pi
                if min(turn, 2 - turn) + abs(one["share"] - tried["share"]) <= policy.similar_action:
                    one["q"] += policy.learning_rate * (goal - one["q"])
        known = None if noise[0] < policy.explore else self.best(situation)
        rotation = known["rotation"] if known else 2 * math.pi * (noise[1] - 0.5)
        share = known["share"] if known else noise[2]
        self.pending = {"situation": [float(x) for x in situation], "rotation": rotation, "share": share, "q": 0.0}
        if self.stored < policy.capacity:
            self.store.append(self.pending)
        else:
            self.store[self.stored % policy.capacity] = self.pending
        self.stored += 1
        return rotation, share
