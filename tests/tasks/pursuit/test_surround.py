"""Surround: who may stand where, who captures, and what follows, step by step."""

from __future__ import annotations

import numpy as np

from teamsight import check_interaction
from teamsight.policies import LatticeWalk
from teamsight.tasks.pursuit.surround import Surround
from teamsight.tasks.pursuit.world import Pursuit

SIDE = 3


def _sides(world: Pursuit) -> set[tuple[int, int]]:
    gaps = world.hunters.position - world.prey.position[0]
    gaps -= SIDE * np.rint(gaps / SIDE)
    return {tuple(gap) for gap in gaps.astype(int).tolist()}


def test_four_hunters_on_its_sides_capture_the_prey() -> None:
    walk = LatticeWalk(5)
    world = Pursuit(6, 1, SIDE, depth=1, rule="surround", torus=True, policy=walk, prey_policy=walk, rng=6)
    all_sides = {(1, 0), (-1, 0), (0, 1), (0, -1)}
    captured = moved = 0
    for _ in range(400):
        began_apart, before = (0, 0) not in _sides(world), world.prey.position.copy()
        world.step()
        row = world.recording.history.iloc[-1]
        if row["trial_steps"] == 0:
            continue
        sides = _sides(world)
        assert (row["captures"] == 1) == (all_sides <= sides)
        if began_apart:
            assert (0, 0) not in sides, "a hunter and the prey share a cell"
        percept = world.hunters.percept
        assert set(percept.reward.tolist()) == {1.0 if row["captures"] else -0.1}
        assert set(percept.ended.tolist()) == {bool(row["captures"])}
        captured += int(row["captures"])
        moved += not np.array_equal(before, world.prey.position)
    assert captured > 10
    assert moved > 10


def test_contract() -> None:
    check_interaction(Surround(10, 10))
