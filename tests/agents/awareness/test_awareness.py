"""The degrees of awareness: each shows a policy what it says, no more, in as many inputs as it says."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from naive import paper as naive

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.agents.awareness import (
    AWARENESS,
    Awareness,
    NearestAwareness,
    NoAwareness,
    PairwiseAwareness,
    RingAwareness,
    SharedAwareness,
)
from teamsight.core.kernel import kernel
from teamsight.policies import Stationary
from teamsight.policies.interface import Action, Policy

DEGREES: list[Awareness] = [
    NoAwareness(),
    RingAwareness(16),
    RingAwareness(5),
    RingAwareness(1),
    NearestAwareness(16),
    NearestAwareness(3),
    NearestAwareness(1),
    PairwiseAwareness(),
    SharedAwareness(),
]

seeds = st.integers(0, 2**31)
shapes = st.sampled_from(["disc", "square"])


def crowd(awareness: Awareness | str, seed: int, teams: tuple[int, ...] = (4, 3), shape: Any = "disc") -> World:
    """Robots of one team in two groups, with ranges of their own, among targets."""
    world = World(Disc(1.2), rng=seed)
    targets = world.add(Target, 6, policy=Stationary())
    for size in teams:
        ranges = np.random.default_rng(seed).uniform(0.3, 1.5, (2, size))
        robots = world.add(
            Robot, size, policy=Stationary(), awareness=awareness, sensing_range=ranges[0], awareness_range=ranges[1],
            range_shape=shape,
        )  # fmt: skip
        world.senses(robots, targets)
    return world


def robots_of(world: World) -> list[Any]:
    return [agent for group in world.groups for agent in group if isinstance(agent, Robot)]


def way(one: Any, other: Any) -> tuple[float, float]:
    x, y = (other.position - one.position).tolist()
    return x, y


def within(one: Any, others: list[Any], reach: float) -> list[Any]:
    def apart(other: Any) -> float:
        x, y = way(one, other)
        return max(abs(x), abs(y)) if one.group.range_shape == "square" else math.hypot(x, y)

    return [other for other in others if other is not one and apart(other) <= reach]


def reach_of(robot: Any, kind: str) -> float:
    return float(getattr(robot.group, f"{kind}_range")[robot.row])


def farthest(robot: Any, kind: str) -> float:
    """The largest distance in range."""
    return reach_of(robot, kind) * (math.sqrt(2) if robot.group.range_shape == "square" else 1.0)


@pytest.mark.short
@given(seeds, shapes)
def test_neighbours_and_targets_are_those_within_range(seed: int, shape: str) -> None:
    world = crowd("none", seed, shape=shape)
    robots, targets = robots_of(world), list(world.groups[0])
    for robot in robots:
        assert robot.neighbours == within(robot, robots, reach_of(robot, "awareness"))
        assert robot.observed_targets == within(robot, targets, reach_of(robot, "sensing"))
    for target in targets:
        assert target.observers == [robot for robot in robots if target in robot.observed_targets]
        assert target.is_observed == bool(target.observers)


@pytest.mark.parametrize("awareness", DEGREES, ids=str)
@given(seed=seeds, shape=shapes)
def test_what_a_policy_is_shown(awareness: Awareness, seed: int, shape: str) -> None:
    world = crowd(awareness, seed, shape=shape)
    for robot in robots_of(world):
        percept = robot.percept
        assert percept.targets.identity.tolist() == [target.unique_id for target in robot.observed_targets]
        assert np.allclose(percept.targets.offset, np.reshape([way(robot, t) for t in robot.observed_targets], (-1, 2)))
        teammates = [way(robot, teammate) for teammate in robot.neighbours]
        if isinstance(awareness, NoAwareness):
            assert len(percept.teammates.identity) == 0
        elif isinstance(awareness, RingAwareness):
            shown = naive.ring_view(teammates, robot.heading.tolist(), awareness.delta)
            assert np.allclose(percept.teammates.offset, np.reshape(shown, (-1, 2)), atol=1e-9)
            assert np.all(percept.teammates.identity == -1)
        elif isinstance(awareness, NearestAwareness):
            shown = naive.nearest(teammates, awareness.delta)
            assert np.allclose(percept.teammates.offset, np.reshape(shown, (-1, 2)))
            assert np.all(percept.teammates.identity == -1)
        else:
            assert percept.teammates.identity.tolist() == [teammate.unique_id for teammate in robot.neighbours]
            assert np.allclose(percept.teammates.offset, np.reshape(teammates, (-1, 2)))
        relayed = []
        if isinstance(awareness, SharedAwareness):
            relayed = [(target, way(robot, target)) for teammate in robot.neighbours for target in teammate.observed_targets]
        assert percept.relayed.identity.tolist() == [target.unique_id for target, _ in relayed]
        assert np.allclose(percept.relayed.offset, np.reshape([offset for _, offset in relayed], (-1, 2)))
        for seen in (percept.targets, percept.teammates, percept.relayed):
            assert np.allclose(seen.distance, np.hypot(*seen.offset.T))


def bearing(robot: Any, there: tuple[float, float]) -> float:
    """Anticlockwise from the heading, as a fraction of a full turn."""
    return (math.atan2(there[1], there[0]) - math.atan2(robot.heading[1], robot.heading[0])) / (2 * math.pi) % 1


def situation(robot: Any, team: list[Any], awareness: Awareness) -> list[float]:
    """The vector of §8, as the class says it."""

    def own(of: Any) -> list[float]:
        return naive.ring([way(of, t) for t in of.observed_targets], of.heading.tolist(), 16, farthest(of, "sensing"))

    inputs, near, reach = own(robot), robot.neighbours, farthest(robot, "awareness")
    if isinstance(awareness, RingAwareness):
        return inputs + naive.ring([way(robot, teammate) for teammate in near], robot.heading.tolist(), awareness.delta, reach)
    if isinstance(awareness, NearestAwareness):
        listed = naive.nearest([way(robot, teammate) for teammate in near], awareness.delta)
        shown = [part for one in listed for part in (math.hypot(*one) / reach, bearing(robot, one))]
        return inputs + shown + [1.0] * (2 * awareness.delta - len(shown))
    for teammate in (teammate for teammate in team if teammate is not robot):
        if isinstance(awareness, PairwiseAwareness):
            there = way(robot, teammate)
            inputs += [math.hypot(*there) / reach, bearing(robot, there)] if teammate in near else [1.0, 1.0]
        elif isinstance(awareness, SharedAwareness):
            inputs += own(teammate) if teammate in near else [1.0] * 16
    return inputs


@pytest.mark.short
@pytest.mark.parametrize("awareness", DEGREES, ids=str)
@given(seed=seeds, shape=shapes)
def test_the_situation_is_the_vector_of_the_paper(awareness: Awareness, seed: int, shape: str) -> None:
    world = crowd(awareness, seed, shape=shape)
    team = robots_of(world)
    for robot in team:
        found = robot.situation
        assert found.dtype == np.float32
        assert found.shape == (sum(awareness.width(len(team))),)
        assert found == pytest.approx(situation(robot, team, awareness), abs=1e-6)


@pytest.mark.parametrize("awareness", DEGREES, ids=str)
def test_the_situation_follows_when_somebody_is_moved_or_turned(awareness: Awareness) -> None:
    world = crowd(awareness, 1)
    world.run(3)
    team = robots_of(world)
    for change in ("position", "heading"):
        before = [robot.situation for robot in team]
        target = team[0].observed_targets[0] if team[0].observed_targets else world.groups[0][0]
        setattr(team[0] if change == "heading" else target, change, (0.3, -0.2))
        for robot in team:
            assert robot.situation == pytest.approx(situation(robot, team, awareness), abs=1e-6)
        assert any(not np.array_equal(a, robot.situation) for a, robot in zip(before, team, strict=True))


@pytest.mark.parametrize("team_size", [1, 2, 30])
def test_widths(team_size: int) -> None:
    others = team_size - 1
    widths = {"none": (16, 0), "ring": (16, 16), "pairwise": (16, 2 * others), "shared": (16, 16 * others)}
    assert {name: tuple(AWARENESS[name]().width(team_size)) for name in widths} == widths
    assert RingAwareness(7).width(team_size) == (16, 7)
    assert NearestAwareness(7).width(team_size) == (16, 14)


class Reader(Policy):
    """A NumPy policy that keeps the last percept that it was given."""

    draws = 0

    def __init__(self, inputs: int = 0, needs: tuple[str, ...] = ()) -> None:
        self.inputs, self.needs = inputs, needs
        self.seen: Any = None

    def start(self, size: int) -> None:
        pass

    def decide(self, percept: Any, memory: None, noise: Any) -> Any:
        self.seen = [np.array(part) for part in (*percept.targets, *percept.teammates, *percept.relayed, percept.situation)]
        return Action(np.zeros_like(percept.heading), np.zeros(len(percept.heading))), memory


@pytest.mark.filterwarnings("ignore:run.. makes")
@pytest.mark.parametrize("awareness", DEGREES, ids=str)
def test_in_a_step_a_policy_is_given_what_its_robots_say_they_perceive(awareness: Awareness) -> None:
    width = sum(awareness.width(8))
    reader = Reader(inputs=width)
    model = CMOMMT(robots=8, policy=reader, awareness=awareness, radius=1.5, rng=3)
    model.run(2)
    expected = copy.deepcopy([robot.percept for robot in model.robots])
    situations = [robot.situation for robot in model.robots]
    model.step()
    assert reader.seen[-1].shape == (8, width)
    assert np.array_equal(reader.seen[-1], situations)
    for kind in range(3):
        for field in range(3):
            parts = [percept[5 + kind][field] for percept in expected]
            assert np.array_equal(reader.seen[4 * kind + 1 + field], np.concatenate(parts))


MISFITS = [
    (
        "none",
        {"needs": ("teammates",)},
        r"policy=Reader: needs 'teammates', which awareness 'none' does not deliver; use awareness='ring' \(--awareness ring\)",
    ),
    (
        "pairwise",
        {"needs": ("relayed",)},
        r"needs 'relayed', which awareness 'pairwise' does not deliver; use awareness='shared' \(--awareness shared\)",
    ),
    (
        "none",
        {"needs": ("teammate",)},
        r"Reader\.needs='teammate': unknown; did you mean 'teammates'\?",
    ),
    ("none", {"inputs": 32}, r"reads 32 inputs, but awareness 'none' gives 16 in a team of 10; use awareness='ring'"),
    (
        "ring",
        {"inputs": 34},
        r"reads 34 inputs, but awareness 'ring' gives 32 in a team of 10; use awareness='pairwise' \(--awareness pairwise\)",
    ),
    ("shared", {"inputs": 16}, "use awareness='none'"),
    ("shared", {"inputs": 21}, r"use RingAwareness\(delta=5\) \(--awareness ring --delta 5\)"),
    ("shared", {"inputs": 48}, r"use awareness='nearest' \(--awareness nearest\)"),
    ("ring", {"inputs": 3}, r"train it for this width"),
]


@pytest.mark.parametrize(("awareness", "wants", "message"), MISFITS)
def test_a_policy_that_does_not_fit_is_refused_with_the_cure(
    awareness: str, wants: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        CMOMMT(policy=Reader(**wants), awareness=awareness)


def test_a_policy_that_fits_is_not_refused() -> None:
    CMOMMT(policy=Reader(inputs=16 + 18, needs=("teammates", "targets")), awareness="pairwise")


def test_degrees_change_what_robots_do() -> None:
    ends = {}
    for name in ("none", "ring", "nearest", "pairwise", "shared"):
        model = CMOMMT(awareness=name, delta=2, radius=2.0, rng=5)
        model.run(100)
        ends[name] = model.robots.position.tobytes()
    assert len(set(ends.values())) == 5


def line_of(delta: int, *places: tuple[float, float]) -> Any:
    """A robot at the origin, facing along x, and teammates at places around it."""
    world = World(Disc(5.0), rng=1)
    return world.add(
        Robot, 1 + len(places), policy=Stationary(), awareness=NearestAwareness(delta), awareness_range=2.0,
        position=[(0.0, 0.0), *places], heading=[(1.0, 0.0)] * (1 + len(places)),
    )[0]  # fmt: skip


def test_the_nearest_do_not_merge_and_those_as_near_come_by_identity() -> None:
    # Two ahead, of which the second is nearer, and three at the distance 1.
    robot = line_of(4, (0.5, 0.0), (0.25, 0.0), (0.0, 1.0), (0.0, -1.0), (-1.0, 0.0))
    assert robot.percept.teammates.offset.tolist() == [[0.25, 0.0], [0.5, 0.0], [0.0, 1.0], [0.0, -1.0]]
    assert robot.situation[16:].tolist() == [0.125, 0.0, 0.25, 0.0, 0.5, 0.25, 0.5, 0.75]


def test_places_of_the_list_that_nobody_takes_read_1() -> None:
    robot = line_of(3, (0.0, 1.0), (3.0, 0.0))
    assert robot.situation[16:].tolist() == [0.5, 0.25, 1.0, 1.0, 1.0, 1.0]
    assert len(robot.percept.teammates.distance) == 1


@pytest.mark.parametrize(("delta", "message"), [
    (0, "delta=0: must be at least 1; .*for no awareness use NoAwareness"),
    (10_001, "delta=10001: must be at most 10000; .* for all teammates PairwiseAwareness"),
])  # fmt: skip
def test_a_list_of_a_wrong_length_is_refused(delta: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        NearestAwareness(delta)


def test_the_list_that_adds_a_number_of_inputs() -> None:
    assert NearestAwareness.adding(8) == NearestAwareness(4)
    assert NearestAwareness.dimensions(16, 4, 2, 30) == 24


@pytest.mark.parametrize("delta", [10**9, 10_001, 10**400])
def test_a_ring_of_more_sectors_than_fit_in_memory_is_refused(delta: int) -> None:
    for make in (lambda: RingAwareness(delta), lambda: CMOMMT(robots=2, awareness="ring", delta=delta)):
        with pytest.raises(ValueError, match=r"^delta=.*: must be at most 10000; .*of which 360"):
            make()
    assert RingAwareness(10_000).width(3) == (16, 10_000)


@kernel
def _one_more(scene: Any, parameters: Any, teammates: Any, relayed: Any) -> int:
    return relayed.distance.shape[0] + 1


class OneMore(NoAwareness):
    """Asks for one more than there is, always."""

    perceive = _one_more


@pytest.mark.parametrize("path", ["run", "step", "percept"])
def test_a_degree_that_never_has_enough_room_is_named(path: str) -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 3, policy="random-walk", awareness=OneMore())
    with pytest.raises(ValueError, match=r"awareness=.*perceive asks for more room on every call.*check_awareness\(\)"):
        world.run(5) if path == "run" else world.step() if path == "step" else robots[0].percept
    assert world.tick == 0
