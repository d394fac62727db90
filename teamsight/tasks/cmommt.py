"""CMOMMT as a task: robots disperse over a disc to observe moving targets."""

from __future__ import annotations

from teamsight.agents.cmommt import CMOMMT, DEFAULTS, REWRITTEN
from teamsight.agents.world import World
from teamsight.tasks.task import Objective, Task

_SCENARIO = [name for name in DEFAULTS if name in {"robots", "targets", *REWRITTEN}]


def observed_fraction(world: World) -> float:
    """Return the mean over the steps of the fraction of targets that at least one robot senses."""
    return float(world.observed_fraction)


TASK = Task(
    name="cmommt",
    title="Cooperative observation of multiple moving targets",
    world=CMOMMT,
    scenario={name: DEFAULTS[name] for name in _SCENARIO},
    objective=Objective("observed_fraction", "more"),
    metrics={"observed_fraction": observed_fraction},
    explore={"policy": "random-walk", "awareness": "none"},
    skilled={"policy": "a-cmommt", "awareness": "pairwise"},
    team="robots",
    size="robots",
    steps=600,
    gathers=False,
    about="Robots in a disc keep as many moving targets as possible in sight. They disperse. Source: Touzet (2000).",
)
