"""Slow twins of collecting: the field of pucks, and a robot that learns among behaviours, one sentence at a time."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any

import numpy as np

from naive.online import chosen
from teamsight.world.noise import Stream, key_within, stream_number, uniforms

EVENTS = ("grabbed", "dropped_home", "dropped_away", "woken_home", "woken_away")
WANDERING, DISPERSION, RESTING, HOMING = range(4)


class Field:
    """Robots and pucks by number. `step` is given where robots have gone, and what noise there is for pucks."""

    def __init__(self, rules: Any, robots: Any, pucks: Any) -> None:
        self.rules = rules
        self.place = [tuple(map(float, place)) for place in robots.bodies.position]
        self.pucks = [tuple(map(float, place)) for place in pucks.bodies.position]
        self.held: dict[int, int] = {}
        self.delivered: set[int] = set()
        self.events = [dict.fromkeys(EVENTS, 0) for _ in self.place]
        self.now = 0
        self.night = False

    def is_home(self, place: tuple[float, float]) -> bool:
        return math.hypot(*place) <= self.rules.home_radius

    def step(self, places: Any, noise: Any) -> dict[str, int]:
        """Make a step; return how often each event happened in it."""
        before = [dict(one) for one in self.events]
        self.now += 1
        hour = self.now % self.rules.period
        self.night = hour >= self.rules.period - self.rules.night
        for robot, given in enumerate(places):
            place = (float(given[0]), float(given[1]))
            still, self.place[robot] = place == self.place[robot], place
            self.carry_or_grasp(robot, place, noise, still=still)
            if hour == 0 and self.rules.night:
                if not self.is_home(place):
                    self.events[robot]["woken_away"] += 1
                elif still:
                    self.events[robot]["woken_home"] += 1
        for puck in set(range(len(self.pucks))) - set(self.held.values()) - self.delivered:
            x, y = self.pucks[puck]
            if self.is_home((x, y)):
                self.pucks[puck] = (x + math.copysign(self.rules.side / 2, -x) if x else -self.rules.side / 2, y)
        return {
            name: sum(now[name] - then[name] for now, then in zip(self.events, before, strict=True)) for name in EVENTS
        }

    def carry_or_grasp(self, robot: int, place: tuple[float, float], noise: Any, *, still: bool) -> None:
        puck = self.held.get(robot)
        if puck is not None:
            self.pucks[puck] = place
            if self.is_home(place):
                self.events[robot]["dropped_home"] += 1
                del self.held[robot]
                if self.rules.renewed:
                    self.pucks[puck] = tuple(self.rules.side * (float(noise[axis, puck]) - 0.5) for axis in range(2))
                else:
                    self.delivered.add(puck)
            elif still:
                self.events[robot]["dropped_away"] += 1
                del self.held[robot]
        elif not still and not self.night and not self.is_home(place):
            free = set(range(len(self.pucks))) - set(self.held.values()) - self.delivered
            near = sorted((math.dist(self.pucks[puck], place), puck) for puck in free)
            if near and near[0][0] <= self.rules.reach:
                self.held[robot] = near[0][1]
                self.events[robot]["grabbed"] += 1


def noise_of_pucks(world: Any) -> np.ndarray:
    """The uniform numbers that the interaction has for pucks in the next step, shape (2, pucks)."""
    key = key_within(world._data.key, f"interaction {type(world.interactions[0]).__name__} 0")
    return uniforms(key, stream_number(Stream.INTERACTION, 1), world.tick, world.pucks.bodies.member, 2)


class Robot:
    """A robot with values A(conditions, behaviour), by sentences."""

    def __init__(self, policy: Any) -> None:
        self.policy = policy
        self.values: dict[Any, list[float]] = defaultdict(lambda: [0.0] * 4)
        self.behaviour: int | None = None
        self.counts = dict.fromkeys(EVENTS, 0.0)
        self.near, self.home, self.had_puck = math.inf, math.inf, False

    def conditions(self, percept: Any, i: int) -> Any:
        """Puck, home and night, and what is known of intruders."""
        policy, me = self.policy, percept.identity[i]
        angles = []
        for offset in teammates(percept, i):
            if math.hypot(*offset) < policy.intruder_range:
                ahead = math.atan2(percept.heading[i][1], percept.heading[i][0])
                angles.append(math.atan2(offset[1], offset[0]) - ahead)
        if policy.intruders == "ring":
            # On the border of two sectors, the first.
            shares = [(angle * policy.delta / (2 * math.pi)) % policy.delta for angle in angles]
            sectors = {math.ceil(share - 0.5 - 1e-5) % policy.delta for share in shares}
            crowd = sum(2**sector for sector in sectors)
        else:
            crowd = min(len(angles), policy.delta)
        return (*(bool(getattr(percept.columns, name)[me] > 0) for name in ("puck", "at_home", "night")), crowd)

    def decide(self, percept: Any, i: int, noise: Any) -> int:
        """Learn from the last step; return the behaviour."""
        policy, me = self.policy, percept.identity[i]
        now = self.conditions(percept, i)
        reinforcement, is_over = self.reinforced(percept, i, has_puck=now[0])
        if policy.scheme == "delayed":
            reinforcement = float(percept.reward[i])
        if self.behaviour is not None:
            self.total += self.weight * reinforcement
            self.weight *= policy.discount if policy.scheme == "delayed" else 1.0
            self.steps += 1
        if self.behaviour is None or is_over or now != self.began or self.steps >= policy.timeout:
            self.learn(now)
            if noise[0] < policy.exploration:
                self.behaviour = int(noise[1] * 4)
            else:
                self.behaviour = chosen(self.values[now], 0.0, noise[1])
            self.began, self.steps, self.stuck, self.total, self.weight = now, 0, 0, 0.0, 1.0
        assert me > 0
        return self.behaviour

    def reinforced(self, percept: Any, i: int, *, has_puck: bool) -> tuple[float, bool]:
        policy = self.policy
        u, v, w = {"progress": policy.weights or (0.5, 0.25, 0.25), "events": (1.0, 0.0, 0.0)}.get(
            policy.scheme, (0.0, 0.0, 0.0)
        )
        counts = {name: float(getattr(percept.columns, name)[percept.identity[i]]) for name in EVENTS}
        new = {name: counts[name] - self.counts[name] for name in EVENTS}
        good = new["grabbed"] + new["dropped_home"] + new["woken_home"]
        bad = new["dropped_away"] + new["woken_away"]
        near = min([policy.intruder_range, *(math.hypot(*offset) for offset in teammates(percept, i))])
        home = math.hypot(*home_of(percept, i))
        avoided = 0.0 if self.near >= policy.intruder_range else math.copysign(1.0, near - self.near - 1e-300)
        homed = 0.0
        if has_puck and self.had_puck:
            homed = math.copysign(1.0, self.home - home - 1e-300)
        estimated = v * avoided + w * homed
        self.counts, self.near, self.home, self.had_puck = counts, near, home, has_puck
        self.stuck = self.stuck + 1 if self.behaviour is not None and estimated < 0 else 0
        gained = u * (good - policy.punishment * bad) + policy.progress * estimated
        return gained, good + bad > 0 or self.stuck >= policy.patience

    def learn(self, now: Any) -> None:
        if self.behaviour is None:
            return
        values = self.values[self.began]
        if self.policy.scheme == "delayed":
            goal = self.total + self.weight * max(self.values[now])
            values[self.behaviour] += self.policy.learning_rate * (goal - values[self.behaviour])
        else:
            values[self.behaviour] += self.total

    def table(self) -> np.ndarray:
        """The values as rows."""
        codes = self.policy.codes
        found = np.zeros((8 * codes, 4))
        for (puck, home, night, crowd), values in self.values.items():
            found[(4 * puck + 2 * home + night) * codes + crowd] = values
        return found


def teammates(percept: Any, i: int) -> list[tuple[float, float]]:
    seen = percept.teammates
    return [tuple(map(float, offset)) for offset in seen.offset[seen.start[i] : seen.start[i + 1]]]


def home_of(percept: Any, i: int) -> tuple[float, float]:
    seen = percept.channels.home
    return tuple(map(float, seen.offset[seen.start[i]]))


def course(behaviour: int, percept: Any, i: int, policy: Any, noise: Any) -> tuple[float, float, float]:
    """The direction of a behaviour as an angle, how sure it is (0 for a heading that may be any), and the distance."""
    heading = math.atan2(percept.heading[i][1], percept.heading[i][0])
    speed = float(percept.speed[i])

    def apart(sphere: float) -> tuple[float, float]:
        sums = [0.0, 0.0]
        for offset in teammates(percept, i):
            far = math.hypot(*offset)
            if 1e-9 < far < sphere:
                for axis in range(2):
                    sums[axis] -= (sphere - far) / sphere * offset[axis] / far
        return sums[0], sums[1]

    if behaviour == HOMING:
        return math.atan2(*home_of(percept, i)[::-1]), 1.0, speed
    if behaviour == RESTING:
        return heading, 0.0, 0.0
    x, y = apart(policy.safe_range if behaviour == WANDERING else float(percept.awareness_range[i]))
    if (x, y) != (0.0, 0.0):
        return math.atan2(y, x), math.hypot(x, y), speed
    if behaviour == DISPERSION:
        return heading, 0.0, 0.0
    turn = policy.turn_range * (2.0 * noise[1] - 1.0) if noise[0] < policy.turn_probability else 0.0
    return heading + turn, 1.0, speed
