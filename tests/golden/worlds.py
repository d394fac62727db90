"""The worlds of the golden file: each feature once, small enough that all of them run in a minute."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
from interactions import Capture, CaptureInTurn, hunt

from teamsight import (
    CMOMMT,
    Box,
    Car,
    Circle,
    DifferentialDrive,
    Disc,
    Lidar,
    Polygon,
    Robot,
    Sensor,
    Target,
    Torus,
    World,
)
from teamsight.agents.awareness import (
    NearestAwareness,
    PairwiseAwareness,
    RelayedAwareness,
    RingAwareness,
    SharedAwareness,
)
from teamsight.agents.components import (
    Arrivals,
    Batteries,
    ChargingPlaces,
    Departures,
    Failures,
    SensorDropouts,
    UnreliableAwareness,
    Weibull,
)
from teamsight.agents.decisions import Cycle
from teamsight.agents.recording.explore import explore
from teamsight.core.kernel import inlined
from teamsight.policies import (
    ACmommt,
    Action,
    Avoiding,
    Centroid,
    CompiledPolicy,
    Evolved,
    LazyQ,
    LazyRegression,
    PessimisticLazyQ,
    Policy,
    PreyQ,
    RandomWalk,
    SeekCharger,
    SheppardLazyQ,
    go,
)
from teamsight.policies.eager import LinearQ, TabularQ
from teamsight.policies.memory import LazyMemory
from teamsight.policies.rewards import team_reward
from teamsight.tasks import TASKS
from teamsight.tasks.foraging import Forage
from teamsight.tasks.pursuit import Pursuit

# Steps for which a team learns, instead of some hundred thousand.
_LEARNING = 200


class Mixed(World):
    """Two groups of robots, two of targets; deer see the fast robots."""

    def __init__(
        self, arena: Any = None, policy: Any = "a-cmommt", awareness: Any = "shared",
        sensors: Mapping[str, Sensor] | None = None, *, rng: Any = None, **options: Any,
    ) -> None:  # fmt: skip
        super().__init__(arena or Disc(2.0), rng=rng)
        sensors = sensors or {}
        fast = self.add(Robot, 6, policy=policy, awareness=awareness, speed=0.1, name="fast", **options)
        slow = self.add(Robot, 3, policy=Centroid(), awareness=awareness, awareness_range=[0.5, 1.0, 1.8], name="slow")
        deer = self.add(Target, 5, policy="evasive", speed=0.08, sensing_range=0.7, name="deer")
        flies = self.add(Target, 9, policy="random-walk", name="flies")
        for robots in (fast, slow):
            self.senses(robots, deer, sensor=sensors.get("targets"))
            self.senses(robots, flies)
            self.senses(robots, deer, as_="large", sensor=sensors.get("large"))
            if "teammates" in sensors:
                robots.sensors["teammates"] = sensors["teammates"]
        self.senses(deer, fast)


class Attended(World):
    """Robots to which event sources are attached."""

    def __init__(self, sources: Callable[[], list[Any]], *, rng: Any = None) -> None:
        super().__init__(Disc(2.5), rng=rng)
        team = self.add(Robot, 7, policy="a-cmommt", awareness="shared")
        self.senses(team, self.add(Target, 6, policy="random-walk", speed=0.075))
        for source in sources():
            self.attach(source, team)


class Straight(Policy):
    """A policy in NumPy that counts its decisions."""

    draws = 1

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        return Action(percept.heading, percept.speed * noise[0]), memory + 1


def wander(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    """Turn at random; a function for one robot."""
    return float(rng.normal(0.0, 0.3)), percept.speed


class Slow(Robot):
    """A robot that goes half as far as its policy says."""

    def decide(self, percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        return turn, distance / 2


def several(*, rng: Any) -> World:
    """A world of groups whose classes, policies and degrees differ, one of them in Python."""
    world = World(Box(4.0, 3.0), rng=rng)
    teams = [
        world.add(Slow, 3, policy="a-cmommt", awareness="pairwise"), world.add(Robot, 2, policy=Straight()),
        world.add(Robot, 2, policy=wander, awareness=NearestAwareness(2)),
    ]  # fmt: skip
    herd = world.add(Target, 6, policy=RandomWalk(0.1))
    for team in teams:
        world.senses(team, herd)
    teams[0].add_column("battery", 1.0)
    world.recording.record_positions(every=3)
    return world


@cache
def memory(degree: Any = "ring") -> LazyMemory:
    """Return what a short exploration leaves."""
    policy = RandomWalk(random_distance=True)
    return explore(CMOMMT(robots=5, targets=10, radius=2.5, policy=policy, awareness=degree, rng=1), 60)


def learned(make: Callable[[], Any], degree: Any, *, rng: Any) -> World:
    """Return a world whose robots have a learned policy."""
    return CMOMMT(robots=5, targets=8, radius=2.0, policy=make(), awareness=degree, rng=rng)


@cache
def team(name: str, treatment: str) -> dict[str, Any]:
    """Return the parameters of a task's team, whose learning is cut short."""
    task: Any = TASKS[name]
    if treatment == "skilled" and callable(task.skilled):
        task = replace(task, skilled=partial(task.skilled, steps=_LEARNING))
    found: dict[str, Any] = task.parameters(treatment)
    return found


_WIDE = 2.0944
_BLOCKED = Box(4.0, 4.0).with_obstacles(Circle((0.5, 0.5), 0.4), Polygon([(-1.5, -1), (-0.5, -1), (-1, 0)]))
_SENSORS = {
    "view": Sensor(field_of_view=_WIDE), "range": Sensor(range_noise=0.1), "bearing": Sensor(bearing_noise=0.2),
    "missed": Sensor(missed=0.3), "false": Sensor(false_positives=0.4), "delay": Sensor(delay=3),
    "all": Sensor(_WIDE, 0.1, 0.2, 0.2, 0.3, 2),
}  # fmt: skip
_CMOMMT: dict[str, dict[str, Any]] = {
    "the default": {}, "pairwise": {"policy": "a-cmommt", "awareness": "pairwise"},
    "shared, evasive targets": {
        "policy": "a-cmommt", "awareness": "shared", "target_policy": "evasive", "policy_options": {"idle": "wander"}
    },
    "ring of 8": {"policy": "a-cmommt", "awareness": "ring", "delta": 8, "uniform_target_speed": True},
    "nearest": {"policy": "a-cmommt", "awareness": "nearest", "delta": 2},
    "relayed, all hops": {"policy": "a-cmommt", "awareness": "relayed", "radius": 3.0},
    "relayed, late and lossy": {"policy": "b-cmommt", "awareness": RelayedAwareness(3, 2, 0.2), "radius": 3.0},
    "the paper's preset": {"policy": "a-cmommt", "awareness": "none", "preset": "touzet2000"},
    "centroid": {"policy": "centroid", "awareness": "none", "target_policy": "stationary"},
    "random walk, crowded": {"policy": "random-walk", "robots": 100, "targets": 70},
    "nobody moves": {"policy": "stationary", "robots": 3, "awareness": "none"},
    "evolved": {"policy": "evolved", "awareness": "ring"}, "evolved, pairwise": {"policy": Evolved(), "awareness": "pairwise"},
    "group forces": {"policy": "group-forces", "awareness": "ring"},
    "adaptive forces": {"policy": "adaptive-forces", "awareness": "ring"},
    "lazy, collective": {"policy": "lazy-collective", "awareness": "none"},
    "lazy, cooperative": {"policy": "lazy-cooperative", "awareness": "ring"},
    "sensor": {"policy": "a-cmommt", "awareness": "pairwise", "sensor": Sensor(2.0, 0.1, delay=2)},
    "sensor that errs": {"policy": "centroid", "awareness": "none", "sensor": Sensor(missed=0.2, false_positives=0.1)},
    "learns while it runs": {"policy": SheppardLazyQ(inputs=32, capacity=30), "awareness": RingAwareness(16)},
    "cycle": {"policy": "a-cmommt", "cycle": Cycle(3)}, "fails": {"policy": "a-cmommt", "events": Failures(20, 10)},
    "fails and empties": {"events": [Failures(20, 10), Batteries(0.9, per_tick=0.02)]},
    "weighs by teammate": {"policy": ACmommt(weights="per-teammate", idle="wander"), "awareness": "shared"},
    "tracks no targets": {"policy": ACmommt(target_tracks=0), "awareness": "shared"},
    "stays when nothing is sensed": {"policy": ACmommt(idle_when="nothing-sensed", repulsion_scale="awareness")},
    "square ranges": {"policy": "a-cmommt", "awareness": "shared", "range_shape": "square"},
    "evenness": {"policy": "p-cmommt", "policy_options": {"evenness": 0.6}},
    "differential drive": {"drive": DifferentialDrive(0.1, 0.02)}, "car": {"drive": Car(0.1, 0.6, 0.2, 0.02), "policy": "evolved"},
    "lidar": {"robots": 12, "radius": 2.0, "robot_radius": 0.15, "target_radius": 0.1, "lidar": Lidar(16, 1.5)},
    "bodies that slide": {"robots": 12, "radius": 2.0, "robot_radius": 0.15, "target_radius": 0.1, "contact": "slide"},
}  # fmt: skip
_MIXED: dict[str, dict[str, Any]] = {
    "torus": {"arena": Torus(4.0, 5.0)}, "obstacles": {"arena": _BLOCKED}, "small disc": {"arena": Disc(0.05)},
    "cells": {"arena": Torus(30.0, 30.0)}, "ring of 5": {"awareness": RingAwareness(5)},
    "turn limits": {"turn_limit": [0.0, 0.1, 1.0, 3.0, 4.0, 0.5], "awareness": "ring"},
    "cycles with jitter": {"cycle": Cycle([3, 4, 5, 6, 7, 8.5], phase="random", jitter=1, delay=1)},
    "square": {"range_shape": "square", "awareness": NearestAwareness(2)},
    **{f"sensor: {name}": {"sensors": {"targets": one}} for name, one in _SENSORS.items()},
    "sensor of teammates": {"sensors": {"teammates": _SENSORS["all"]}, "awareness": "pairwise"},
    "sensor of a channel behind obstacles": {"sensors": {"large": _SENSORS["view"]}, "arena": _BLOCKED},
}  # fmt: skip
_SOURCES: dict[str, Callable[[], list[Any]]] = {
    "failures": lambda: [Failures(25, Weibull(6, 2)), Failures(60, 10)], "batteries": lambda: [Batteries(2.0, 0.5, per_tick=0.05)],
    "charging": lambda: [
        Batteries(2.0, 0.5, per_tick=0.05, low_level=1.2),
        ChargingPlaces([(0, 0), (1, 1)], rate=0.2, radius=0.4, policy=SeekCharger()),
    ],
    "arrivals and departures": lambda: [Arrivals(9.0, 40.0, most=12), Departures(50.0)],
    "sensor dropouts": lambda: [SensorDropouts(20, 5), SensorDropouts(30, 8, "targets")],
    "unreliable awareness": lambda: [UnreliableAwareness(2, 0.2, begins=5, ends=40)],
}  # fmt: skip
_TOGETHER = [make for name, make in _SOURCES.items() if name != "batteries"]
_SOURCES["all of these"] = lambda: [source for make in _TOGETHER for source in make()]
_LEARNED: dict[str, tuple[Callable[[], Any], Any]] = {
    "lazy Q": (lambda: LazyQ(memory()), RingAwareness()),
    "lazy Q of the team": (lambda: LazyQ(memory(), team_reward, k=3, discount=0.9, sweeps=30), RingAwareness()),
    "lazy Q, pairwise": (lambda: LazyQ(memory("pairwise")), PairwiseAwareness()),
    "lazy regression": (lambda: LazyRegression(memory()), RingAwareness()),
    "lazy regression, pairwise": (lambda: LazyRegression(memory("pairwise"), significance=0), PairwiseAwareness()),
    "lazy Q, shared": (lambda: LazyQ(memory("shared")), SharedAwareness()),
    "pessimistic lazy Q": (lambda: PessimisticLazyQ(memory()), RingAwareness()),
    "linear Q": (lambda: LinearQ(memory(), sweeps=1), RingAwareness()), "tabular Q": (lambda: TabularQ(memory(), sweeps=2), RingAwareness()),
}  # fmt: skip

#: A function of the seed by name. Those of `RUNS` are given as a model and its parameters, so that built worlds are reused.
RUNS: dict[str, tuple[Callable[..., World], Callable[[], Mapping[str, Any]]]] = {
    **{f"CMOMMT: {name}": (CMOMMT, partial(dict, given)) for name, given in _CMOMMT.items()},
    **{
        f"task: {name}, {treatment}": (TASKS[name].world, partial(team, name, treatment))
        for name in TASKS
        for treatment in ("explore", "skilled")
    },
    "task: learns while it hunts": (Pursuit, lambda: {"policy": PreyQ(4), "prey": 2}),
    "task: on a torus": (Pursuit, lambda: {"policy": PreyQ(2, partner=2), "awareness": "pairwise", "depth": 2, "torus": True}),
    "task: scouts": (Pursuit, lambda: {"scouts": 2, "awareness": RingAwareness(4)}),
    "task: nobody communicates": (Forage, lambda: {"communication": "none", "awareness": "none", "obstacles": 0.0}),
}
WORLDS: dict[str, Callable[..., World]] = {
    **{f"mixed: {name}": partial(Mixed, **given) for name, given in _MIXED.items()},
    **{f"events: {name}": partial(Attended, sources) for name, sources in _SOURCES.items()},
    **{f"learned: {name}": partial(learned, make, degree) for name, (make, degree) in _LEARNED.items()},
    "several classes, some in Python": several,
    "interaction": lambda rng: hunt(Capture(), rng), "interaction in turn": lambda rng: hunt(CaptureInTurn(), rng),
    "interaction that fails": lambda rng: failing(rng=rng),
    "bodies that stop, come and fail": lambda rng: crowd(rng=rng),
    "bodies that avoid each other": lambda rng: crowd(Avoiding("a-cmommt", targets=True), rng=rng),
    "a lidar": lambda rng: steered_by_rays(rng=rng),
    "bodies that move in turn": lambda rng: hunt(CaptureInTurn(), rng, contact="slide", radius=0.2, prey_radius=0.3),
}  # fmt: skip


def crowd(policy: Any = "a-cmommt", *, rng: Any) -> World:
    """Return a world of bodies of several sizes between obstacles, of which some fail, and others come and leave."""
    world = World(_BLOCKED, contact="stop", rng=rng)
    robots = world.add(Robot, 8, policy=policy, awareness="shared", radius=0.1, speed=0.15)
    targets = world.add(Target, 9, policy="random-walk", radius=[0.05, 0.1, 0.0] * 3)
    world.senses(robots, targets)
    world.attach(Failures(15, 5), robots)
    world.attach(Arrivals(9.0, 40.0, most=12), robots)
    return world


@inlined
def _turn_from_near(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        turn, rays = 0.0, percept.lidar.shape[1]
        for j in range(rays):
            turn += percept.lidar[i, j] * (2 * j + 1 - rays)
        x, y = percept.heading[i, 0], percept.heading[i, 1]
        go(action, i, x - 0.02 * turn * y, y + 0.02 * turn * x, min(percept.speed[i], percept.lidar[i, rays // 2]))


@dataclass(frozen=True)
class TurnFromNear(CompiledPolicy):
    """Turn to the side where more is free."""

    rays: int = 11
    kernel = _turn_from_near


def steered_by_rays(*, rng: Any) -> World:
    """Return a world of robots that steer by a lidar with noise between obstacles on a torus, of which some fail."""
    arena = Torus(6.0, 5.0).with_obstacles(Circle((2.7, 0.5), 0.6), Polygon([(-1.5, -1), (-0.5, -1), (-1, 0)]))
    world = World(arena, contact="slide", rng=rng)
    lidar = Lidar(11, 1.5, 4.0, range_noise=0.02)
    robots = world.add(Robot, 9, policy=TurnFromNear(), radius=0.1, lidar=lidar, speed=0.15)
    world.senses(robots, world.add(Target, 5, policy="random-walk", radius=[0.05, 0.1, 0.0, 0.3, 0.1]))
    world.attach(Failures(15, 5), robots)
    return world


def failing(*, rng: Any) -> World:
    """Return a world with an interaction and with hunters that fail."""
    world = hunt(Capture(reach=0.8), rng, awareness="ring")
    world.attach(Failures(15, 5), world.groups[0])
    return world
