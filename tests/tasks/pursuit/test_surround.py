"""Surround: who may stand where, who captures, and what follows, step by step."""

from __future__ import annotations

import numpy as np
import pytest

from teamsight import check_interaction
from teamsight.policies import LatticeWalk
from teamsight.tasks.pursuit import Pursuit, Surround

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


def _shared(world: Pursuit) -> int:
    """The number of pairs of an active hunter and an active prey in one cell."""
    hunters, prey = (group.position[group.bodies.active] for group in (world.hunters, world.prey))
    return int((hunters[:, None] == prey[None]).all(axis=-1).sum())


@pytest.mark.parametrize("torus", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_no_hunter_shares_a_cell_with_any_of_several_prey(seed: int, torus: bool) -> None:
    walk = LatticeWalk(5)
    world = Pursuit(6, 5, 5, depth=1, rule="surround", torus=torus, policy=walk, prey_policy=walk, rng=seed)
    # Bodies that are put back are where they were, which is where others may have gone.
    put_back = 0
    for _ in range(600):
        before, shared = [group.position.copy() for group in (world.hunters, world.prey)], _shared(world)
        world.step()
        if world.recording.history.iloc[-1]["trial_steps"] == 0:
            continue
        assert _shared(world) <= shared
        put_back += sum(
            int((group.position == old).all(axis=1).sum())
            for group, old in zip((world.hunters, world.prey), before, strict=True)
        )
    assert put_back > 100


@pytest.mark.parametrize("rule", ["alone", "pair", "surround"])
def test_inactive_bodies_stay_where_they_are(rule: str) -> None:
    world = Pursuit(8, 3, 4, depth=1, rule=rule, torus=True, rng=1)
    begun = 0
    for step in range(300):
        who = world.hunters[step % 8] if step % 2 else world.prey[step % 3]
        who.active = False
        place = who.position.copy()
        world.step()
        begun += world.recording.history.iloc[-1]["trial_steps"] == 0
        assert (who.position == place).all()
        who.active = True
    assert begun > 5


def test_contract() -> None:
    check_interaction(Surround(10, 10))
