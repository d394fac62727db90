"""Collecting pucks as a task: robots learn by basis behaviours to carry pucks home."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

from teamsight.agents.awareness import Awareness, PairwiseAwareness
from teamsight.agents.world import World
from teamsight.policies.basis.basis_behaviours import BasisBehaviours, share_correct
from teamsight.tasks.collecting.world import PuckCollecting
from teamsight.tasks.objective import Objective
from teamsight.tasks.task import Task

#: Steps for which a team learns before it counts as skilled.
LEARNING = 100_000


def delivered(world: World) -> float:
    """Return the number of pucks that were delivered."""
    return float(world.recording.history["delivered"].sum())


def slept_at_home(world: World) -> float:
    """Return the share of nights after which a robot woke at home, of those after which it woke at all; 0 for none."""
    history = world.recording.history
    home, away = float(history["woken_home"].sum()), float(history["woken_away"].sum())
    return home / (home + away) if home + away else 0.0


def rows_correct(world: World) -> float:
    """Return the share of clear rows whose behaviour is right; 0 for a team without a table of behaviours."""
    robots: Any = world.robots  # type: ignore[attr-defined]
    if not isinstance(robots.policy, BasisBehaviours):
        return 0.0
    return share_correct(robots.policy.values(robots.policy_state))


def learned(
    scenario: Mapping[str, Any], awareness: Awareness | None, rng: int, steps: int = LEARNING
) -> dict[str, Any]:
    """Let a team learn from events and progress, and return its parameters: its degree, and the policy it learned.

    Parameters
    ----------
    scenario : mapping
        All parameters of the scenario.
    awareness : Awareness or None
        What the robots perceive of teammates; None for pairwise awareness.
    rng : int
        The seed.
    steps : int
        Steps for which they learn.
    """
    degree = PairwiseAwareness() if awareness is None else awareness
    policy = BasisBehaviours()
    with contextlib.closing(PuckCollecting(**scenario, policy=policy, awareness=degree, rng=rng)) as world:
        world.run(steps, progress=False)
        return {"policy": policy.frozen(policy.values(world.robots.policy_state)), "awareness": degree}


TASK = Task(
    name="collect",
    title="Collect pucks, and rest at home by night",
    world=PuckCollecting,
    scenario={
        "robots": 4, "pucks": 20, "side": 30.0, "home_radius": 3.0, "reach": 0.4, "speed": 0.3, "awareness_range": 6.0,
        "period": 400, "night": 100, "renewed": True,
    },
    objective=Objective("delivered", "more"),
    metrics={"delivered": delivered, "slept_at_home": slept_at_home, "rows_correct": rows_correct},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled=learned,
    team="robots",
    steps=1200,
    gathers=True,
    about="Robots find pucks, carry them home, and gather there by night. Source: Mataric (1994, 1997).",
)  # fmt: skip
