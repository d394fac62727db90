"""Slow twins of carrying, consuming and grazing, and of the robots with motor schemas, in plain Python."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass
class Thing:
    """A robot, an attractor or a home, as it is before and after what happens."""

    number: int
    place: tuple[float, float]
    before: tuple[float, float]
    is_active: bool
    speed: float = 0.0
    own_speed: float = 0.0
    slow_speed: float = 0.0
    holds: int = 0
    mass: float = 0.0
    reward: float = 0.0
    has_ended: bool = False

    def far_from(self, other: Thing) -> float:
        return math.hypot(self.place[0] - other.place[0], self.place[1] - other.place[1])


def _let_go(robot: Thing) -> None:
    robot.speed, robot.holds = robot.own_speed, 0


def _hold(robots: list[Thing], attractors: list[Thing], reach: float) -> None:
    """Whoever holds an attractor that is no longer there lets go; whoever holds none takes the nearest within reach."""
    there = {one.number: one for one in attractors if one.is_active and one.mass > 0}
    for robot in robots:
        if robot.holds:
            if robot.speed != robot.slow_speed:
                robot.own_speed = robot.speed
            if robot.holds not in there or not robot.is_active:
                _let_go(robot)
        near = [one for one in there.values() if robot.far_from(one) <= reach]
        if robot.is_active and not robot.holds and near:
            robot.own_speed = robot.slow_speed = robot.speed
            robot.holds = min(near, key=robot.far_from).number


def carry(robots: list[Thing], attractors: list[Thing], homes: list[Thing], rule: Any) -> dict[str, float]:
    """Carriers are where the first of them is, with their attractor; at home it is delivered."""
    _hold(robots, attractors, rule.reach)
    delivered = mass = 0.0
    for attractor in attractors:
        carriers = [robot for robot in robots if robot.holds == attractor.number]
        for robot in carriers:
            robot.place = attractor.place = carriers[0].place
            robot.speed = robot.slow_speed = robot.own_speed / (1 + attractor.mass / (len(carriers) * rule.strength))
        if carriers and any(home.is_active and home.far_from(attractor) <= rule.home_radius for home in homes):
            delivered += 1
            mass += attractor.mass
            attractor.mass = 0.0
            for robot in carriers:
                robot.reward, robot.has_ended = 1.0, True
                _let_go(robot)
    return {"delivered": delivered, "delivered_mass": mass}


def consume(robots: list[Thing], attractors: list[Thing], homes: list[Thing], rule: Any) -> dict[str, float]:
    """Those at an attractor stay, and take of its mass, each as much, until nothing is left."""
    stay = {robot.number for robot in robots if robot.holds and robot.slow_speed == 0.0}
    _hold(robots, attractors, rule.reach)
    consumed = finished = 0.0
    for attractor in attractors:
        eaters = [robot for robot in robots if robot.holds == attractor.number]
        if not eaters:
            continue
        taken = min(attractor.mass, rule.rate * len(eaters))
        attractor.mass -= taken
        consumed += taken
        is_gone = attractor.mass <= 1e-9
        if is_gone:
            attractor.mass = 0.0
            finished += 1
        for robot in eaters:
            if robot.number in stay:
                robot.place = robot.before
            robot.speed = robot.slow_speed = 0.0
            robot.reward = taken / len(eaters)
            if is_gone:
                robot.has_ended = True
                _let_go(robot)
    return {"consumed": consumed, "finished": finished}


def graze(ground: np.ndarray, robots: list[Thing], rule: Any, whole: float) -> tuple[float, list[tuple[float, float]]]:
    """Graze all cells whose centres are within reach, one robot after the other; return the share, and the probes."""
    cells = [(r, c) for r in range(len(ground)) for c in range(len(ground))]
    centre = {(r, c): ((c + 0.5) * rule.cell - rule.side / 2, (r + 0.5) * rule.cell - rule.side / 2) for r, c in cells}
    total = 0.0
    for robot in robots:
        mine = [one for one in cells if ground[one] and math.dist(centre[one], robot.place) <= rule.reach]
        if robot.is_active:
            for one in mine:
                ground[one] = 0
            robot.reward = len(mine) / whole
            total += robot.reward
    probes = []
    for robot in robots:
        fresh = [one for one in cells if ground[one] and math.dist(centre[one], robot.place) < rule.probe]
        nearest = min(fresh, key=lambda one, at=robot.place: math.dist(centre[one], at), default=None)  # type: ignore[misc]
        x, y = centre[nearest] if nearest else robot.place
        probes.append((x - robot.place[0], y - robot.place[1]))
    return total, probes


WANDER, FOLLOW, ACQUIRE, WORK = range(4)


@dataclass
class Seen:
    """What one robot perceives: offsets, and the columns of others by their number."""

    number: int
    home: Any
    teammates: list[tuple[int, Any]]
    targets: list[tuple[int, Any]]
    columns: dict[str, Any]
    speed: float


def _length(vector: Any) -> float:
    return float(np.hypot(*vector))


def _fades(distance: float, sphere: float) -> float:
    """Repulsion: 1 at no distance, 0 from the sphere on."""
    return float(np.clip((sphere - distance) / sphere, 0.0, 1.0))


def _follows(seen: Seen, communication: str) -> Any:
    """Where a robot without a goal goes for others: to the nearest that is at work, or to its goal."""
    at_work = [one for one in seen.teammates if seen.columns["mode"][one[0]] >= ACQUIRE]
    if communication == "none" or not at_work:
        return None
    number, offset = min(at_work, key=lambda one: _length(one[1]))
    if communication == "state":
        return offset
    return seen.home + np.array([seen.columns["goal_x"][number], seen.columns["goal_y"][number]])


def mode_and_goal(policy: Any, seen: Seen) -> tuple[int, Any, Any]:
    """What a robot does, the offset to its goal, and the place that it shows as its goal, from home."""
    columns, nothing = seen.columns, np.zeros(2)
    if "attached" in policy.columns:
        if columns["attached"][seen.number] > 0:
            return WORK, seen.home if policy.delivers else nothing, -seen.home
        left = [offset for number, offset in seen.targets if columns["mass"][number] > 0]
        if left:
            goal = min(left, key=_length)
            return ACQUIRE, goal, goal - seen.home
    else:
        probe = np.array([columns["probe_x"][seen.number], columns["probe_y"][seen.number]])
        if probe.any():
            return WORK, probe, probe - seen.home
    goal = _follows(seen, policy.communication)
    return (WANDER, nothing, -seen.home) if goal is None else (FOLLOW, goal, goal - seen.home)


def action(policy: Any, seen: Seen, mode: int, goal: Any, drawn: Any) -> tuple[Any, float]:
    """The sum of the schemas: the direction in which the robot goes, and how far; `drawn` is the random direction."""
    works = mode != WANDER
    away = np.zeros(2)
    for x, y, radius in policy.obstacles:
        offset = -seen.home - np.array([x, y])
        gap = _length(offset) - radius
        if _length(offset) > 0 and gap < policy.obstacle_sphere:
            away += policy.obstacle * _fades(gap, policy.obstacle_sphere) * offset / _length(offset)
    apart = policy.robot_at_work if works else policy.robot
    for _, offset in seen.teammates:
        if 1e-9 < _length(offset) < policy.robot_sphere:
            away -= apart * _fades(_length(offset), policy.robot_sphere) * offset / _length(offset)
    total = away + (policy.noise_at_work if works else policy.noise) * drawn
    limit = seen.speed
    if works and _length(goal) > 1e-9:
        total = total + policy.goal * goal / _length(goal)
        limit = min(limit, _length(goal))
    return total, min(_length(total) * seen.speed, limit)
