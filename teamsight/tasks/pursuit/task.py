"""Pursuit as a task: two hunters, or more, that must be next to a prey together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from teamsight.agents.awareness import Awareness, PairwiseAwareness
from teamsight.agents.model import World
from teamsight.policies.online.prey_q import PreyQ
from teamsight.tasks.objective import Objective
from teamsight.tasks.pursuit.world import Pursuit
from teamsight.tasks.task import Task

#: Steps for which a team learns before it counts as skilled.
LEARNING = 200_000


def trial_steps(world: World) -> float:
    """Return the steps of a trial: all steps of trials over the trials that have ended; infinite without any."""
    history = world.recording.history
    ended = int(np.count_nonzero(history["captures"]))
    return float(np.count_nonzero(history["trial_steps"]) / ended) if ended else math.inf


def captures(world: World) -> float:
    """Return the number of prey captured."""
    return float(world.recording.history["captures"].sum())


def learned(
    scenario: Mapping[str, Any], awareness: Awareness | None, rng: int, steps: int = LEARNING
) -> dict[str, Any]:
    """Let a team learn by trial and error, and return its parameters: its degree, and its greedy policy."""
    degree = PairwiseAwareness() if awareness is None else awareness
    depth = scenario["depth"]
    policy = PreyQ(depth, partner=depth if "teammates" in degree.delivers else 0, values_ends=True)
    world = Pursuit(**scenario, policy=policy, awareness=degree, rng=rng)
    world.run(steps, progress=False)
    return {"policy": policy.frozen(world.hunters.policy_state.floats), "awareness": degree}


TASK = Task(
    name="pursuit",
    title="Hunters that capture prey together",
    world=Pursuit,
    scenario={"hunters": 2, "prey": 2, "side": 10, "depth": 4, "rule": "pair", "torus": False},
    objective=Objective("trial_steps", "less"),
    metrics={"trial_steps": trial_steps, "captures": captures},
    explore={"policy": "lattice-walk", "awareness": "none"},
    skilled=learned,
    team="hunters",
    size="hunters",
    steps=600,
    gathers=True,
    about="Two hunters next to a prey on a grid capture it. They gather around it. Source: Tan (1993), case 3.",
)
