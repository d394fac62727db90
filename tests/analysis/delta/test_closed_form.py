"""The closed form against simulations, sampled geometry and sums written out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from chance import generator
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from teamsight.analysis.delta import closed_form


@pytest.mark.parametrize(
    ("radius", "largest"), [(1.0, 29.0), (2.0, 17.3), (3.0, 11.7), (5.0, 7.3), (7.0, 5.7), (9.0, 5.0)]
)
def test_the_expected_maximum_is_near_the_simulated_one(radius: float, largest: float) -> None:
    found = closed_form.predict(30, radius, steps=600, runs=5, speed=0.5).expected_maximum
    assert found == pytest.approx(largest, abs=0.5)  # docs/closed-form.md: off by at most 0.5


@pytest.mark.parametrize(
    ("robots", "radius", "delta", "share"),
    # Shares of 2,000 random walks of 600 steps in which some robot has more than δ neighbours.
    [(30, 2.0, 16, 0.079), (30, 2.0, 17, 0.022), (30, 1.5, 23, 0.021), (50, 2.0, 25, 0.035), (5, 4.0, 2, 0.050),
     (10, 8.0, 2, 0.041), (30, 8.0, 4, 0.061)],
)  # fmt: skip
def test_small_probabilities_are_those_of_a_simulation(robots: int, radius: float, delta: int, share: float) -> None:
    # In crowded arenas a constant number of independent snapshots was too low by a factor of three, in empty ones too
    # high by the same factor.
    assert share / 1.6 < closed_form.predict(robots, radius).exceedance(delta) < share * 1.6


def test_descent_is_the_sum_over_places_of_a_birth_and_death_process() -> None:
    team, radius, rings = 6, 2.0, 4000
    summed = [0.0] * team
    for ring in range(rings):
        share = closed_form.overlap_share(np.array([radius * math.sqrt((ring + 0.5) / rings)]), radius, 1.0)[0]
        for k in range(team):
            chance = math.comb(team - 1, k) * share**k * (1 - share) ** (team - 1 - k)
            leaving, coming = k, (team - 1 - k) * share / (1 - share)
            summed[k] += chance * max(leaving - coming, 0.0) / rings
    assert closed_form.degree_descent(team, radius, 1.0) == pytest.approx(summed, rel=1e-3)  # other midpoints


def test_a_snapshot_alone_and_robots_that_always_see_each_other() -> None:
    # One step: nobody can have come, and the largest of N robots is at least one robot and at most N.
    tail = closed_form.degree_tail(8, 3.0, 1.0)
    found = closed_form.predict(8, 3.0, steps=1).at_least
    assert (tail <= found + 1e-12).all()
    assert (found <= 8 * tail + 1e-12).all()
    assert closed_form.predict(8, 0.4, steps=1).expected_maximum == pytest.approx(7.0)


def _uniform(rng: np.random.Generator, count: int, radius: float) -> np.ndarray:
    angle, distance = rng.uniform(0, 2 * np.pi, count), radius * np.sqrt(rng.uniform(size=count))
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])


@given(radius=st.floats(0.3, 9.0), reach=st.floats(0.1, 4.0), share=st.floats(0.0, 1.0), seed=st.integers(0, 2**32 - 1))
def test_overlap_is_the_share_of_sampled_points(radius: float, reach: float, share: float, seed: int) -> None:
    points = _uniform(np.random.default_rng(seed), 20_000, radius)
    sampled = (np.hypot(points[:, 0] - share * radius, points[:, 1]) <= reach).mean()
    exact = closed_form.overlap_share(np.array([share * radius]), radius, reach)[0]
    # Six standard errors of the sample: wrong once in 10^9 examples.
    assert exact == pytest.approx(sampled, abs=6 * np.sqrt(max(exact * (1 - exact), 1e-4) / 20_000))


def test_degree_tail_is_that_of_uniform_robots() -> None:
    rng = generator()
    trees = [cKDTree(_uniform(rng, 12, 2.5)) for _ in range(4000)]
    degree = np.array([len(row) - 1 for tree in trees for row in tree.query_ball_tree(tree, 1.0)])
    tail = closed_form.degree_tail(12, 2.5, 1.0)
    assert tail[0] == pytest.approx(1.0)
    for k in range(1, 12):
        # Robots of one snapshot are correlated: at worst 4000 independent values. Six standard errors.
        error = np.sqrt(max(tail[k] * (1 - tail[k]), 1e-4) / 4000)
        assert tail[k] == pytest.approx((degree >= k).mean(), abs=6 * error)


def test_a_huge_team_costs_little_and_agrees_with_the_whole_sum() -> None:
    tail = closed_form.degree_tail(50_000, 100.0, 1.0)
    assert tail[0] == pytest.approx(1.0)
    mean = 49_999 * closed_form.overlap_share(100.0 * np.sqrt((np.arange(4000) + 0.5) / 4000), 100.0, 1.0).mean()
    assert tail[1:].sum() == pytest.approx(mean, rel=1e-4)  # E[degree] both ways; the two use different midpoints


@given(team=st.integers(1, 40), radius=st.floats(0.5, 9.0), speed=st.floats(0.0, 2.0), risk=st.floats(1e-6, 0.5))
def test_prediction_is_a_falling_probability_and_delta_its_inverse(
    team: int, radius: float, speed: float, risk: float
) -> None:
    found = closed_form.predict(team, radius, speed=speed)
    assert found.at_least.shape == (team,)
    assert ((found.at_least >= 0) & (found.at_least <= 1)).all()
    assert (np.diff(found.at_least) <= 1e-12).all()
    delta = found.delta(risk)
    assert found.exceedance(delta) <= risk
    assert delta == 0 or found.exceedance(delta - 1) > risk
    assert found.exceedance(team - 1) == 0.0


def test_more_runs_raise_the_expected_maximum_but_never_past_the_team() -> None:
    one, many = (closed_form.predict(10, 3.0, runs=runs).expected_maximum for runs in (1, 1000))
    assert one < many <= 9.0


def test_a_lone_robot_has_no_neighbours() -> None:
    assert closed_form.predict(1, 3.0).expected_maximum == 0.0
    assert closed_form.predict(1, 3.0).delta(0.01) == 0


def test_bad_input_is_named() -> None:
    with pytest.raises(ValueError, match="arena_radius"):
        closed_form.predict(3, -1.0)
    with pytest.raises(ValueError, match="risk=2"):
        closed_form.predict(3, 1.0).delta(2.0)
