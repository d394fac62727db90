"""Boids (Reynolds 1987): a flock from three rules, of which one needs the headings of teammates."""

from teamsight import Robot, Torus, World, check_policy
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Floats, Percept, PolicyArrays, column_of, go


@kernel
def _flock(percept: Percept, arrays: PolicyArrays, noise: Floats, action: Action) -> None:
    cohere, separate, match, near = arrays.parameters
    seen = percept.teammates
    for i in range(len(percept.heading)):
        x, y, weight = percept.heading[i, 0], percept.heading[i, 1], 1.0 / max(seen.start[i + 1] - seen.start[i], 1)
        for k in range(seen.start[i], seen.start[i + 1]):
            pull = cohere - separate if seen.distance[k] < near else cohere
            x += weight * (pull * seen.offset[k, 0] + match * column_of(percept.columns.heading_x, seen.identity[k]))
            y += weight * (pull * seen.offset[k, 1] + match * column_of(percept.columns.heading_y, seen.identity[k]))
        go(action, i, x, y, percept.speed[i])


class Flock(CompiledPolicy):
    """The rules and constants of mesa's example: cohesion, separation below a distance, and alignment."""

    kernel, columns, needs = _flock, ("heading_x", "heading_y"), ("identities",)
    parameters = (0.03, 0.015, 0.05, 2.0)


def flock(seed: int, robots: int = 100) -> World:
    """Return the flock of mesa's example before its first step."""
    world = World(Torus(100, 100), rng=seed)
    world.add(Robot, robots, policy=Flock(), awareness="pairwise", awareness_range=10.0, speed=1.0)
    return world


if __name__ == "__main__":
    check_policy(Flock())
    world = flock(1)
    for _ in range(5):
        world.run(40)
        order = float((world.groups[0].heading.mean(axis=0) ** 2).sum() ** 0.5)
        print(f"step {world.tick}: the mean heading has the length {order:.2f} of 1; path: {world.path}")
