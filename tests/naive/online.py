"""Slow twins of the online learners: one robot, one value at a time."""

from __future__ import annotations

import math
from typing import Any

HEADINGS = ((0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 0.0))


def within(offset: Any, depth: float) -> bool:
    return max(abs(round(float(along))) for along in offset) <= depth


def closest(seen: Any, depth: float, number: float) -> Any:
    """The offset of the nearest neighbour within the depth; of equally near ones, in their order, the one drawn."""
    near = [
        (float(far), offset) for far, offset in zip(seen.distance, seen.offset, strict=True) if within(offset, depth)
    ]
    if not near:
        return None
    least = min(far for far, _ in near)
    equals = [offset for far, offset in near if far == least]
    return equals[int(number * len(equals))]


def cell(offset: Any, extent: int) -> int:
    """Columns of cells from the west, each from the south; the number behind the last for nothing."""
    side = 2 * extent + 1
    if offset is None or not within(offset, extent):
        return side * side
    return (round(float(offset[0])) + extent) * side + round(float(offset[1])) + extent


def prey_row(policy: Any, one: Any, noise: list[float]) -> int:
    """The cell of the closest prey that the robot senses, else of the closest reported; with the closest teammate's."""
    reach = policy.reach or policy.depth
    prey = closest(one.targets, policy.depth, noise[1])
    if prey is None:
        prey = closest(one.relayed, reach, noise[1])
    row = cell(prey, reach)
    if policy.partner:
        mate = closest(one.teammates, policy.partner, noise[2])
        row = row * ((2 * policy.partner + 1) ** 2 + 1) + cell(mate, policy.partner)
    return row


def inside(policy: Any, one: Any) -> list[int]:
    """The moves that the policy may make: those that end in the grid, if it knows the walls."""
    if not hasattr(policy, "side"):
        return list(range(policy.moves))
    x, y = (float(column[one.identity]) for column in (one.columns.position_x, one.columns.position_y))
    ends = [(x + along, y + across) for along, across in HEADINGS[: policy.moves]]
    return [move for move, end in enumerate(ends) if max(map(abs, end)) < policy.side / 2]


def chosen(values: list[float], temperature: float, number: float, allowed: list[int] | None = None) -> int:
    """The action that the number falls upon, when each, of those that are allowed, has a share proportional to exp(Q / T)."""
    allowed = list(range(len(values))) if allowed is None else allowed
    best = max(values[move] for move in allowed)
    if temperature == 0:
        weights = [float(value == best) for value in values]
    else:
        weights = [math.exp(min(value - best, 0.0) / temperature) for value in values]
    weights = [weight if move in allowed else 0.0 for move, weight in enumerate(weights)]
    rest = number * sum(weights)
    for action, weight in enumerate(weights):
        if weight > 0 and rest < weight:
            return action
        rest -= weight
    return max(action for action, weight in enumerate(weights) if weight > 0)


class QTeam:
    """A team of Q-learners; `row_of(policy, percept, noise)` names what a robot perceives."""

    def __init__(self, policy: Any, robots: int, row_of: Any) -> None:
        self.policy, self.row_of = policy, row_of
        start = policy.start(robots).floats
        self.tables = [[list(map(float, row)) for row in table] for table in start]
        self.last: list[tuple[int, int] | None] = [None] * robots

    def decide(self, percepts: list[Any], noise: Any) -> list[tuple[tuple[float, float], float]]:
        policy, tables = self.policy, self.tables
        every, time = policy.average_every, percepts[0].time
        if every and time > 0 and time % every == 0:
            self.average()
        answers = []
        for i, one in enumerate(percepts):
            now = self.row_of(policy, one, noise[:, i].tolist())
            if self.last[i] is not None and policy.learning_rate > 0:
                self.learn(i, now, one)
            action = chosen(tables[i][now], policy.temperature, float(noise[0, i]), inside(policy, one))
            self.last[i] = None if one.ended else (now, action)
            answers.append((HEADINGS[action], 0.0 if action == 4 else float(one.speed)))
        return answers

    def average(self) -> None:
        robots = len(self.tables)
        for row in range(len(self.tables[0])):
            for action in range(self.policy.moves):
                mean = sum(table[row][action] for table in self.tables) / robots
                for table in self.tables:
                    table[row][action] = mean

    def learn(self, i: int, now: int, one: Any) -> None:
        policy = self.policy
        last = self.last[i]
        assert last is not None
        row, action = last
        ahead = 0.0 if one.ended and not policy.values_ends else max(self.tables[i][now])
        value = self.tables[i][row][action]
        value += policy.learning_rate * (float(one.reward) + policy.discount * ahead - value)
        for j in range(len(self.tables)) if policy.one_table else [i]:
            self.tables[j][row][action] = value


class ModularTeam:
    """A team whose robots have a table for each partner, or one over all; the sum of all decides."""

    def __init__(self, policy: Any, robots: int) -> None:
        self.policy = policy
        self.modules: list[list[dict[str, Any]]] = [[] for _ in range(robots)]
        self.action = [0] * robots

    def decide(self, percepts: list[Any], noise: Any) -> list[tuple[tuple[float, float], float]]:
        return [self.decide_one(i, one, noise[:, i].tolist()) for i, one in enumerate(percepts)]

    def decide_one(self, i: int, one: Any, noise: list[float]) -> tuple[tuple[float, float], float]:
        policy, modules = self.policy, self.modules[i]
        while len(modules) < policy.modules:
            modules.append({"partner": None, "last": None, "table": {}})
        places = self.by_distance(one) if policy.by == "distance" else self.by_identity(modules, one)
        prey = cell(closest(one.targets, policy.depth, noise[1]), policy.depth)
        situations = [(prey, place) for place in places]
        if policy.monolithic:
            situations, modules = [(prey, *places)], modules[:1]
        mass = []
        for module, now in zip(modules, situations, strict=True):
            self.learn(module, self.action[i], now, one)
            module["last"] = None if one.ended else now
            values = module["table"].get(now, [0.0] * policy.moves)
            mass = values if not mass else [a + b for a, b in zip(mass, values, strict=True)]
        self.action[i] = action = chosen(list(mass), policy.temperature, noise[0])
        return HEADINGS[action], 0.0 if action == 4 else float(one.speed)

    def by_distance(self, one: Any) -> list[int]:
        """The cells of the nearest teammates in sight, nearest first."""
        near = [
            (float(far), k)
            for k, (far, offset) in enumerate(zip(one.teammates.distance, one.teammates.offset, strict=True))
            if within(offset, self.policy.depth)
        ]
        found = [cell(one.teammates.offset[k], self.policy.depth) for _, k in sorted(near)]
        return (found + [cell(None, self.policy.depth)] * self.policy.modules)[: self.policy.modules]

    def by_identity(self, modules: list[dict[str, Any]], one: Any) -> list[int]:
        """The cells of the partners, in the order in which they were met."""
        seen = dict(zip(one.teammates.identity.tolist(), one.teammates.offset, strict=True))
        for identity in seen:
            if identity not in [module["partner"] for module in modules]:
                free = [module for module in modules if module["partner"] is None]
                if free:
                    free[0]["partner"] = identity
        return [cell(seen.get(module["partner"]), self.policy.depth) for module in modules]

    def learn(self, module: dict[str, Any], action: int, now: Any, one: Any) -> None:
        policy, table = self.policy, module["table"]
        if module["last"] is None or policy.learning_rate == 0:
            return
        ahead = 0.0 if one.ended and not policy.values_ends else max(table.get(now, [0.0]))
        values = table.setdefault(module["last"], [0.0] * policy.moves)
        values[action] += policy.learning_rate * (float(one.reward) + policy.discount * ahead - values[action])
