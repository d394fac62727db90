"""Pursuit as a task: two hunters, or more, that must be next to a prey together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from teamsight.agents.awareness import Awareness, PairwiseAwareness
from teamsight.agents.world import World
from teamsight.core import checks
from teamsight.policies.online.modular_q import ModularQ
from teamsight.policies.online.prey_q import PreyQ
from teamsight.tasks.objective import Objective
from teamsight.tasks.pursuit.world import Pursuit
from teamsight.tasks.task import Task

#: Steps for which a team learns before it counts as skilled.
LEARNING = 500_000
# How it learns: α, T where two capture and where all sides must be held, and the most partners of a hunter.
_RATE, _TEMPERATURE, _SURROUNDING, _PARTNERS = 0.1, 0.03, 0.001, 3


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
    """Let a team learn by trial and error, and return its parameters: its degree, and its greedy policy.

    Parameters
    ----------
    scenario : mapping
        All parameters of the scenario.
    awareness : Awareness, optional
        The degree of awareness; by default all teammates, "pairwise".
    rng : int
        The seed of the world in which it learns.
    steps : int
        Steps for which it learns; 0 for a team that has learned nothing.

    Notes
    -----
    Two capture a prey, so a hunter uses the closest teammate of those that its degree shows, however many these are.
    Where hunters must stand on all sides of a prey ("surround") it uses the three closest, each in a module.
    The rate, the temperature and the steps are ours: with Tan's, hunters need longer
    (``benchmarks/pursuit_constants.py``). The team that has learned keeps the temperature, since greedy hunters that
    sense nothing would repeat one move.
    """
    degree = PairwiseAwareness() if awareness is None else awareness
    policy = _learner(scenario, degree)
    world = Pursuit(**scenario, policy=policy, awareness=degree, rng=rng)
    if steps > 0:
        world.run(steps, progress=False)
    state = world.hunters.policy_state
    frozen = policy.frozen(state.floats if isinstance(policy, PreyQ) else state)
    return {"policy": replace(frozen, temperature=policy.temperature), "awareness": degree}


def _learner(scenario: Mapping[str, Any], degree: Awareness) -> PreyQ | ModularQ:
    depth, is_surround = scenario["depth"], scenario["rule"] == "surround"
    shown = min(checks.count("hunters", scenario["hunters"]) - 1, getattr(degree, "delta", _PARTNERS))
    if "teammates" not in degree.delivers:
        shown = 0
    if is_surround and shown > 0:
        return ModularQ(depth, modules=min(shown, _PARTNERS), by="distance")
    moves, temperature = (5, _SURROUNDING) if is_surround else (4, _TEMPERATURE)
    partner = depth if shown > 0 else 0
    return PreyQ(depth, partner=partner, learning_rate=_RATE, temperature=temperature, moves=moves, values_ends=True)


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
