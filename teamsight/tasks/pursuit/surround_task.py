"""Pursuit by four hunters at once: they must stand on all sides of the prey."""

from __future__ import annotations

from teamsight.policies import SurroundPrey
from teamsight.tasks.objective import Objective
from teamsight.tasks.pursuit.task import captures, trial_steps
from teamsight.tasks.pursuit.world import Pursuit
from teamsight.tasks.task import Task

TASK = Task(
    name="surround",
    title="Hunters that surround prey",
    world=Pursuit,
    scenario={"hunters": 4, "prey": 1, "side": 20, "depth": 3, "rule": "surround", "torus": True},
    objective=Objective("trial_steps", "less"),
    metrics={"trial_steps": trial_steps, "captures": captures},
    explore={"policy": "lattice-walk", "awareness": "none"},
    skilled={"policy": SurroundPrey(), "awareness": "pairwise"},
    team="hunters",
    size="hunters",
    steps=600,
    gathers=True,
    about="Four hunters on all sides of a prey on a torus capture it. Source: Ono and Fukumoto (1996), whose hunters "
    "learn; the team with skill is made by hand.",
)
