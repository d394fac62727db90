"""Columns in percepts: what policies read of their own robots and of teammates."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from teamsight import Robot, Torus, World
from teamsight.core.kernel import kernel
from teamsight.policies import Action, CompiledPolicy, Policy, PolicyState
from teamsight.policies.channels import column_of
from teamsight.policies.check import check_policy
from tests.interactions import fingerprint, hunt


@kernel
def _follow(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    seen = percept.teammates
    for i in range(percept.heading.shape[0]):
        mood = column_of(percept.columns.mood, percept.identity[i])
        total = 0.0
        for k in range(seen.start[i], seen.start[i + 1]):
            value = column_of(percept.columns.mood, seen.identity[k])
            total += 0.0 if math.isnan(value) else value
        gain = column_of(percept.columns.gain, percept.identity[i])
        arrays.state.floats[i, 0, 0] = (mood + 0.25 * total + noise[0, i]) % 1.0
        action.heading[i, 0] = 0.0
        action.heading[i, 1] = 0.0
        action.distance[i] = arrays.state.floats[i, 0, 0] * percept.speed[i] * gain


@dataclass(frozen=True)
class Moody(CompiledPolicy):
    """Shows its mood, which depends on its own last one and on those of teammates."""

    columns = ("mood", "gain")
    shows = ("mood",)
    draws = 1
    kernel = _follow

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.full((size, 1, 2), 0.5), np.zeros((size, 0, 0), np.int64))


class SlowMoody(Policy):
    """The same in NumPy."""

    columns, shows, draws = Moody.columns, Moody.shows, 1

    def start(self, size: int) -> PolicyState:
        return Moody().start(size)

    def decide(self, percept: Any, state: Any, noise: Any) -> tuple[Action, PolicyState]:
        seen, mood, floats = percept.teammates, percept.columns.mood, state.floats.copy()
        for i, identity in enumerate(percept.identity):
            total = 0.0
            for other in seen.identity[seen.start[i] : seen.start[i + 1]]:
                total += 0.0 if other < 0 else np.nan_to_num(mood[other])
            floats[i, 0, 0] = (mood[identity] + 0.25 * total + noise[0, i]) % 1.0
        distance = floats[:, 0, 0] * percept.speed * percept.columns.gain[percept.identity]
        return Action(np.zeros((len(floats), 2)), distance), PolicyState(floats, state.ints)


def team(policy: Any, *, awareness: str = "pairwise", **options: Any) -> World:
    world = World(Torus(6.0, 6.0), rng=3)
    robots = world.add(
        Robot, 9, policy=policy, awareness=awareness, awareness_range=2.0, speed=0.4, placement="uniform", **options
    )
    robots.add_column("gain", 1)
    robots.gain[2:5] = 0
    return world


@pytest.mark.parametrize("cycle", [1, 3])
def test_kernel_and_numpy_read_the_same_on_both_paths(cycle: int) -> None:
    fast, stepped, slow = team(Moody(), cycle=cycle), team(Moody(), cycle=cycle), team(SlowMoody(), cycle=cycle)
    fast.run(60)
    for _ in range(60):
        stepped.step()
    slow.run(60)
    moods = [world.groups[0].policy_state.floats[:, 0, 0] for world in (fast, stepped, slow)]
    assert len(set(np.round(moods[0], 6))) == 9
    assert (moods[0] == moods[1]).all()
    assert (moods[0] == moods[2]).all()
    assert fingerprint(fast) == fingerprint(stepped) == fingerprint(slow)
    assert (fast.groups[0][0].percept.columns.mood[fast.groups[0].bodies.identity] == moods[0]).all()


def test_hidden_teammates_are_not_a_number() -> None:
    world = team(Moody(), awareness="ring")
    world.run(20)
    assert np.isfinite(world.groups[0].policy_state.floats).all()
    check_policy(Moody())
    check_policy(SlowMoody())


def test_agents_come_and_go_and_states_are_restored() -> None:
    world = team(Moody())
    world.run(10)
    robots: Any = world.groups[0]
    robots[4].remove()
    robots.add(2, gain=1)
    state = world.state()
    world.run(20)
    first = fingerprint(world)
    world.restore(state)
    for _ in range(20):
        world.step()
    assert fingerprint(world) == first
    seen = robots[0].percept.columns.mood
    assert len(seen) == robots.bodies.identity.max() + 1
    assert np.isnan(seen[5])


def test_a_robot_with_another_policy_does_not_show_the_old_state() -> None:
    world = team(Moody())
    robots: Any = world.groups[0]
    robots[3].policy = "random-walk"
    world.run(5)
    assert np.flatnonzero(np.isnan(robots[0].percept.columns.mood[1:])).tolist() == [3]


def test_functions_of_one_robot_read_columns_of_interactions() -> None:
    found = []

    def rule(percept: Any, rng: Any) -> tuple[float, float]:
        found.append([percept.columns.caught[k] for k in percept.targets.identity])
        return 0.3, 1.0

    world = hunt(policy=rule)
    world.run(150)
    assert max(max(row, default=0) for row in found) == world.groups[1].caught.values.max() > 0


def test_a_column_that_no_group_has_is_named() -> None:
    world = World(Torus(4.0, 4.0), rng=1)
    world.add(Robot, 2, policy=Moody())
    with pytest.raises(ValueError, match=r"Moody.*'gain'.*add_column\('gain'\)"):
        world.run(1)


def test_a_policy_cannot_show_more_than_it_has() -> None:
    class Boaster(Moody):
        shows = ("mood", "load", "aim")

    with pytest.raises(ValueError, match=r"first 3 fields .* has 2"):
        check_policy(Boaster())


class Growing(SlowMoody):
    """The same, with a state of another shape after each decision, and of a type that no table holds at every other."""

    def decide(self, percept: Any, state: Any, noise: Any) -> tuple[Action, PolicyState]:
        action, after = super().decide(percept, state, noise)
        fields = after.floats.shape[2] % 3 + 1
        floats = np.zeros((len(after.floats), 1, fields + 1))
        floats[:, 0, 0] = after.floats[:, 0, 0]
        return action, PolicyState(floats, after.ints if fields % 2 else after.ints.astype(np.int32))


def test_columns_show_a_state_whose_shape_changes() -> None:
    worlds = team(SlowMoody()), team(Growing())
    for world in worlds:
        world.run(7)
    one, other = (world.groups[0].position.tobytes() for world in worlds)
    assert one == other
