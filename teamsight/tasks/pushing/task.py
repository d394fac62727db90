"""Box pushing as a task: robots find a box and push it together."""

from __future__ import annotations

from typing import Any

import numpy as np

from teamsight.tasks.objective import Objective
from teamsight.tasks.pushing.world import FIXED_PRIORITY, BoxPushing
from teamsight.tasks.task import Task


def completion_time(world: Any) -> float:
    """Return the steps until the box was moved by the distance of the world; infinite if it was not."""
    moved = np.cumsum(world.recording.history["box_moved"].to_numpy()) >= world.distance - 1e-9
    return float(np.argmax(moved) + 1) if moved.any() else float("inf")


def box_moved(world: Any) -> float:
    """Return how far the box was moved [length]."""
    return float(world.recording.history["box_moved"].sum())


def together(world: Any) -> float:
    """Return the share of the steps in which two robots push, or more."""
    return float(np.mean(world.recording.history["pushing"].to_numpy() >= 2))


def stagnation(world: Any) -> float:
    """Return the share of the steps in which two robots push, or more, and the box does not move."""
    return float(np.mean(world.recording.history["stagnating"].to_numpy() >= 2))


TASK = Task(
    name="push",
    title="Push a box together",
    world=BoxPushing,
    scenario={
        "robots": 5, "side": 40.0, "distance": 10.0, "sensing_range": 12.0, "awareness_range": 6.0, "speed": 0.5,
        "robot_radius": 0.5, "box_radius": 2.0, "threshold": 1.5,
    },
    objective=Objective("completion_time", "less"),
    metrics={
        "completion_time": completion_time, "box_moved": box_moved, "together": together, "stagnation": stagnation,
    },
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": FIXED_PRIORITY, "awareness": "pairwise"},
    team="robots",
    steps=2000,
    gathers=True,
    about="Robots find a box that is too heavy for one and push it together. They gather around it. Source: Kube and "
    "Zhang (1994).",
)  # fmt: skip
