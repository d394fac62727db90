"""The slow twin of the forces of groups, robot by robot, in plain Python."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from naive import paper as naive
from naive.evolved import few, way
from teamsight.policies.adaptive_forces import AdaptiveForces
from teamsight.policies.group_forces import TRACKS, GroupForces

TRACKING = SimpleNamespace(target_tracks=TRACKS, predictive=1.6, decay=6.0, relayed_decay=6.0)


class GroupForcesRobot(naive.ACmommtRobot):
    """One robot under the forces of groups."""

    def __init__(self, policy: Any) -> None:
        super().__init__(TRACKING)
        self.set(GroupForces.parts(policy.constants), fade=math.inf, alone_forward=0.0, lost=(0.0, 0.0))
        self.held: dict[int, float] = {}
        self.rival: dict[int, float] = {}

    def set(self, named: Any, **others: Any) -> None:
        """Take these constants."""
        self.c = SimpleNamespace(**others, **{name: value if len(value) > 1 else value[0] for name, value in named.items()})

    def decide(self, one: Any, noise: list[float]) -> tuple[Any, float]:
        """Head along the sum of the forces, at full speed."""
        c, reach = self.c, one.sensing_range
        self.here += complex(*one.moved)
        self.tick += 1
        self._update(one)
        held = {track[0]: self.held.get(track[0], 0.5) for track in self.target_tracks}
        self.held = held
        self.rival = {identity: self.rival[identity] for identity in held if identity in self.rival}
        tracks = [
            SimpleNamespace(
                identity=t[0], at=self._expected(t) / reach, step=t[3] / reach,
                age=self.tick - t[2], weight=math.exp(-(self.tick - t[2]) * c.decay**2),
            )
            for t in self.target_tracks
        ]  # fmt: skip
        lost = [t for t in tracks if t.age > 0]
        tracks = [t for t in tracks if t.weight >= 0.05]
        teammates = [complex(*teammate) / reach for teammate in one.teammates.offset.tolist()]
        for t in tracks:
            gaps = [abs(t.at - teammate) for teammate in teammates]
            t.rival = min([2.0, *gaps])
            t.rivals = sum(gap < 1 for gap in gaps)
            t.load = 0
            if t.rival < 2.0:
                rival = teammates[int(np.argmin(gaps))]
                t.load = sum(abs(o.at - rival) < 1 for o in tracks)
            t.rival = min(t.rival, self.rival.get(t.identity, math.inf) + c.fade)
            self.rival[t.identity] = t.rival
            advance = t.rival - abs(t.at) + c.bias + c.held * (held[t.identity] - 0.5)
            held[t.identity] = min(max(0.5 + advance / max(abs(c.margin), 1e-3), 0.0), 1.0)
            t.own = held[t.identity] * t.weight
        mine = sum(t.own for t in tracks)
        idle = max(0.0, 1 - mine)
        force = (idle * c.idle_forward + (1 - idle) * c.busy_forward) * complex(*one.heading)
        force += c.alone_forward * max(0.0, 1 - abs(mine - 1)) * complex(*one.heading)
        for t in lost:
            force += idle * c.lost[0] * math.exp(-t.age * c.lost[1] ** 2) * (2 * held[t.identity] - 1) * way(t.at)
        for t in tracks:
            d = abs(t.at)
            company = sum(o.own * max(0.0, 1 - abs(o.at - t.at) / 2) for o in tracks if o is not t)
            away = 10 * (t.at.conjugate() * t.step).real / d
            own = t.own * np.interp(d, [0, 0.4, 0.6, 0.8, 0.9, 1.0], c.law)
            own *= (1 + c.company * few(company)) * (1 + c.rivals * few(t.rivals)) * (1 + c.away * away)
            taken = idle * (c.idle_taken[0] + c.idle_taken[1] * t.rival + c.idle_taken[2] * few(t.load))
            taken += (1 - idle) * (c.busy_taken[0] + c.busy_taken[1] * t.rival)
            force += (own + (t.weight - t.own) * taken) * (t.at + c.lead * t.step) / d
        for teammate, distance in zip(teammates, one.teammates.distance.tolist(), strict=True):
            idle_force = np.interp(distance / one.awareness_range, [0, 0.5, 1], c.idle_teammate)
            force += (idle * idle_force + (1 - idle) * c.busy_teammate) * way(teammate)
        heading = way(force) if abs(force) > 1e-6 else complex(*one.heading)
        return (heading.real, heading.imag), one.speed


class AdaptiveForcesRobot(GroupForcesRobot):
    """One robot under forces that depend on what it met lately."""

    def __init__(self, policy: Any) -> None:
        super().__init__(GroupForces())
        self.named = AdaptiveForces.parts(policy.constants)
        self.seen = self.met = 0.0

    def decide(self, one: Any, noise: list[float]) -> tuple[Any, float]:
        """Take the constants of such a place, then head along the sum of the forces."""
        self.seen += 0.03 * (few(len(one.targets.distance)) - self.seen)
        self.met += 0.03 * (few(len(one.teammates.distance)) - self.met)
        names = [name for name in self.named if not name.startswith(("targets_", "teammates_"))]
        n = self.named
        self.set({name: n[name] + self.seen * n[f"targets_{name}"] + self.met * n[f"teammates_{name}"] for name in names})
        return super().decide(one, noise)
