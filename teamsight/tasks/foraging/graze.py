"""Graze as a task: robots cover the area."""

from __future__ import annotations

from typing import Any

from teamsight.tasks.foraging.forage import TASK as FORAGE
from teamsight.tasks.foraging.worlds import Graze, completion
from teamsight.tasks.objective import Objective
from teamsight.tasks.task import Task


def completion_time(world: Any) -> float:
    """Return the number of steps until 95 % of the ground are grazed."""
    return completion(world, "grazed", world.DONE)


def grazed(world: Any) -> float:
    """Return the share of the ground that is grazed."""
    return float(world.recording.history["grazed"].sum())


TASK = Task(
    name="graze",
    title="Cover the area",
    world=Graze,
    scenario={name: value for name, value in FORAGE.scenario.items() if name not in ("attractors", "mass")},
    objective=Objective("completion_time", "less"),
    metrics={"completion_time": completion_time, "grazed": grazed},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "schemas", "communication": "goal", "awareness": "pairwise"},
    team="robots",
    steps=8000,
    gathers=False,
    about="Robots go over 95 % of the ground, each cell of which counts once. Source: Balch and Arkin (1994).",
)
