"""Worlds unlike those of the evolution: each differs in one respect, and both policies meet the same ones."""

from __future__ import annotations

import math

import pytest

from teamsight import CMOMMT, Box
from teamsight.agents.awareness import NoAwareness
from teamsight.analysis.evolution import generalise
from teamsight.analysis.evolution.generalise import VARIATIONS, Variation, boxed
from teamsight.policies import Stationary
from teamsight.policies.evolved import Evolved

OPTIONS = {"idle": "wander", "gain": 2.0}


@pytest.mark.parametrize("ratio", [1.0, 4.0])
def test_a_box_has_the_area_of_the_disc_and_the_agents_of_the_model(ratio: float) -> None:
    parts = {"robots": 3, "targets": 4, "radius": 2.0, "policy": Stationary(), "awareness": NoAwareness()}
    world, model = boxed(ratio=ratio, **parts, rng=1), CMOMMT(**parts, rng=1)
    assert isinstance(world.arena, Box)
    assert world.arena.width * world.arena.height == pytest.approx(math.pi * 2.0**2)
    assert world.arena.width / world.arena.height == pytest.approx(ratio)
    for ours, theirs in zip(world.groups, model.groups, strict=True):
        assert (len(ours), ours.policy, ours.awareness) == (len(theirs), theirs.policy, theirs.awareness)
        assert ours.bodies.speed.tolist() == theirs.bodies.speed.tolist()
        assert ours.sensing_range.tolist() == theirs.sensing_range.tolist()
        assert ours.awareness_range.tolist() == theirs.awareness_range.tolist()
    world.run(3)
    assert world.observed_fraction > 0


def test_every_variation_can_be_run_and_the_first_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generalise, "STEPS", 2)
    table = generalise.generalise(Evolved(), OPTIONS, runs=2)
    assert table["name"].tolist() == [one.name for one in VARIATIONS]
    assert VARIATIONS[0] == Variation("nothing")
    assert ((table["low"] <= table["mean"]) & (table["mean"] <= table["high"])).all()


def test_the_gain_is_paired_by_the_world(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generalise, "VARIATIONS", (Variation("x", {"robot_speed": 0.0}, (4,), (2.0,)),))
    monkeypatch.setattr(generalise, "STEPS", 20)
    (row,) = generalise.generalise(Evolved(), OPTIONS, runs=3).to_dict("records")
    # Robots that cannot move observe the same under every policy.
    assert (row["mean"], row["low"], row["high"]) == (0.0, 0.0, 0.0)
    assert 0 < row["observed"] < 100
