"""A degree of awareness of one's own: each robot perceives its k nearest teammates, however many are in range."""

from __future__ import annotations

from dataclasses import dataclass

from teamsight import CMOMMT, check_awareness
from teamsight.agents.awareness import Awareness, Scene, show
from teamsight.core.kernel import kernel
from teamsight.policies import NeighbourList


@kernel
def _nearest(scene: Scene, parameters: list[float], teammates: NeighbourList, relayed: NeighbourList) -> int:
    seen, shown = scene.teammates, 0
    for i in range(len(scene.heading)):
        teammates.start[i] = shown
        for k in range(seen.start[i], seen.start[i + 1]):
            nearer = 0
            for other in range(seen.start[i], seen.start[i + 1]):
                nearer += seen.distance[other] < seen.distance[k]
            if nearer < parameters[0]:
                shown = show(seen, k, teammates, shown)
    teammates.start[len(scene.heading)] = shown
    return shown


@dataclass(frozen=True)
class NearestTeammates(Awareness):
    k: int = 3
    perceive = _nearest


check_awareness(NearestTeammates())
for k in (0, 1, 3):
    model = CMOMMT(robots=20, radius=2.0, awareness=NearestTeammates(k), rng=1)
    model.run(300)
    most = max(len(robot.percept.teammates.distance) for robot in model.robots)
    print(f"k = {k}: {model.observed_fraction:.1%} observed, at most {most} perceived; path: {model.path}")
