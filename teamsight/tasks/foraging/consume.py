"""Consume as a task: robots work on attractors in place."""

from __future__ import annotations

from typing import Any

from teamsight.tasks.foraging.forage import TASK as FORAGE
from teamsight.tasks.foraging.worlds import Consume, completion
from teamsight.tasks.objective import Objective
from teamsight.tasks.task import Task


def completion_time(world: Any) -> float:
    """Return the number of steps until all attractors are consumed."""
    return completion(world, "finished", len(world.attractors))


def finished(world: Any) -> float:
    """Return the share of attractors that are consumed."""
    return float(world.recording.history["finished"].sum() / len(world.attractors))


TASK = Task(
    name="consume",
    title="Consume attractors in place",
    world=Consume,
    scenario=FORAGE.scenario,
    objective=Objective("completion_time", "less"),
    metrics={"completion_time": completion_time, "finished": finished},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "schemas", "communication": "goal", "awareness": "pairwise"},
    team="robots",
    steps=8000,
    gathers=True,
    about="Robots search for attractors and work on them, for a time proportional to their mass. Source: Balch and "
    "Arkin (1994).",
)
