"""Motion: turning and speed limits, and actions that are no numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import paper as naive

from teamsight.core.kernel import plain
from teamsight.core.table import Table
from teamsight.world.arena import Box
from teamsight.world.motion import advance_entry, bodies_at, is_action, pack_move, turn_limit

angles = st.floats(-math.pi, math.pi)


def moved(angle: float, limit: float, speed: float, action: tuple[float, float, float]) -> tuple[int, Table]:
    """Let one body in the middle of a large box act: face (x, y), go that far."""
    cosine, sine = turn_limit(limit)
    bodies = bodies_at(np.zeros((1, 2)), np.array([[math.cos(angle), math.sin(angle)]]))
    bodies.moved[:], bodies.speed[:], bodies.turn_cosine[:], bodies.turn_sine[:] = 1, speed, cosine, sine
    move = pack_move(Box(1000, 1000), bodies, np.array([action[:2]], float), np.array([action[2]], float))
    return advance_entry(Box(1000, 1000))(move), bodies


@pytest.mark.short
@given(angle=angles, aim=angles, limit=st.floats(0, 4), speed=st.floats(0, 5), distance=st.floats(-1, 10))
def test_a_body_turns_and_goes_as_far_as_it_can(
    angle: float, aim: float, limit: float, speed: float, distance: float
) -> None:
    assume(abs(abs(math.remainder(aim - angle, 2 * math.pi)) - math.pi) > 1e-6)  # Straight behind is the next test.
    status, bodies = moved(angle, limit, speed, (math.cos(aim), math.sin(aim), distance))
    heading = naive.turn((math.cos(angle), math.sin(angle)), (math.cos(aim), math.sin(aim)), limit)
    assert status == 0
    assert bodies.heading[0] == pytest.approx(heading, abs=1e-9)
    assert bodies.position[0] == pytest.approx(np.multiply(heading, min(max(distance, 0), speed)), abs=1e-8)
    assert np.array_equal(bodies.moved, bodies.position)


@pytest.mark.parametrize("limit", [0.3, 1.0])
def test_an_aim_straight_behind_is_turned_to_on_the_left(limit: float) -> None:
    _, bodies = moved(0.0, limit, 1.0, (-1.0, 0.0, 0.0))
    assert bodies.heading[0] == pytest.approx((math.cos(limit), math.sin(limit)))


def test_no_aim_keeps_the_heading_and_still_goes() -> None:
    _, bodies = moved(1.0, 0.1, 1.0, (0.0, 0.0, 0.7))
    assert bodies.heading[0] == pytest.approx((math.cos(1.0), math.sin(1.0)))
    assert bodies.position[0] == pytest.approx((0.7 * math.cos(1.0), 0.7 * math.sin(1.0)))


def test_headings_stay_unit_vectors_through_many_turns() -> None:
    cosine, sine = turn_limit(0.37)
    bodies = bodies_at(np.zeros((1, 2)), np.array([[1.0, 0.0]]))
    bodies.turn_cosine[:], bodies.turn_sine[:] = cosine, sine
    heading = bodies.heading
    aim = np.zeros((1, 2))
    move = pack_move(Box(10, 10), bodies, aim, np.zeros(1))
    for _ in range(20_000):
        aim[0] = -heading[0, 1], heading[0, 0]  # Always a quarter of a turn to the left.
        advance_entry(Box(10, 10))(move)
    assert np.hypot(*heading[0]) == pytest.approx(1, abs=1e-12)
    assert math.remainder(math.atan2(heading[0, 1], heading[0, 0]) - 20_000 * 0.37, 2 * math.pi) == pytest.approx(
        0, abs=1e-8
    )


@pytest.mark.parametrize(
    "action", [(math.nan, 0, 1), (1, math.nan, 1), (1, 0, math.nan), (math.inf, 0, 1), (0, -math.inf, 1), (2, 0, 1)]
)
def test_actions_that_are_no_numbers_are_none(action: tuple[float, float, float]) -> None:
    assert not plain(is_action)(*action)
    assert plain(is_action)(1.0, 0.0, 5.0)
    assert plain(is_action)(0.0, 0.0, -1.0)
