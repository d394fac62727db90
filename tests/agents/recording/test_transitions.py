"""Transitions are what a naive observer of positions would write down, on both paths."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.agents.group import Group
from teamsight.agents.recording.transitions import FACTS, Transitions
from teamsight.policies import RandomWalk

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

WALK = RandomWalk(random_distance=True)
STEPS = 40


def paper(**settings: Any) -> World:
    given = {"robots": 5, "targets": 10, "radius": 2.0, "policy": WALK, "awareness": "ring", "rng": 3} | settings
    return CMOMMT(**given)


def two_groups(arena: Any) -> World:
    """A team of two groups, one of them near-sighted and slow to turn, and one that stands on no team."""
    world = World(arena, rng=5)
    keen = world.add(Robot, 4, policy="a-cmommt", awareness="shared", sensing_range=np.array([0.5, 0.8, 1.0, 1.2]))
    dull = world.add(Robot, 3, policy=WALK, awareness="pairwise", sensing_range=0.7, turn_limit=0.4, name="dull")
    first = world.add(Target, 6, policy=RandomWalk(0.1), speed=0.09)
    second = world.add(Target, 4, policy="stationary", name="second")
    world.senses(dull, second)
    for group in (first, second):
        world.senses(keen, group)
    return world


def sensed(world: World, group: Group) -> list[set[int]]:
    """Whom each robot of a group senses, from positions alone."""
    found = []
    observed = group.channels["targets"].observed if "targets" in group.channels else []
    for place, reach in zip(group.position, group.sensing_range, strict=True):
        seen = set()
        for other in observed:
            for identity, there in zip(other.identity.tolist(), other.position, strict=True):
                way = [d - p * round(d / p) if p else d for d, p in zip(there - place, world.arena.period, strict=True)]
                if math.hypot(*way) <= reach:
                    seen.add(identity)
        found.append(seen)
    return found


def alone(mine: list[set[int]], everyone: list[set[int]]) -> list[set[int]]:
    """What each senses that nobody else of the team does."""
    return [{target for target in seen if sum(target in other for other in everyone) == 1} for seen in mine]


def naive(world: World, group: Group, steps: int) -> Transitions:
    """Make steps and write down what a group meets."""
    team = [other for other in world.groups if other is group or (group.team and other.team == group.team)]
    rows: list[list[Any]] = [[], [], [], []]
    for _ in range(steps):
        before = [agent.situation.copy() for agent in group]
        heading = group.heading.copy()
        was = sensed(world, group)
        was_all = [seen for other in team for seen in sensed(world, other)]
        was_alone, was_team = alone(was, was_all), set().union(*was_all)
        world.step()
        now = sensed(world, group)
        now_all = [seen for other in team for seen in sensed(world, other)]
        now_alone, now_team = alone(now, now_all), set().union(*now_all)
        for i, agent in enumerate(group):
            aim = complex(*group.action.heading[i]) or complex(*heading[i])
            turn = np.angle(aim / complex(*heading[i]))
            limit = math.atan2(group.bodies.turn_sine[i], group.bodies.turn_cosine[i])
            turn = turn if group.bodies.turn_cosine[i] < -1 else max(-limit, min(turn, limit))
            rows[0].append(before[i])
            rows[1].append([turn, min(max(group.action.distance[i], 0) / group.speed[i], 1)])
            rows[2].append(agent.situation.copy())
            facts = []
            for then, after in ((was[i], now[i]), (was_alone[i], now_alone[i]), (was_team, now_team)):
                facts += [len(after), len(after - then), len(then - after)]
            rows[3].append(facts)
    arrays = [np.array(part, np.float32) for part in rows]
    return Transitions(*arrays[:3], {name: arrays[3][:, k] for k, name in enumerate(FACTS)})


def close(one: Transitions, other: Transitions) -> None:
    assert np.array_equal(one.situation, other.situation)
    assert np.array_equal(one.next_situation, other.next_situation)
    turned = np.angle(np.exp(1j * (one.action[:, 0] - other.action[:, 0])))
    assert np.abs(turned).max() < 1e-6
    assert np.abs(one.action[:, 1] - other.action[:, 1]).max() < 1e-6
    assert list(one.facts) == list(other.facts) == list(FACTS)
    for name in FACTS:
        assert np.array_equal(one.facts[name], other.facts[name]), name


def bits(transitions: Transitions) -> list[bytes]:
    return [array.tobytes() for array in (*transitions[:3], *transitions.facts.values())]


def lazy(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    """A policy for one robot, in Python, that wants to go too far and now and then backwards."""
    return rng.uniform(-4, 4), rng.uniform(-0.1, 0.2)


WORLDS: dict[str, Callable[[], World]] = {
    "ring": paper,
    "none": lambda: paper(awareness="none", robots=1),
    "pairwise": lambda: paper(awareness="pairwise", radius=1.0),
    "shared, crowded": lambda: paper(awareness="shared", robots=8, radius=1.0, targets=40),
    "a policy that needs situations no less": lambda: paper(policy="a-cmommt", target_policy="evasive"),
    "a policy in Python": lambda: paper(policy=lazy),
    "disc": lambda: two_groups(Disc(1.5)),
    "box": lambda: two_groups(Box(3, 2)),
    "torus": lambda: two_groups(Torus(3, 4)),
}


@pytest.mark.parametrize("name", WORLDS)
def test_transitions_are_what_an_observer_of_positions_writes_down(name: str) -> None:
    running, watched = WORLDS[name](), WORLDS[name]()
    for group in running.groups:
        running.recording.record_transitions(group)
    running.run(STEPS)
    for number, group in enumerate(running.groups):
        if group.team is not None:
            expected = naive(watched, watched.groups[number], STEPS)
            watched.reset(watched.seed_used)
            close(running.recording.transitions(group), expected)
            assert len(expected.situation) == STEPS * len(group)


def test_the_naive_observer_sees_every_fact_happen() -> None:
    world = paper()
    facts = naive(world, world.groups[0], 120).facts
    assert all(fact.sum() > 0 for fact in facts.values())


@pytest.mark.short
@pytest.mark.parametrize("name", ["ring", "shared, crowded", "torus", "a policy in Python"])
def test_both_paths_record_the_same_bits(name: str) -> None:
    def recorded(path: Callable[[World], Any]) -> list[bytes]:
        world = WORLDS[name]()
        world.recording.record_transitions(world.groups[0])
        path(world)
        return bits(world.recording.transitions(world.groups[0]))

    once = recorded(lambda world: world.run(STEPS))
    assert recorded(lambda world: [world.step() for _ in range(STEPS)]) == once
    assert recorded(lambda world: [world.run(k) for k in (1, 0, 30, 9)]) == once
    assert recorded(lambda world: (world.run(7), world.step(), world.run(STEPS - 8))) == once
    again = WORLDS[name]()
    again.recording.record_transitions(again.groups[0])
    again.run(3)
    again.reset(again.seed_used)
    again.run(STEPS)
    assert bits(again.recording.transitions(again.groups[0])) == once


def test_recording_changes_nothing() -> None:
    plain, recorded = paper(), paper()
    recorded.recording.record_transitions(recorded.robots)
    for world in (plain, recorded):
        world.run(STEPS)
    assert plain.recording.history.equals(recorded.recording.history)
    assert np.array_equal(plain.robots.position, recorded.robots.position)


def test_a_robot_that_leaves_takes_its_pairs_no_further() -> None:
    world = paper()
    world.recording.record_transitions(world.robots)
    world.clock.at(10, lambda: world.robots[2].remove())
    world.clock.at(20, lambda: setattr(world.robots[0], "position", (0.1, 0.2)))
    world.run(30)
    met = world.recording.transitions(world.robots)
    assert len(met.situation) == 10 * 5 + 20 * 4
    # Who is put somewhere by hand begins its next pair there; all others go on where they were.
    last, first = met.next_situation[50:].reshape(20, 4, -1)[:-1], met.situation[50:].reshape(20, 4, -1)[1:]
    moved = (last != first).any(axis=2)
    assert moved[9, 0]
    assert not np.delete(moved, 9, axis=0).any()


def test_only_a_ring_stays_as_wide_as_it_is_when_the_team_grows() -> None:
    for degree, fits in (("ring", True), ("pairwise", False)):
        world = paper(awareness=degree)
        world.recording.record_transitions(world.robots)
        world.run(5)
        world.add(Robot, 2, policy=WALK, name="late")
        world.run(5)
        if fits:
            assert len(world.recording.transitions(world.robots).situation) == 50
        else:
            with pytest.raises(ValueError, match=r"24 and 28 inputs.*use RingAwareness"):
                world.recording.transitions(world.robots)


def test_rotations_lie_within_half_a_turn() -> None:
    world = paper(policy=lambda percept, rng: (math.pi if rng.random() < 0.5 else -math.pi, 0.05))
    world.recording.record_transitions(world.robots)
    world.run(20)
    rotation = world.recording.transitions(world.robots).action[:, 0]
    assert (rotation > 0).all()
    assert (np.abs(rotation - np.float32(math.pi)) < 1e-6).all()


def test_what_was_not_recorded_is_asked_for_in_vain() -> None:
    world, other = paper(), paper()
    with pytest.raises(ValueError, match=r"none were recorded; call record_transitions"):
        world.recording.transitions(world.robots)
    with pytest.raises(ValueError, match="must be a group that was added to this world"):
        world.recording.record_transitions(other.robots)
    world.recording.record_transitions(world.robots)
    assert world.recording.transitions(world.robots).situation.shape == (0, 32)
