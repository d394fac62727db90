"""Motor schemas: vectors, the automaton, and what robots communicate."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight.core.kernel import plain
from teamsight.policies.check import check_policy
from teamsight.policies.schemas import (
    ACQUIRE,
    FOLLOW,
    WANDER,
    WORK,
    ForageSchemas,
    GrazeSchemas,
    avoid_obstacles,
    repulsion,
)
from teamsight.tasks.foraging import Forage

OBSTACLES = ((3.0, 1.0, 1.0), (-2.0, 0.5, 2.0))


@pytest.mark.parametrize("communication", ["none", "state", "goal"])
@pytest.mark.parametrize("kind", [ForageSchemas, GrazeSchemas])
def test_they_keep_the_contract(kind: Any, communication: str) -> None:
    check_policy(kind(communication, OBSTACLES))


@pytest.mark.parametrize(("distance", "expected"), [(0.0, 1.0), (1.0, 0.75), (4.0, 0.0), (9.0, 0.0), (-1.0, 1.0)])
def test_repulsion_is_linear(distance: float, expected: float) -> None:
    assert plain(repulsion)(distance, 4.0) == expected


@settings(max_examples=25)
@given(x=st.floats(-6, 6), y=st.floats(-6, 6))
def test_obstacles_repel_by_the_sum_of_their_vectors(x: float, y: float) -> None:
    table = np.array(OBSTACLES)
    expected = np.zeros(2)
    for centre_x, centre_y, radius in OBSTACLES:
        away = np.array([x - centre_x, y - centre_y])
        gap = np.linalg.norm(away) - radius
        if gap < 2.0 and np.linalg.norm(away) > 0:
            expected += min((2.0 - gap) / 2.0, 1.0) * away / np.linalg.norm(away)
    assert plain(avoid_obstacles)(-x, -y, table, 2.0) == pytest.approx(tuple(expected), abs=1e-9)


def world(communication: str, awareness: str = "pairwise") -> Any:
    """Return a world in which robot 0 senses the only attractor, and robot 1 senses none."""
    made = Forage(
        2, attractors=1, obstacles=0.0, sensing_range=6.0, communication=communication, awareness=awareness, rng=1
    )
    made.robots[0].position, made.robots[1].position = (20.0, 20.0), (-20.0, 20.0)
    made.attractors[0].position = (25.0, 20.0)
    return made


def modes(made: Any) -> list[float]:
    return [float(mode) for mode in made.robots.policy_state.floats[:, 0, 0]]


@pytest.mark.parametrize(
    ("communication", "awareness", "expected"),
    [("none", "pairwise", WANDER), ("state", "pairwise", FOLLOW), ("goal", "pairwise", FOLLOW), ("goal", "none", WANDER)],
)
def test_a_robot_follows_one_whose_state_it_perceives(communication: str, awareness: str, expected: float) -> None:
    made = world(communication, awareness)
    made.run(1)
    # It perceives what the other decided at the step before.
    assert modes(made) == [ACQUIRE, WANDER]
    made.run(1)
    assert modes(made)[1] == expected


def test_a_goal_is_a_place() -> None:
    made = world("goal")
    made.run(2)
    goal = made.robots.policy_state.floats[:, 0, 1:3]
    assert goal == pytest.approx(np.array([[25.0, 20.0], [25.0, 20.0]]), abs=1e-9)
    state = world("state")
    state.run(2)
    assert state.robots.policy_state.floats[1, 0, 1:3] != pytest.approx([25.0, 20.0], abs=0.5)


def test_a_robot_that_delivers_shows_where_its_attractor_is() -> None:
    made = world("goal")
    while not made.robots.attached.values[0]:
        made.step()
    made.run(1)
    place = made.robots.bodies.position[0].copy()
    made.run(1)
    assert modes(made)[0] == WORK
    assert made.robots.policy_state.floats[0, 0, 1:3] == pytest.approx(place)
    assert np.linalg.norm(made.robots.bodies.position[0]) < np.linalg.norm(place)


def test_attached_robots_deliver_and_then_wander() -> None:
    made = world("none")
    seen = set()
    for _ in range(150):
        made.step()
        seen.add(modes(made)[0])
        if made.recording.history["delivered"].sum():
            break
    assert seen == {ACQUIRE, WORK}
    assert made.recording.history["delivered"].sum() == 1
    made.step()
    assert WANDER in modes(made)


def test_obstacles_without_a_radius_are_named() -> None:
    with pytest.raises(ValueError, match=r"obstacles=.*\(x, y, radius\)"):
        ForageSchemas(obstacles=((1.0, 2.0),))  # type: ignore[arg-type]


def test_noise_persists() -> None:
    made = Forage(1, attractors=1, obstacles=0.0, sensing_range=0.1, rng=3)
    turns = []
    for _ in range(24):
        before = made.robots.policy_state.floats[0, 0, 3:5].copy()
        made.step()
        turns.append(not np.array_equal(before, made.robots.policy_state.floats[0, 0, 3:5]))
    assert np.flatnonzero(turns).tolist() == [0, 8, 16]
    assert math.hypot(*made.robots.policy_state.floats[0, 0, 3:5]) == pytest.approx(1.0)
