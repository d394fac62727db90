"""A degree of awareness that adds teammates' headings to the situation, and a policy that aligns robots by them."""

from teamsight import Robot, Torus, World, check_awareness, check_policy
from teamsight.agents.awareness import OWN_SECTORS, Awareness, Scene, situate_targets, teammate_heading
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, go


@kernel
def _situate(scene: Scene, parameters: Floats, situation: Floats) -> None:
    situate_targets(scene, parameters, situation)
    for i in range(len(situation)):
        x, y = scene.heading[i, 0], scene.heading[i, 1]
        for k in range(scene.teammates.start[i], scene.teammates.start[i + 1]):
            way = teammate_heading(scene, k)
            x, y = x + way[0], y + way[1]
        situation[i, OWN_SECTORS], situation[i, OWN_SECTORS + 1] = x, y


class TeammateHeadings(Awareness):
    situate, added = _situate, 2


@kernel
def _align(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    for i in range(len(percept.heading)):
        go(action, i, percept.situation[i, OWN_SECTORS], percept.situation[i, OWN_SECTORS + 1], percept.speed[i])


class Align(CompiledPolicy):
    kernel, inputs = _align, OWN_SECTORS + 2


check_awareness(TeammateHeadings())
check_policy(Align())
world = World(Torus(8, 8), rng=1)
robots = world.add(Robot, 40, policy=Align(), awareness=TeammateHeadings())
world.run(90)
print(f"alignment {sum(robots.heading.mean(axis=0) ** 2) ** 0.5:.2f} of 1; path: {world.path}")
