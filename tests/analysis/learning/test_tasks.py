"""Exploring a task, and the learning curve of a task whose team learns."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from toy_tasks import GATHER, SOON

from teamsight.agents.awareness import NoAwareness, RingAwareness
from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.plans import Training
from teamsight.analysis.learning.training import awareness_gain, learning_curve


def test_exploring_cmommt_as_a_task_gives_the_same_transitions() -> None:
    given = {"steps": 10, "runs": 2, "seed": 4, "awareness": RingAwareness(8)}
    scenario = {"robots": 4, "targets": 6, "radius": 2.0}
    plain = explore(Exploration(world={**scenario, "policy": "random-walk"}, **given))  # type: ignore[arg-type]
    task = explore(Exploration(task="cmommt", world=scenario, **given))  # type: ignore[arg-type]
    assert len(task) == 80
    for name in ("situation", "action", "next_situation"):
        np.testing.assert_array_equal(getattr(task, name), getattr(plain, name))
    assert task.settings["task"] == "cmommt"
    assert task.settings["scenario"]["radius"] == 2.0


def test_exploring_another_task_records_its_team() -> None:
    plan = Exploration(task=GATHER, world={"walkers": 3}, steps=7)
    assert (plan.robots, plan.transitions, len(explore(plan))) == (3, 21, 21)
    with pytest.raises(ValueError, match="wakers: is no parameter of the task gather; did you mean 'walkers'"):
        Exploration(task=GATHER, world={"wakers": 3})
    with pytest.raises(ValueError, match="the task gather has no exploration treatment"):
        Exploration(task=replace(GATHER, explore=None), steps=5)


SHORT = Training(trainings=2, runs=3, steps=40, seed=1)


def learns(scenario: Any, awareness: Any, rng: int, steps: int = 10) -> dict[str, Any]:
    """Learn the way in ten steps, unless something is known of teammates: then nothing is learned before twenty."""
    return {"policy": "centroid" if steps >= (10 if awareness == NoAwareness() else 20) else "stationary"}


def test_the_curve_shows_when_awareness_pays() -> None:
    task = replace(GATHER, skilled=learns)
    curve = learning_curve(task, replace(SHORT, learned=(0, 10, 20), awareness=("none", RingAwareness(4))))
    assert len(curve) == 3 * 2 * 2 * 3
    assert (curve.groupby("replicate")["seed"].nunique() == 1).all()
    gain = awareness_gain(task, curve, "NoAwareness()").set_index("learned")["gain"]
    assert gain[0] == gain[20] == 0.0
    assert gain[10] < 0
    # Where less is better, the sign is the other way round.
    slow = replace(SOON, skilled=learns)
    later = learning_curve(slow, replace(SHORT, learned=(10,), awareness=("none", "ring")))
    assert awareness_gain(slow, later, "NoAwareness()")["gain"].item() < 0


def test_a_team_that_does_not_learn_has_no_curve() -> None:
    with pytest.raises(ValueError, match=r"task='gather': its team does not learn; .*pursuit.* a function"):
        learning_curve(GATHER)
    curve = learning_curve(replace(GATHER, skilled=learns), Training(learned=(1,), awareness=("none",), trainings=1, runs=1, steps=5))
    with pytest.raises(ValueError, match=r"base='None': unknown; .*NoAwareness\(\)"):
        awareness_gain(GATHER, curve, "None")
