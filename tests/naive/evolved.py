"""The slow twin of the evolved policy, robot by robot, in plain Python and NumPy."""

from __future__ import annotations

import cmath
import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from naive import paper as naive
from teamsight.policies.evolved import Evolved

TRACKING = SimpleNamespace(target_tracks=16, predictive=1.6, decay=6.0, relayed_decay=6.0)


def few(count: float) -> float:
    """None is 0, two are a half, many nearly 1."""
    return count / (2 + count)


def soft(x: Any) -> Any:
    """The neurons' squashing."""
    return x / (1 + np.abs(x))


def way(vector: complex) -> complex:
    """The unit vector."""
    return vector / abs(vector) if vector else 0j


class EvolvedRobot(naive.ACmommtRobot):
    """One robot with the evolved policy."""

    def __init__(self, policy: Any) -> None:
        super().__init__(TRACKING)
        self.blocks = Evolved.parts(policy.constants)
        self.fresh = self.old = self.met = 0j
        self.often_seen = self.often_teammates = 0.0
        self.idle = 0
        self.ground = [0j]

    def network(self, kind: str, features: list[float]) -> np.ndarray:
        """A layer of soft neurons and a sum of them."""
        hidden, out = self.blocks[f"{kind}_hidden"], self.blocks[f"{kind}_out"]
        return np.asarray(out @ np.r_[1, soft(hidden @ np.r_[1, features])])

    def law(self, kind: str, distance: float) -> float:
        """Linear between knots, one each fifth."""
        values = self.blocks[f"{kind}_law"]
        return float(np.interp(distance, 0.2 * np.arange(len(values)), values))

    def decide(self, one: Any, noise: list[float]) -> tuple[Any, float]:
        """Head along the sum of the forces."""
        turn, gain, lead, slope, offset, decay = self.blocks["scalars"]
        reach = one.sensing_range
        moved = complex(*one.moved)
        self.here += moved
        self.tick += 1
        self._update(one)
        teammates = [complex(*teammate) / reach for teammate in one.teammates.offset.tolist()]
        near = [d / one.awareness_range for d in one.teammates.distance.tolist()]
        target_tracks = [
            SimpleNamespace(at=self._expected(t) / reach, step=t[3] / reach, age=self.tick - t[2]) for t in self.target_tracks
        ]
        seen = [t for t in target_tracks if t.age == 0]
        loads = [sum(abs(t.at - teammate) < 1 for t in seen) for teammate in teammates]
        for t in target_tracks:
            gaps = [abs(t.at - teammate) for teammate in teammates]
            t.rival = min([1.5, *gaps])
            t.load = loads[int(np.argmin(gaps))] if gaps and t.rival < 1.5 else 0
            t.rivals = sum(gap < 1 for gap in gaps)
            t.own = 0.5 + 0.5 * soft(slope * (t.rival - abs(t.at)) + offset)
        for t in target_tracks:
            t.company = sum(o.own * max(0.0, 1 - abs(o.at - t.at) / 2) for o in target_tracks if o is not t)
        mine = sum(t.own for t in seen)
        self.idle = 0 if seen else self.idle + 1
        self.often_seen += 0.03 * (few(len(seen)) - self.often_seen)
        self.often_teammates += 0.03 * (few(len(teammates)) - self.often_teammates)
        self.fresh = 0.9 * (self.fresh - moved / reach)
        self.old = 0.985 * (self.old - moved / reach)
        # The ground is kept in the robot's own dead reckoning.
        self.ground += [self.here / reach, *(self.here / reach + place for place in teammates)]
        self.ground += [self.here / reach + complex(*place) / reach for place in one.targets.offset.tolist()]
        xs, ys = [g.real for g in self.ground], [g.imag for g in self.ground]
        extent = max(max(xs) - min(xs), max(ys) - min(ys)) / 2
        middle = complex(min(xs) + max(xs), min(ys) + max(ys)) / 2 - self.here / reach
        off = -sum((1 - d) * way(teammate) for teammate, d in zip(teammates, near, strict=True))
        self.met = 0.95 * self.met + 0.05 * off
        context = [
            few(len(seen)), few(mine), few(len(teammates)), self.often_seen, self.often_teammates, self.idle / (self.idle + 20),
            extent / (extent + 3),
        ]  # fmt: skip
        force = 0j
        for t in target_tracks:
            d = abs(t.at)
            away = (t.at.conjugate() * t.step).real
            pull, along = self.network("target", [
                *context, 2 * d - 1, t.rival / 0.75 - 1, min(max(3 * (t.rival - d), -1.5), 1.5), few(t.rivals),
                few(t.company), 10 * away / d, t.age / (t.age + 5), few(t.load),
            ])  # fmt: skip
            pull += t.own * self.law("target", d)
            force += math.exp(-t.age * decay**2) * (pull * way(t.at + lead * t.step) + 10 * along * t.step)
        for teammate, d, load in zip(teammates, near, loads, strict=True):
            (push,) = self.network("teammate", [*context, 2 * d - 1, few(load)])
            force += (push + self.law("teammate", d)) * way(teammate)
        drives = self.blocks["drives"] @ np.r_[1, context]
        ways = [complex(*one.heading), self.fresh, 0.2 * self.old, 3 * self.met, middle / (1 + abs(middle))]
        force += sum(drive * where for drive, where in zip(drives, ways, strict=True))
        if noise[1] < turn**2 * (1 - few(mine)):
            force += cmath.exp(2j * math.pi * noise[0])
        return (way(force).real, way(force).imag), min(abs(gain * force), 1.0) * one.speed
