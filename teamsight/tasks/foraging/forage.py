"""Forage as a task: robots carry attractors home."""

from __future__ import annotations

from typing import Any

from teamsight.tasks.foraging.worlds import Forage, completion
from teamsight.tasks.objective import Objective
from teamsight.tasks.task import Task


def completion_time(world: Any) -> float:
    """Return the number of steps until all attractors are delivered."""
    return completion(world, "delivered", len(world.attractors))


def delivered(world: Any) -> float:
    """Return the share of attractors that are delivered."""
    return float(world.recording.history["delivered"].sum() / len(world.attractors))


TASK = Task(
    name="forage",
    title="Carry attractors home",
    world=Forage,
    scenario={
        "robots": 5, "attractors": 7, "mass": 5.0, "side": 64.0, "obstacles": 0.15, "layout": 1, "speed": 2.0,
        "sensing_range": 20.0, "communication_range": 100.0,
    },
    objective=Objective("completion_time", "less"),
    metrics={"completion_time": completion_time, "delivered": delivered},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "schemas", "communication": "goal", "awareness": "pairwise"},
    team="robots",
    steps=8000,
    gathers=True,
    about="Robots search for attractors and carry them home, together if they can. Source: Balch and Arkin (1994).",
)  # fmt: skip
