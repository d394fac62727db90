"""Surround prey decides like its slow twin, shares the sides, and captures; with less awareness it takes longer."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import pytest

from teamsight import TASKS, check_policy, check_task
from teamsight.agents.awareness import NearestAwareness
from teamsight.policies import Policy, SurroundPrey
from teamsight.policies.percept_of_one import percept_of_one
from teamsight.tasks.pursuit import Pursuit

SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))
Cell = tuple[int, int]


def moves_to(start: Cell, goal: Cell, closed: Cell) -> float:
    """The length of the shortest way on the grid around one closed cell, by searching in all directions."""
    seen, waiting = {start: 0}, deque([start])
    while waiting and start != closed:
        at = waiting.popleft()
        if at == goal:
            return seen[at]
        for x, y in SIDES:
            to = at[0] + x, at[1] + y
            if to != closed and to not in seen and max(map(abs, to)) < 25:
                seen[to] = seen[at] + 1
                waiting.append(to)
    return np.inf


def own_side(prey: Cell, teammates: list[Cell], is_first: bool) -> int | None:
    """All hunters claim sides in order of their distance and place, each side once; which is that of the robot?"""
    places = [(-prey[0], -prey[1])] + [(x - prey[0], y - prey[1]) for x, y in teammates]
    hunters = dict(enumerate(places))
    free = dict(enumerate(SIDES))
    while free and hunters:
        claims = [
            (min(abs(x - a) + abs(y - b) for a, b in free.values()), (x, y), (number == 0) != is_first, number)
            for number, (x, y) in hunters.items()
        ]
        far, (x, y), _, number = min(claims)
        side = next(at for at, (a, b) in free.items() if abs(x - a) + abs(y - b) == far)
        if number == 0:
            return side
        del hunters[number], free[side]
    return None


def expected(one: Any, noise: list[float]) -> tuple[tuple[float, float], float]:
    def cell(offset: Any) -> Cell:
        return round(float(offset[0])), round(float(offset[1]))

    move = int(noise[1] * 4)
    near = [k for k in range(len(one.targets.distance)) if one.targets.distance[k] == min(one.targets.distance)]
    if near:
        prey = cell(one.targets.offset[near[int(noise[0] * len(near))]])
        side = own_side(prey, [cell(offset) for offset in one.teammates.offset], noise[2] < 0.5)
        if side is not None:
            goal = prey[0] + SIDES[side][0], prey[1] + SIDES[side][1]
            if goal == (0, 0):
                return (0.0, 0.0), 0.0
            ways = [moves_to(to, goal, prey) for to in SIDES]
            best = [number for number, way in enumerate(ways) if way == min(ways)]
            move = best[int(noise[1] * len(best))]
    x, y = SIDES[move]
    return (float(x), float(y)), 1.0


class Watched(Policy):
    """Decides as the compiled policy, and compares it with its slow twin."""

    draws = SurroundPrey.draws

    def __init__(self) -> None:
        self.policy = SurroundPrey()
        self.stays = self.walks = 0

    def start(self, size: int) -> Any:
        return self.policy.start(size)

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        action, state = self.policy.decide(percept, state, noise)
        for i in range(len(percept.heading)):
            heading, distance = expected(percept_of_one(percept, i), noise[:, i].tolist())
            assert (tuple(action.heading[i].tolist()), action.distance[i]) == (heading, distance), (percept.time[0], i)
            self.stays += distance == 0
            self.walks += distance == 1
        return action, state


WORLDS: list[dict[str, Any]] = [
    {"hunters": 4, "side": 12, "depth": 3},
    {"hunters": 7, "side": 9, "depth": 4, "awareness": NearestAwareness(2)},
    {"hunters": 3, "side": 8, "depth": 2, "awareness": "none", "torus": False},
    {"hunters": 9, "prey": 3, "side": 10, "depth": 4, "teammate_depth": 2},
]


@pytest.mark.parametrize("world", WORLDS, ids=str)
def test_it_is_its_slow_twin(world: dict[str, Any]) -> None:
    watched = Watched()
    plan = {"prey": 1, "rule": "surround", "torus": True, "awareness": "pairwise", **world}
    Pursuit(**plan, policy=watched, rng=8).run(300)
    assert watched.stays > 0
    assert watched.walks > 0


def test_both_paths_are_equal() -> None:
    task = TASKS["surround"]
    one, two = task.build("skilled", rng=3, hunters=6), task.build("skilled", rng=3, hunters=6)
    one.run(200)
    for _ in range(200):
        two.step()
    assert np.array_equal(one.recording.history, two.recording.history)
    assert np.array_equal(one.hunters.position, two.hunters.position)


def test_hunters_that_see_each_other_share_the_sides() -> None:
    # Each of four takes another side, wherever they stand: no seed is lucky.
    rng = np.random.default_rng(4)
    for _ in range(200):
        places = {tuple(rng.integers(-3, 4, 2).tolist()) for _ in range(6)} - {(0, 0)}
        hunters = sorted(places)[:4]
        taken = [
            own_side((-x, -y), [(a - x, b - y) for a, b in hunters if (a, b) != (x, y)], True) for x, y in hunters
        ]
        assert len(set(taken)) == len(hunters)


def test_awareness_shortens_the_trials() -> None:
    task = TASKS["surround"]
    ended = {}
    for delta in (None, 1, 3):
        awareness = "none" if delta is None else NearestAwareness(delta)
        world = task.build("skilled", rng=2, awareness=awareness)
        world.run(20_000)
        ended[delta] = task.measure(world)["captures"]
    # Captures are rare and nearly independent, so that a share of two is many standard errors.
    assert ended[None] * 2 < ended[1]
    assert ended[1] * 1.5 < ended[3]


def test_contracts() -> None:
    check_policy(SurroundPrey())
    check_task(TASKS["surround"])
