"""Avoiding: the velocities are those of the reference library and of a slow twin, and robots do not bump."""

from __future__ import annotations

import math
import pickle
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive import avoiding as naive

from teamsight import CMOMMT, Box, Robot, Target, Torus, World, check_policy
from teamsight.core.kernel import guard, kernel
from teamsight.core.neighbour_list import NeighbourList, no_neighbours
from teamsight.policies import (
    ACmommt,
    Action,
    Avoiding,
    Centroid,
    CompiledPolicy,
    Percept,
    Policy,
    PolicyState,
    RandomWalk,
    go,
)
from teamsight.policies.channels import columns_of
from teamsight.policies.compiled import pack_decision
from teamsight.policies.steered import Steered

Floats = npt.NDArray[np.float64]
STEERED = Steered("heading")


class Crowd:
    """Robots that perceive each other, with the velocity that each prefers; the last `targets` are no teammates."""

    def __init__(self, position: Any, velocity: Any, aim: Any, radius: Any, speed: Any, targets: int = 0) -> None:
        self.position, self.velocity, self.aim = np.array(position, float), np.array(velocity, float), np.array(aim, float)
        size = len(self.position)
        self.radius, self.speed = np.full(size, radius, float), np.full(size, speed, float)
        self.robots = size - targets
        self.offset = self.position[None] - self.position[:, None]

    def _seen(self, others: range) -> NeighbourList:
        rows = [[j for j in others if j != i] for i in range(self.robots)]
        start = np.append(0, np.cumsum([len(row) for row in rows])).astype(np.int64)
        identity = np.array([j for row in rows for j in row], np.int64)
        offset = self.offset[np.repeat(np.arange(self.robots), np.diff(start)), identity]
        return NeighbourList(start, identity, offset, np.hypot(*offset.T))

    def percept(self, policy: Policy) -> Percept:
        size = self.robots
        values = {"radius": self.radius, "speed": self.speed, "moved_x": self.velocity[:, 0], "moved_y": self.velocity[:, 1]}
        ones, none = np.ones(size), no_neighbours(size)
        return Percept(
            np.tile([1.0, 0.0], (size, 1)), self.velocity[:size], self.speed[:size], ones, ones,
            self._seen(range(size, len(self.position))), self._seen(range(size)), none, np.zeros((size, 0), np.float32),
            identity=np.arange(size), columns=columns_of(policy.columns, [values[name].copy() for name in policy.columns]),
        ).completed()  # fmt: skip

    def state(self) -> PolicyState:
        """The actions that robots prefer, for `Steered`."""
        aim = self.aim[: self.robots]
        distance = np.hypot(*aim.T)
        heading = aim / np.where(distance > 0, distance, 1)[:, None]
        return PolicyState(np.column_stack([heading, distance])[:, None], np.zeros((self.robots, 0, 0), np.int64))

    def avoided(self, **options: Any) -> Floats:
        """The velocities of all robots."""
        policy = Avoiding(STEERED, **options)
        action, _ = policy.decide(self.percept(policy), self.state(), np.zeros((0, self.robots)))
        heading: Floats = np.where(action.heading.any(axis=1, keepdims=True), action.heading, [1.0, 0.0])
        return heading * np.minimum(action.distance, self.speed[: self.robots])[:, None]

    def body(self, i: int, j: int) -> naive.Body:
        return naive.Body(
            self.offset[i, j], self.velocity[j], float(self.radius[j]), float(self.speed[j]), j < self.robots
        )


def crowd(seed: int, size: int, share: float, targets: int = 0) -> Crowd:
    """Return a random crowd, in single precision; `share` is how much of the area bodies cover, on average."""
    rng = np.random.default_rng(seed)
    radius, speed = rng.uniform(0.2, 0.6, size), rng.uniform(0.5, 1.2, size)
    side = math.sqrt(math.pi * (radius**2).sum() / share)
    angle = rng.uniform(0, 2 * math.pi, (2, size))
    way = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * (speed * rng.random((2, size)))[..., None]
    values = (rng.uniform(0, side, (size, 2)), *way, radius, speed)
    return Crowd(*(np.float32(one) for one in values), targets=targets)


# ORCA alone: what the reference library has.
ORCA: dict[str, Any] = {"margin": 0.0, "strict": False}


def reference(crowd: Crowd, horizon: float, neighbours: int) -> Floats:
    """The velocities of the reference library, in single precision."""
    pyrvo: Any = pytest.importorskip("pyrvo", reason="pyrvo is not installed: it has no wheel for this machine")
    simulator = pyrvo.RVOSimulator()
    simulator.set_time_step(1.0)
    for i, (place, velocity) in enumerate(zip(crowd.position.tolist(), crowd.velocity.tolist(), strict=True)):
        radius, speed = float(crowd.radius[i]), float(crowd.speed[i])
        simulator.add_agent(tuple(place), 1e4, neighbours, horizon, 1.0, radius, speed, tuple(velocity))
        simulator.set_agent_pref_velocity(i, tuple(crowd.aim[i].tolist()))
    simulator.do_step()
    found = [simulator.get_agent_velocity(i).to_tuple() for i in range(len(crowd.position))]
    return np.array(found)


@pytest.mark.parametrize("share", [0.03, 0.1, 0.5])
def test_velocities_are_those_of_the_reference_library(share: float) -> None:
    far = total = changed = 0
    for seed in range(60):
        one = crowd(seed, 25, share)
        horizon, neighbours = (1.0, 2.0, 5.0, 10.0)[seed % 4], 1 + seed % 16
        theirs = reference(one, horizon, neighbours)
        ours = one.avoided(horizon=horizon, neighbours=neighbours, **ORCA)
        far += (np.abs(ours - theirs).max(axis=1) > 1e-5).sum()
        changed += (np.abs(ours - one.aim).max(axis=1) > 1e-5).sum()
        total += len(ours)
        # In single precision lines that are nearly parallel cross elsewhere: there ours is no farther outside.
        policy = Avoiding(STEERED, horizon=horizon, neighbours=neighbours, **ORCA)
        for i in range(25):
            planes, _ = naive.half_planes(policy, one.body(i, i), [one.body(i, j) for j in range(25) if j != i])
            assert math.hypot(*ours[i]) <= one.speed[i] * (1 + 1e-12)
            assert naive.farthest(planes, ours[i]) <= max(naive.farthest(planes, theirs[i]), 0.0) + 1e-5
    assert far <= 0.005 * total
    assert changed > 0.5 * total


@given(
    seed=st.integers(0, 2**32 - 1), size=st.integers(2, 7), share=st.floats(0.02, 0.8), targets=st.integers(0, 2),
    horizon=st.floats(1, 20), margin=st.floats(0, 1), strict=st.booleans(), neighbours=st.integers(1, 8),
    length=st.floats(0, 3),
)  # fmt: skip
@settings(max_examples=150)
def test_velocities_are_those_of_the_slow_twin(
    seed: int, size: int, share: float, targets: int, horizon: float, margin: float, strict: bool, neighbours: int,
    length: float,
) -> None:  # fmt: skip
    one = crowd(seed, size + targets, share, targets)
    one.aim *= length
    options: dict[str, Any] = {"horizon": horizon, "margin": margin, "strict": strict, "neighbours": neighbours}
    found = one.avoided(**options, targets=True)
    policy = Avoiding(STEERED, **options)
    for i in range(size):
        own, others = one.body(i, i), [one.body(i, j) for j in range(size + targets) if j != i]
        planes, cells = naive.half_planes(policy, own, others)
        # Nobody can be faster than its speed.
        aim = one.aim[i] * min(1.0, own.speed / max(math.hypot(*one.aim[i]), 1e-9))
        expected = naive.avoid(policy, own, others, aim)
        # There is one best velocity, but two that are far apart can be about equally good.
        assert math.hypot(*found[i]) <= own.speed + 1e-9
        assert naive.farthest(cells, found[i]) <= 1e-9
        if (most := naive.farthest([*cells, *planes], expected)) <= 1e-9:
            assert naive.farthest(planes, found[i]) <= 1e-9
            assert math.hypot(*(found[i] - aim)) == pytest.approx(math.hypot(*(expected - aim)), abs=1e-7)
        else:
            assert naive.farthest(planes, found[i]) == pytest.approx(most, abs=1e-7)


@pytest.mark.parametrize("share", [0.05, 0.5])
def test_machine_code_computes_the_bits_of_plain_python(share: float) -> None:
    guard.begin_check()
    for seed in range(3):
        one, policy = crowd(seed, 20, share, 3), Avoiding(STEERED, targets=True, margin=0.1)
        actions = [Action(np.zeros((17, 2)), np.zeros(17)) for _ in range(2)]
        packed = [
            pack_decision(policy, one.percept(policy), one.state(), np.zeros((1, 0, 17)), np.zeros(1, np.int64), action)
            for action in actions
        ]
        policy.entry()(packed[0])
        with np.errstate(all="ignore"):
            guard._as_python(policy.entry().function)(packed[1].value)
        assert [part.tobytes() for part in actions[0]] == [part.tobytes() for part in actions[1]]


def test_two_that_meet_head_on_pass_each_other_on_the_right() -> None:
    v, d, r = 0.2, 4.0, 0.5
    one = Crowd([[0, 0], [d, 0]], [[v, 0], [-v, 0]], [[v, 0], [-v, 0]], r / 2, v)
    found = one.avoided(horizon=1000.0, **ORCA)
    leg = math.sqrt(d**2 - r**2)
    # The least change of 2v that leads past a disc of radius r at the distance d; each does one half.
    assert found[0] == pytest.approx([v - v * r**2 / d**2, -v * r * leg / d**2], abs=1e-15)
    assert found[1] == pytest.approx(-found[0], abs=1e-15)
    way = found[0] - found[1]
    assert d * abs(way[1]) / math.hypot(*way) == pytest.approx(r)


def test_two_that_overlap_are_apart_after_a_tick() -> None:
    one = Crowd([[0, 0], [0.3, 0.4]], [[0, 0], [0, 0]], [[0, 0], [0, 0]], 0.5, 1.0)
    found = one.avoided(**ORCA)
    assert found[1] == pytest.approx([0.15, 0.2])
    assert found[0] == pytest.approx(-found[1])
    # Cells let them go apart too.
    assert np.allclose(one.avoided(margin=0.0), found)


def test_two_at_the_same_place_go_to_opposite_sides() -> None:
    one = Crowd([[2, 1], [2, 1]], [[0.1, 0], [0.1, 0]], [[0.1, 0], [0.1, 0]], 0.25, 1.0)
    found = one.avoided(**ORCA)
    assert found == pytest.approx(np.array([[0.35, 0.0], [-0.15, 0.0]]))


def test_where_no_velocity_is_safe_it_is_the_one_that_is_least_far_outside() -> None:
    angle = 0.2 + np.arange(3) * 2 * math.pi / 3
    ways = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    position, velocity = np.vstack([[[0, 0]], 1.1 * ways]), np.vstack([[[0, 0]], -0.3 * ways])
    one = Crowd(position, velocity, np.vstack([[[0.2, 0.1]], -0.3 * ways]), 0.5, 0.3)
    # Three that close in: each wants it to go away from it, at 0.125, and by symmetry it stays.
    found = one.avoided(horizon=2.0, **ORCA)[0]
    planes, _ = naive.half_planes(Avoiding(STEERED, horizon=2.0, **ORCA), one.body(0, 0), [one.body(0, j) for j in (1, 2, 3)])
    assert [plane.outside(found) for plane in planes] == pytest.approx([0.125] * 3)
    assert found == pytest.approx([0, 0], abs=1e-12)


def test_between_two_that_close_in_from_opposite_sides_it_is_as_far_outside_of_both() -> None:
    one = Crowd([[0, 0], [1.1, 0], [-1.3, 0]], [[0, 0], [-0.3, 0], [0.4, 0]], np.zeros((3, 2)), 0.5, 0.3)
    found = one.avoided(horizon=2.0, **ORCA)[0]
    planes, _ = naive.half_planes(Avoiding(STEERED, horizon=2.0, **ORCA), one.body(0, 0), [one.body(0, j) for j in (1, 2)])
    # Half planes with parallel lines: v_x ≤ -0.125, and v_x ≥ 0.125.
    assert [plane.outside(found) for plane in planes] == pytest.approx([0.125] * 2)


@pytest.mark.parametrize("way", [0.0, 0.2, -0.1])
def test_an_action_without_a_direction_keeps_the_heading_and_one_backwards_stays(way: float) -> None:
    one = Crowd([[0, 0], [0.9, 0.1]], np.zeros((2, 2)), np.zeros((2, 2)), 0.5, 0.3)
    policy, found = Avoiding(STEERED), []
    for heading, distance in (([0.0, 0.0], way), ([1.0, 0.0], max(way, 0.0))):
        state = PolicyState(np.array([[[*heading, distance]]] * 2), np.zeros((2, 0, 0), np.int64))
        found.append(policy.decide(one.percept(policy), state, np.zeros((0, 2)))[0])
    # That of the first, which is not safe.
    assert all(np.array_equal(a[0], b[0]) for a, b in zip(*found, strict=True))
    assert found[0].distance[0] > 0


@pytest.mark.parametrize("strict", [True, False])
def test_a_robot_that_cannot_move_stays(strict: bool) -> None:
    for seed in range(5):
        one = crowd(seed, 8, 0.8)
        one.speed[::2] = 0.0
        assert not one.avoided(strict=strict)[::2].any()


def test_what_is_safe_is_not_changed() -> None:
    one = Crowd([[0, 0], [50, 0], [0, 60]], np.zeros((3, 2)), [[0.3, 0.1], [0.0, 0.0], [2.0, 1.0]], 0.5, 0.5)
    policy, state = Avoiding(STEERED), one.state()
    action, _ = policy.decide(one.percept(policy), state, np.zeros((0, 3)))
    # To the last bit, also one that is longer than the speed, or none.
    assert np.array_equal(np.column_stack([*action]), state.floats[:, 0])


def test_bodies_without_a_radius_do_not_avoid_and_are_not_avoided() -> None:
    one = Crowd([[0, 0], [1, 0]], [[0.5, 0], [-0.5, 0]], [[0.5, 0], [-0.5, 0]], [0.3, 0.0], 0.5)
    assert np.array_equal(one.avoided(), one.aim)
    assert not np.array_equal(Crowd(one.position, one.velocity, one.aim, 0.3, 0.5).avoided(), one.aim)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_the_order_in_which_teammates_are_perceived_has_no_effect(seed: int) -> None:
    one, policy = crowd(seed, 12, 0.3), Avoiding(STEERED, neighbours=6)
    percept, seen = one.percept(policy), one.percept(policy).teammates
    order = np.concatenate([i * 11 + np.random.default_rng(seed + i).permutation(11) for i in range(12)])
    mixed = NeighbourList(seen.start, seen.identity[order], seen.offset[order], seen.distance[order])
    actions = [policy.decide(percept._replace(teammates=each), one.state(), np.zeros((0, 12)))[0] for each in (seen, mixed)]
    assert all(np.array_equal(a, b) for a, b in zip(*actions, strict=True))


class Same(Policy):
    """What a compiled policy decides, as a policy in Python."""

    def __init__(self, policy: Any) -> None:
        self.policy, self.draws, self.needs = policy, policy.draws, policy.needs

    def start(self, size: int) -> Any:
        return [self.policy.start(size)]

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        action, after = self.policy.decide(percept, state[0], noise)
        return action, [after]


def teams(policy: Any, *, cycle: float = 1.0) -> World:
    """Return two groups of a team, of which one has this policy, with bodies and targets."""
    world = World(Box(7.0, 5.0), contact="slide", rng=3)
    options: dict[str, Any] = {"awareness": "pairwise", "awareness_range": 2.0, "team": "all"}
    first = world.add(Robot, 14, policy=policy, radius=0.2, speed=0.15, cycle=cycle, **options)
    world.add(Robot, 6, policy=Avoiding("random-walk"), radius=0.25, speed=0.08, name="others", **options)
    world.senses(first, world.add(Target, 5, policy="random-walk", radius=0.1))
    return world


@pytest.mark.parametrize("cycle", [1.0, 2.5])
@pytest.mark.parametrize("policy", [ACmommt(), Centroid(), RandomWalk()], ids=lambda one: type(one).__name__)
def test_all_paths_and_a_policy_in_python_give_the_same_bits(policy: Any, cycle: float) -> None:
    worlds = [teams(Avoiding(each, targets=True), cycle=cycle) for each in (policy, policy, Same(policy))]
    worlds[0].run(60)
    for _ in range(60):
        worlds[1].step()
    with pytest.warns(UserWarning, match="Python"):
        worlds[2].run(60)
    assert worlds[0].path == "compiled"
    for world in worlds[1:]:
        for group, other in zip(world.groups, worlds[0].groups, strict=True):
            assert group.position.tobytes() == other.position.tobytes()
    states = [worlds[0].groups[0].policy_state, worlds[2].groups[0].policy_state[0]]
    assert all(one.tobytes() == other.tobytes() for one, other in zip(*states, strict=True))
    assert worlds[0].groups[0].position.tobytes() != teams(policy, cycle=cycle).groups[0].position.tobytes()


@pytest.mark.parametrize("strict", [True, False])
def test_in_no_crowd_is_there_a_bump(strict: bool) -> None:
    bumps, way = 0, 0.0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        radius, speed = rng.uniform(0.05, 0.3, 60), rng.uniform(0.02, 0.4, 60)
        side = math.sqrt(math.pi * (radius**2).sum() / 0.25)
        world = World(Torus(side, side), contact="stop", rng=seed)
        policy = Avoiding("random-walk", strict=strict, margin=0.1, horizon=[1.0, 10.0][seed % 2], neighbours=32)
        robots = world.add(
            Robot, 60, policy=policy, radius=radius, speed=speed, awareness="pairwise", awareness_range=0.45 * side
        )
        world.run(200)
        bumps += int(robots.bumps.sum())
        way += float(np.hypot(*robots.bodies.moved.T).mean())
    assert (bumps == 0) == strict
    assert way > 0.05


def test_targets_are_avoided_if_asked() -> None:
    bumps = []
    for targets in (False, True):
        world = World(Torus(8.0, 8.0), contact="stop", rng=1)
        robots = world.add(
            Robot, 15, policy=Avoiding("random-walk", targets=targets), radius=0.2, speed=0.2, awareness="pairwise",
            awareness_range=2.0, sensing_range=2.0,
        )  # fmt: skip
        prey = world.add(Target, 15, policy="random-walk", radius=0.2, speed=0.1)
        world.senses(robots, prey)
        world.run(300)
        bumps.append(int(robots.bumps.sum()))
    assert bumps[0] > 100
    # Targets still drive into robots.
    assert bumps[1] < 0.02 * bumps[0]


def wander(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return float(rng.uniform(-0.5, 0.5)), percept.speed


@pytest.mark.parametrize("policy", ["a-cmommt", RandomWalk(0.1), wander], ids=["name", "object", "function"])
def test_any_policy_is_wrapped(policy: Any) -> None:
    avoiding = Avoiding(policy, targets=True)
    check_policy(avoiding)
    assert pickle.loads(pickle.dumps(avoiding)) == avoiding
    found = []
    for _ in range(2):
        model = CMOMMT(
            robots=8, targets=4, policy=avoiding, awareness="pairwise", robot_radius=0.2, contact="stop", radius=4.0, rng=2
        )
        model.run(40)
        found.append(model.robots.position.tobytes())
        assert model.robots.bumps.sum() == 0
    assert found[0] == found[1]


@kernel
def _shows_what_it_gets(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    first, second = arrays.parameters
    for i in range(len(percept.heading)):
        arrays.state.floats[i, 0, 0] += first + second + arrays.table[0, 1]
        go(action, i, noise[0, i], 1.0, 0.0)


@dataclass(frozen=True)
class Declares(CompiledPolicy):
    """A policy with parameters, a table, state, noise and declarations.

    Parameters
    ----------
    first, second : float
        Its parameters.
    """

    first: float = 1.0
    second: float = 2.0

    kernel, draws, columns, shows, needs, effort = _shows_what_it_gets, 1, ("load", "speed"), ("sum",), ("targets",), 7

    @property
    def table(self) -> Any:
        return np.array([[0.0, 4.0]], np.float32)

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size, 1, 1)), np.zeros((size, 0, 0), np.int64))


def test_what_the_wrapped_policy_declares_it_gets() -> None:
    avoiding = Avoiding(Declares())
    assert (avoiding.draws, avoiding.shows, avoiding.effort) == (1, ("sum",), 7)
    assert avoiding.columns == ("load", "speed", "moved_x", "moved_y", "radius")
    assert avoiding.needs == ("targets", "identities")
    assert replace(avoiding, horizon=3.0).policy == Declares()
    check_policy(avoiding)
    world = World(Box(5.0, 5.0), rng=1)
    robots = world.add(Robot, 3, policy=avoiding, radius=0.1, awareness="pairwise")
    robots.add_column("load", 0.5)
    world.senses(robots, world.add(Target, 1, policy="stationary"))
    world.run(5)
    assert world.path == "compiled"
    assert robots.policy_state.floats[:, 0, 0].tolist() == [35.0] * 3


def test_a_degree_that_hides_who_teammates_are_is_refused() -> None:
    with pytest.raises(ValueError, match="needs 'identities', which awareness 'ring' does not deliver; use awareness='nearest'|'pairwise'"):
        CMOMMT(policy=Avoiding("random-walk"), awareness="ring")


def test_a_percept_that_does_not_say_who_the_robots_are_is_refused() -> None:
    one, policy = crowd(1, 3, 0.1), Avoiding(STEERED)
    with pytest.raises(ValueError, match="does not say who the robots are.*give percept.identity"):
        policy.decide(one.percept(policy)._replace(identity=np.full(3, -1)), one.state(), np.zeros((0, 3)))


@pytest.mark.parametrize(
    ("policy", "text"),
    [
        ("a-cmomt", "policy='a-cmomt': unknown; did you mean 'a-cmommt'"),
        (RandomWalk, "policy=.*RandomWalk.*: must be the name of a policy, a Policy, or a function"),
        (3, "policy=3: must be the name of a policy"),
        (Avoiding("random-walk"), "policy=.*: avoids already; give the policy that it wraps"),
    ],
)
def test_what_is_no_policy_is_refused(policy: Any, text: str) -> None:
    with pytest.raises((TypeError, ValueError), match=text):
        Avoiding(policy)


def test_an_action_that_is_no_number_is_left_for_the_check_of_actions() -> None:
    # Two that overlap, so that what they prefer is not safe.
    one, policy = Crowd([[0, 0], [0.5, 0]], np.zeros((2, 2)), np.zeros((2, 2)), 0.5, 0.3), Avoiding(STEERED)
    for part in range(3):
        state = np.zeros((2, 1, 3))
        state[0, 0, part] = math.nan
        action, _ = policy.decide(one.percept(policy), PolicyState(state, np.zeros((2, 0, 0), np.int64)), np.zeros((0, 2)))
        assert math.isnan(np.column_stack([*action])[0, part])
        assert action.distance[1] > 0


def test_an_action_of_a_policy_in_python_that_cannot_be_carried_out_is_named() -> None:
    class Wrong(Policy):
        def decide(self, percept: Any, state: Any, noise: Any) -> Any:
            return Action(2.0 * percept.heading, percept.speed), state

    one, policy = crowd(1, 3, 0.1), Avoiding(Wrong())
    with pytest.raises(ValueError, match="Wrong: action.heading of robot 0 has the length 2"):
        policy.decide(one.percept(policy), None, np.zeros((0, 3)))


class Rests(Policy):
    """Stays where it is; without fields, so that its repr is an address."""

    def decide(self, percept: Any, state: Any, noise: Any) -> Any:
        return Action(np.zeros((len(percept.heading), 2)), np.zeros(len(percept.heading))), state


@pytest.mark.short
def test_a_state_of_another_wrapped_policy_is_refused() -> None:
    def made(name: str) -> World:
        kind = type(name, (Rests,), {})
        world = World(Box(8.0, 8.0), rng=1)
        world.add(Robot, 4, policy=Avoiding(kind()), awareness="pairwise", radius=0.1)
        world.run(2)
        return world

    state = made("One").state()
    made("One").restore(state)
    with pytest.raises(ValueError, match="policy=One, and robots have policy=Two"):
        made("Two").restore(state)
