"""What a policy reads of all bodies like a column: heading, displacement, speed and radius, of those that it perceives and its own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import Box, Robot, Target, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Policy, column_of, go
from teamsight.policies.channels import OF_BODIES

NAMES = ("heading_x", "heading_y", "moved_x", "moved_y", "speed", "radius")


class Follow(Policy):
    """Turns to the mean heading of all teammates in sight, weighted by their speed and radius; keeps what it saw."""

    columns = NAMES
    needs = ("identities",)

    def decide(self, percept: Any, state: Any, noise: Any) -> tuple[Action, Any]:
        way = percept.heading.copy()
        seen, columns = percept.teammates, percept.columns
        for i in range(len(way)):
            for k in range(seen.start[i], seen.start[i + 1]):
                j = seen.identity[k]
                weight = columns.speed[j] + columns.radius[j]
                way[i, 0] += weight * columns.heading_x[j]
                way[i, 1] += weight * columns.heading_y[j]
        self.seen = {name: getattr(columns, name).copy() for name in NAMES}
        return Action(way / np.sqrt((way**2).sum(axis=1))[:, None], percept.speed), None


@kernel
def _follow(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    seen, columns = percept.teammates, percept.columns
    for i in range(len(percept.heading)):
        x = percept.heading[i, 0]
        y = percept.heading[i, 1]
        for k in range(seen.start[i], seen.start[i + 1]):
            j = seen.identity[k]
            weight = column_of(columns.speed, j) + column_of(columns.radius, j)
            x += weight * column_of(columns.heading_x, j)
            y += weight * column_of(columns.heading_y, j)
        go(action, i, x, y, percept.speed[i])


class FollowCompiled(CompiledPolicy):
    """The same in a kernel."""

    kernel, columns, needs = _follow, NAMES, ("identities",)


def flock(policy: Any, awareness: Any = "pairwise") -> World:
    world = World(Box(6.0, 6.0), rng=1)
    world.add(Robot, 7, policy=policy, awareness=awareness, awareness_range=2.0, speed=[0.1] * 6 + [0.3], radius=0.2)
    world.add(Robot, 4, policy="random-walk", awareness_range=2.0, radius=0.1, name="others")
    return world


@pytest.mark.short
@pytest.mark.parametrize("awareness", ["pairwise", "shared"])
def test_a_kernel_and_numpy_see_the_same_on_both_paths(awareness: str) -> None:
    worlds = [flock(FollowCompiled(), awareness), flock(FollowCompiled(), awareness), flock(Follow(), awareness)]
    worlds[0].run(30)
    for world in worlds[1:]:
        for _ in range(30):
            world.step()
    assert worlds[0].path == "compiled"
    assert np.array_equal(worlds[0].groups[0].position, worlds[1].groups[0].position)
    np.testing.assert_allclose(worlds[0].groups[0].position, worlds[2].groups[0].position, atol=1e-9)


@pytest.mark.short
def test_they_are_those_of_all_agents_at_the_decision() -> None:
    policy = Follow()
    world = flock(policy)
    prey = world.add(Target, 3, policy="random-walk")
    for _ in range(3):
        before = [(group.heading.copy(), group.bodies.moved.copy()) for group in world.groups]
        world.step()
        for group, (heading, moved) in zip(world.groups, before, strict=True):
            for name, values in (
                ("heading_x", heading[:, 0]), ("heading_y", heading[:, 1]), ("speed", group.speed),
                ("radius", group.radius), ("moved_x", moved[:, 0]), ("moved_y", moved[:, 1]),
            ):  # fmt: skip
                assert np.array_equal(policy.seen[name][group.identity], values)
    prey[0].remove()
    world.groups[0].add(2, speed=0.2)
    world.step()
    assert np.array_equal(policy.seen["heading_x"][prey.identity].shape, (2,))


@pytest.mark.short
def test_a_column_of_ones_own_comes_first() -> None:
    policy = Follow()
    world = flock(policy)
    world.groups[0].add_column("heading_x", 0.5)
    world.step()
    assert (policy.seen["heading_x"][world.groups[0].identity] == 0.5).all()
    assert (np.abs(policy.seen["heading_x"][world.groups[1].identity]) <= 1).all()


@pytest.mark.short
def test_a_degree_that_hides_who_a_teammate_is_is_refused() -> None:
    with pytest.raises(ValueError, match="identities"):
        flock(FollowCompiled(), "ring")


@pytest.mark.short
def test_an_unknown_column_is_refused_with_those_that_all_have() -> None:
    class Wrong(Follow):
        columns = ("weight",)

    world = flock(Wrong())
    with pytest.raises(ValueError, match=", ".join(OF_BODIES)):
        world.step()
