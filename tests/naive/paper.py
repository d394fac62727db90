"""Slow twins of the kernels: each written like the sentence that describes it, one robot at a time, in plain Python."""

from __future__ import annotations

import math
from typing import Any

Vector = tuple[float, float]


def philox(counter: tuple[int, ...], key: tuple[int, int]) -> tuple[int, ...]:
    """Ten rounds of Philox 4×32 as printed by Salmon and others (2011)."""
    c, k = list(counter), list(key)
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * c[0], 2**32)
        high1, low1 = divmod(0xCD9E8D57 * c[2], 2**32)
        c = [high1 ^ c[1] ^ k[0], low1, high0 ^ c[3] ^ k[1], low0]
        k = [(k[0] + 0x9E3779B9) % 2**32, (k[1] + 0xBB67AE85) % 2**32]
    return tuple(c)


def uniform(key: tuple[int, int], stream: int, tick: int, member: int, channel: int) -> float:
    """The number of one agent, tick and channel."""
    word = philox((tick // 4, member, channel, stream), key)[tick % 4]
    return (word + 0.5) / 2**32


def shortest(way: Vector, period: Vector) -> Vector:
    """The shortest of the nine ways to a body and its images."""
    x, y = (min((part + k * side for k in (-1, 0, 1)), key=abs) for part, side in zip(way, period, strict=True))
    return x, y


def edges(
    observers: Any, observed: Any, reach: Any, period: Vector, own: bool, shape: str = "disc"
) -> list[tuple[int, int]]:
    """All transitions within range, without edges to oneself."""
    found = []
    for i, here in enumerate(observers):
        for j, there in enumerate(observed):
            x, y = shortest((there[0] - here[0], there[1] - here[1]), period)
            is_near = x * x + y * y <= reach[i] * reach[i] if shape == "disc" else max(abs(x), abs(y)) <= reach[i]
            if is_near and not (own and i == j):
                found.append((i, j))
    return found


def bounce_in_disc(place: Vector, step: Vector, heading: Vector, radius: float) -> tuple[Vector, Vector]:
    """Go straight to the wall, mirror what is left of the way, and the heading, in the tangent; go on."""
    z, way, face = complex(*place), complex(*step), complex(*heading)
    while abs(z + way) > radius:
        inside, outside = 0.0, 1.0
        for _ in range(80):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if abs(z + middle * way) <= radius else (inside, middle)
        z += inside * way
        normal = z / abs(z)
        way *= 1 - inside
        way -= 2 * (way * normal.conjugate()).real * normal
        face -= 2 * (face * normal.conjugate()).real * normal
    z += way
    return (z.real, z.imag), (face.real, face.imag)


def fold(place: float, half: float) -> tuple[float, float]:
    """Mirror a place in the wall that it lies behind until it lies inside; and whether the heading is reversed."""
    sign = 1.0
    while abs(place) > half:
        place = 2 * math.copysign(half, place) - place
        sign = -sign
    return place, sign


def turn(heading: Vector, aim: Vector, limit: float) -> Vector:
    """Turn towards the aim, the shorter way round, by at most the limit."""
    angle = math.remainder(math.atan2(aim[1], aim[0]) - math.atan2(heading[1], heading[0]), 2 * math.pi)
    angle = math.atan2(heading[1], heading[0]) + max(min(angle, limit), -limit)
    return math.cos(angle), math.sin(angle)


def repulsion(distance: float, d1: float, d2: float) -> float:
    """Fig. 9."""
    if distance < d1:
        return -1.0
    return (distance - d2) / (d2 - d1) if distance < d2 else 0.0


def attraction(distance: float, do1: float, do2: float, do3: float, predictive: float) -> float:
    """From −1 to 0 up to do1, to +1 up to do2, +1 up to do3, down to 0 at the predictive range."""
    if distance < do1:
        return -1 + distance / do1
    if distance < do2:
        return (distance - do1) / (do2 - do1)
    if distance <= do3:
        return 1.0
    return (predictive - distance) / (predictive - do3) if distance < predictive else 0.0


def weight(rule: str, target: Vector, teammates: list[Vector], reach: float, shared: float, loss: float) -> float:
    """The probability that no other robot already monitors the target."""
    if rule == "nearest":
        return 0.0 if any(math.dist(target, teammate) < math.hypot(*target) for teammate in teammates) else 1.0
    rivals = sum(math.dist(target, teammate) < reach for teammate in teammates)
    if rule == "shared":
        return shared if rivals else 1.0
    return max(1 - loss * rivals, 0.0) if rule == "per-teammate" else 1.0


def direction(number: float) -> Vector:
    return math.cos(2 * math.pi * number), math.sin(2 * math.pi * number)


def search(policy: Any, heading: Vector, noise: list[float], speed: float) -> tuple[Vector, float]:
    """What a robot does that has nothing to follow."""
    if policy.idle == "stay":
        return (0.0, 0.0), 0.0
    if policy.idle == "redraw" or noise[1] < policy.turn_probability:
        return direction(noise[0]), speed
    return heading, speed


def walk(policy: Any, one: Any, noise: list[float]) -> tuple[Vector, float]:
    """Go on, and turn with a probability to a new direction within the range of turns."""
    angle = math.atan2(one.heading[1], one.heading[0])
    if policy.turn_probability == 1 or noise[1] < policy.turn_probability:
        # A range of all directions is drawn as a direction, a smaller one as a turn.
        full = policy.turn_range == math.pi
        angle = 2 * math.pi * noise[0] if full else angle + policy.turn_range * (2 * noise[0] - 1)
    distance = one.speed * (noise[2] if policy.random_distance else 1.0)
    return (math.cos(angle), math.sin(angle)), distance


def centroid(policy: Any, one: Any, noise: list[float]) -> tuple[Vector, float]:
    """Go to the centre of the sensed targets, and stop there or go on at its speed."""
    seen = one.targets.offset.tolist()
    if not seen:
        return search(policy, tuple(one.heading), noise, one.speed)
    x, y = (sum(axis) / len(seen) for axis in zip(*seen, strict=True))
    length = math.hypot(x, y)
    return (x / length, y / length), length if policy.arrive else one.speed


def evade(policy: Any, one: Any, noise: list[float]) -> tuple[Vector, float]:
    """Flee along the sum of the unit vectors away from all robots, each over its distance."""
    seen = list(zip(one.targets.offset.tolist(), one.targets.distance.tolist(), strict=True))
    x, y = (-sum(offset[axis] / d / d for offset, d in seen) for axis in (0, 1))
    if not seen:
        if noise[1] < policy.turn_probability:
            return direction(noise[0]), one.speed
        return tuple(one.heading), one.speed
    return (x / math.hypot(x, y), y / math.hypot(x, y)), one.speed


def sector(offset: Vector, heading: Vector, sectors: int) -> int:
    """The sector of a bearing: sector 0 is centred straight ahead, and they go anticlockwise."""
    bearing = math.atan2(offset[1], offset[0]) - math.atan2(heading[1], heading[0])
    return math.floor(bearing / (2 * math.pi / sectors) + 0.5) % sectors


def ring(seen: list[Vector], heading: Vector, sectors: int, reach: float) -> list[float]:
    """For each sector the distance to the nearest body over the range; 1 where there is none."""
    readings = [1.0] * sectors
    for offset in seen:
        k = sector(offset, heading, sectors)
        readings[k] = min(readings[k], math.hypot(*offset) / reach)
    return readings


def nearest(teammates: list[Vector], delta: int) -> list[Vector]:
    """The nearest so many, the nearest first."""
    return sorted(teammates, key=lambda offset: math.hypot(*offset))[:delta]


def ring_view(teammates: list[Vector], heading: Vector, sectors: int) -> list[Vector]:
    """What the ring shows: for each sector in turn the nearest teammate's distance, in the direction of its centre."""
    ahead, shown = math.atan2(heading[1], heading[0]), []
    for k in range(sectors):
        inside = [math.hypot(*teammate) for teammate in teammates if sector(teammate, heading, sectors) == k]
        if inside:
            angle = ahead + 2 * math.pi * k / sectors
            shown.append((min(inside) * math.cos(angle), min(inside) * math.sin(angle)))
    return shown


class ACmommtRobot:
    """One robot under A-CMOMMT. It keeps where it believes itself to be and where it last knew each target to be."""

    def __init__(self, policy: Any) -> None:
        self.policy = policy
        self.here = 0j
        self.tick = 0
        # [identity, last known place, when, displacement a step, whether it was relayed], oldest track first
        self.target_tracks: list[list[Any]] = []

    def _expected(self, track: list[Any]) -> complex:
        return track[1] + (self.tick - track[2]) * track[3] - self.here

    def _know(self, identity: int, offset: complex, relayed: bool) -> None:
        place = self.here + offset
        for track in self.target_tracks:
            if track[0] == identity:
                track[1:] = [place, self.tick, (place - track[1]) / (self.tick - track[2]), relayed]
                return
        if len(self.target_tracks) < self.policy.target_tracks:
            self.target_tracks.append([identity, place, self.tick, 0j, relayed])

    def _update(self, one: Any) -> None:
        policy, reach = self.policy, one.sensing_range
        farthest = one.awareness_range + reach if len(one.relayed.identity) else policy.predictive * reach
        seen = set(one.targets.identity.tolist())
        for track in list(self.target_tracks):
            distance, age = abs(self._expected(track)), self.tick - track[2]
            lost = track[0] not in seen
            if lost and (
                distance <= reach or distance >= farthest or age > 5 * max(policy.decay, policy.relayed_decay)
            ):
                self.target_tracks.remove(track)
        for identity, (x, y) in zip(one.targets.identity.tolist(), one.targets.offset.tolist(), strict=True):
            self._know(identity, complex(x, y), False)
        for identity, (x, y) in zip(one.relayed.identity.tolist(), one.relayed.offset.tolist(), strict=True):
            if not any(track[0] == identity and track[2] == self.tick for track in self.target_tracks):
                self._know(identity, complex(x, y), True)

    def _pull(self, target: Vector, teammates: list[Vector], reach: float) -> complex:
        p = self.policy
        distance = math.hypot(*target)
        if not distance:
            return 0j
        force = attraction(distance / reach, p.do1, p.do2, p.do3, p.predictive)
        return (
            force
            * weight(p.weights, target, teammates, reach, p.shared_weight, p.teammate_loss)
            * complex(*target)
            / distance
        )

    def _share(self, identity: int) -> float:
        """The factor on the force of a target; that of P-CMOMMT."""
        return 1.0

    def decide(self, one: Any, noise: list[float]) -> tuple[Vector, float]:
        """Head along the sum of the forces, and go min(gain · |F|, 1) times the speed."""
        p, reach = self.policy, one.sensing_range
        self.here += complex(*one.moved)
        self.tick += 1
        if p.target_tracks:
            self._update(one)
        teammates = [tuple(teammate) for teammate in one.teammates.offset.tolist()]
        scale = reach if p.repulsion_scale == "sensing" else one.awareness_range
        force = sum(
            repulsion(math.hypot(*teammate) / scale, p.dr1, p.dr2) * complex(*teammate) / math.hypot(*teammate) for teammate in teammates
        )
        for identity, target in zip(one.targets.identity.tolist(), one.targets.offset.tolist(), strict=True):
            force += self._share(identity) * self._pull(tuple(target), teammates, reach)
        lost = [track for track in self.target_tracks if track[2] < self.tick or track[4]]
        for track in lost:
            place = self._expected(track)
            exists = math.exp(-(self.tick - track[2]) / (p.relayed_decay if track[4] else p.decay))
            force += self._share(track[0]) * exists * self._pull((place.real, place.imag), teammates, reach)
        if abs(force) > 1e-9:
            return (force.real / abs(force), force.imag / abs(force)), min(p.gain * abs(force), 1.0) * one.speed
        if p.idle_when == "no-force" or not (teammates or lost or len(one.targets.identity)):
            return search(p, tuple(one.heading), noise, one.speed)
        return (0.0, 0.0), 0.0
