"""Behaviours of robots that push a box, their arbitration, and their recovery."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Robot
from teamsight.agents.awareness import NearestAwareness
from teamsight.policies.braitenberg import FixedPriority
from teamsight.policies.braitenberg.vehicle import BEHAVIOUR, BEHAVIOURS, CUES, FOLLOW, RECOVERIES, SLOW
from teamsight.policies.braitenberg.vehicle import LAST_CUES as AT_CUES
from teamsight.policies.check import check_policy
from teamsight.tasks.pushing import BoxPushing
from tests.interactions import fingerprint
from tests.naive import braitenberg as twin

STRAIGHT = FixedPriority(swerve=0.0, recovery=False)


def test_it_keeps_the_contract() -> None:
    check_policy(FixedPriority())
    check_policy(FixedPriority(recovery=False, swerve=0.0))


def kept(world: Any) -> np.ndarray:
    return np.array(world.robots.policy_state.ints[:, 0])


def placed(robots: Any, box: Any = (0.0, 0.0), headings: Any = None, **options: Any) -> Any:
    """Return a world with robots at these places."""
    world = BoxPushing(len(robots), 60.0, rng=1, **{"policy": STRAIGHT} | options)
    world.box[0].position = box
    for row, place in enumerate(robots):
        world.robots[row].position = place
        if headings is not None:
            world.robots[row].heading = headings[row]
    return world


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), robots=st.integers(1, 8), spread=st.sampled_from([2.0, 4.0, 9.0]))
def test_cues_and_actions_are_those_of_the_slow_twin(seed: int, robots: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    place, box = rng.uniform(-spread, spread, (robots, 2)), rng.uniform(-14, 14, 2)
    angle = rng.uniform(0, 2 * math.pi, robots)
    heading = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    world = placed(place, box, heading)
    world.step()
    for i in range(robots):
        others = [place[j] - place[i] for j in range(robots) if j != i]
        load = box - place[i] if np.hypot(*(box - place[i])) <= 12.0 else None
        mate = twin.nearest(others, 6.0)
        found = twin.cues(STRAIGHT, heading[i], others, load, mate)
        assert {name for bit, name in enumerate(CUES) if kept(world)[i, AT_CUES] >> bit & 1} == found
        behaviour = twin.by_priority(found)
        assert BEHAVIOURS[kept(world)[i, BEHAVIOUR]] == behaviour
        turn, distance = twin.action(STRAIGHT, behaviour, heading[i], others, load, mate)
        expected = np.array([math.cos(angle[i] + turn), math.sin(angle[i] + turn)])
        assert world.robots.bodies.heading[i] == pytest.approx(expected, abs=1e-9)
        # Where the law of the box leaves it alone, it goes as far as it decided.
        if min([np.hypot(*one) for one in others] + [99.0]) > 2.5 and (load is None or np.hypot(*load) > 4):
            assert np.hypot(*(world.robots.bodies.position[i] - place[i])) == pytest.approx(0.5 * distance, abs=1e-9)


def test_a_robot_finds_and_pushes_the_box() -> None:
    world = placed([(-9.0, 3.0)], headings=[(0.0, 1.0)])
    world.run(60, progress=False)
    assert world.recording.history["pushing"].iloc[-20:].tolist() == [1] * 20
    assert np.hypot(*world.robots.bodies.position[0]) == pytest.approx(2.5)


def test_robots_face_to_face_pass_each_other() -> None:
    world = placed([(-25.0, 20.0), (-21.0, 20.0)], (20.0, -20.0), [(1.0, 0.0), (-1.0, 0.0)], awareness="none")
    seen = set()
    for _ in range(60):
        world.step()
        seen |= set(kept(world)[:, BEHAVIOUR].tolist())
    place = world.robots.bodies.position
    assert seen == {BEHAVIOURS.index("avoid"), BEHAVIOURS.index("find")}
    assert np.hypot(*(place[0] - place[1])) > 4.0


@pytest.mark.parametrize(("awareness", "expected"), [("pairwise", {FOLLOW, SLOW}), ("none", set())])
def test_follow_and_slow_need_awareness(awareness: str, expected: set[int]) -> None:
    places = [(-25.0, 20.0), (-21.0, 20.0), (-25.0, 0.0), (-22.5, 0.0)]
    world = placed(places, (20.0, -20.0), [(1.0, 0.1), (1.0, 0.0)] * 2, awareness=awareness)
    world.step()
    assert set(kept(world)[:, BEHAVIOUR].tolist()) & {FOLLOW, SLOW} == expected


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), robots=st.integers(2, 15), recovery=st.booleans())
def test_more_than_the_nearest_teammate_changes_nothing(seed: int, robots: int, recovery: bool) -> None:
    degrees = ("pairwise", NearestAwareness(1), NearestAwareness(3))
    found = []
    for degree in degrees:
        world = BoxPushing(robots, 30.0, recovery=recovery, awareness=degree, rng=seed)
        world.run(300, progress=False)
        found.append(fingerprint(world))
    assert found[0] == found[1] == found[2]


def alone(**options: Any) -> Any:
    """Return a world in which one robot pushes the box in vain."""
    world = placed([(-2.5, 0.0)], headings=[(1.0, 0.0)], policy=FixedPriority(patience=8, **options))
    return world


def test_recovery_turns_the_push_and_then_goes_round() -> None:
    world, behaviours, turns = alone(), [], []
    for _ in range(80):
        offset = -world.robots.bodies.position[0]
        world.step()
        state = kept(world)[0]
        behaviours.append(int(state[BEHAVIOUR]))
        if state[BEHAVIOUR] < 0:
            turns.append((int(state[RECOVERIES]), twin.bearing(offset, world.robots.bodies.heading[0])))
    # It recovers at the eighth step in vain, for eight steps.
    assert [one < 0 for one in behaviours[:16]] == [False] * 7 + [True] * 8 + [False]
    assert all(abs(turn) <= math.pi / 4 + 1e-9 for number, turn in turns if number % 2 == 1)
    assert [abs(turn) for number, turn in turns if number % 2 == 0] == pytest.approx([math.pi / 2] * 16)
    assert {number for number, _ in turns} == {1, 2, 3, 4, 5}


def test_a_box_that_moves_is_not_pushed_in_vain() -> None:
    angles = math.pi + np.array([-0.45, 0.0, 0.45])
    places = 2.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    world = placed(places, headings=-places, policy=FixedPriority(patience=8))
    for _ in range(30):
        world.step()
        assert (kept(world)[:, BEHAVIOUR] >= 0).all()
    assert world.recording.history["box_moved"].sum() > 2


def test_without_recovery_it_pushes_for_ever() -> None:
    world = alone(recovery=False)
    world.run(100, progress=False)
    assert world.recording.history["pushing"].sum() == 100
    assert kept(world)[0, BEHAVIOUR] == BEHAVIOURS.index("goal")


def test_it_needs_to_sense_obstacles() -> None:
    from teamsight import Box, Target, World

    world = World(Box(20, 20), rng=1)
    robots = world.add(Robot, 2, policy=FixedPriority())
    world.senses(robots, world.add(Target, 1, policy="stationary"))
    with pytest.raises(ValueError, match=r"reads the channel 'obstacles'.*as_='obstacles'"):
        world.run(1)
