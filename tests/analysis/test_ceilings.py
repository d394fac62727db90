"""Ceilings: exact where they claim it, possible for robots, and blind to what they must not know."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Box, Disc
from teamsight.analysis.ceilings import (
    _LEG,
    PLANNERS,
    SETTINGS,
    Plans,
    compare,
    measure,
    most_covered,
    planned,
    standings,
)

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one:UserWarning")
SMALL: dict[str, Any] = {"robots": 3, "targets": 6, "radius": 2.5}


def covered_by(places: Any, targets: np.ndarray, reach: float) -> int:
    away = ((np.asarray(places)[:, np.newaxis] - targets) ** 2).sum(axis=-1)
    return int((away <= reach**2).any(axis=0).sum())


@pytest.mark.short
@given(seed=st.integers(0, 10_000), targets=st.integers(1, 7), robots=st.integers(1, 3), reach=st.floats(0.2, 2))
@settings(max_examples=40)
def test_no_placement_covers_more_than_the_optimum(seed: int, targets: int, robots: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-2, 2, (targets, 2))
    most = most_covered(points, robots, reach)
    # All choices among many places, and among those of the targets themselves.
    places = [*points, *rng.uniform(-2, 2, (12, 2))]
    best = max(covered_by(chosen, points, reach) for chosen in combinations(places, robots))
    assert best <= most <= targets
    assert most >= min(robots, targets)
    assert most_covered(points, robots + 1, reach) >= most


@pytest.mark.short
def test_three_on_a_circle_are_covered_by_its_centre_alone() -> None:
    angles = np.array([0.3, 2.2, 4.4])
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    assert most_covered(corners, 1, 1.0) == 3
    assert most_covered(corners, 1, 0.99) == 2
    assert most_covered(np.zeros((5, 2)), 1, 0.1) == 5
    assert most_covered(np.arange(10.0).reshape(5, 2) * 10, 3, 1.0) == 3


def best_way(plans: Plans, start: np.ndarray, paths: np.ndarray, worth: np.ndarray) -> float:
    """What the best way is worth, by trying all of them."""
    places = [one for one in plans.places.reshape(-1, 2) if plans.arena.contains(one)]
    stride = _LEG * (plans.places[1, 0] - plans.places[0, 0])[0] * (1 + 1e-9)

    def of_leg(place: np.ndarray, leg: int) -> float:
        middle, total = (leg + 1) * _LEG, 0.0
        for tick in range(middle - (_LEG - 1) // 2, min(middle + _LEG // 2 + 1, len(worth))):
            total += sum(
                w for w, at in zip(worth[tick], paths[tick], strict=True) if math.dist(at, place) <= plans.reach
            )
        return total

    def rest(place: np.ndarray, leg: int) -> float:
        if leg == plans.legs:
            return 0.0
        near = [one for one in places if math.dist(one, place) <= stride]
        return max(of_leg(one, leg) + rest(one, leg + 1) for one in near)

    return rest(start, 0)


@pytest.mark.short
@pytest.mark.parametrize("seed", range(5))
def test_a_way_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plans = Plans(Disc(0.5), 0.12, 0.3, 3 * _LEG)
    paths = rng.uniform(-0.5, 0.5, (plans.ticks + 1, 3, 2))
    worth = rng.random((plans.ticks + 1, 3))
    start = np.array([0.1, -0.05])
    way = plans.way(start, paths, worth)
    assert np.array_equal(way[0], start)
    steps = np.hypot(*np.diff(way, axis=0).T)
    assert steps.max() <= 0.12 * (1 + 1e-9)
    assert plans.arena.contains(way).all()
    found = 0.0
    for leg in range(plans.legs):
        end = way[(leg + 1) * _LEG]
        for tick in range((leg + 1) * _LEG - 1, min((leg + 1) * _LEG + 2, len(worth))):
            found += float(worth[tick][np.hypot(*(paths[tick] - end).T) <= plans.reach].sum())
    assert found == pytest.approx(best_way(plans, start, paths, worth))


@pytest.mark.parametrize("name", PLANNERS)
def test_planned_robots_move_as_robots_do(name: str) -> None:
    world = planned(name, 90, rng=3, **SMALL)
    before = world.robots.position.copy()
    for _ in range(90):
        world.step()
        moved = np.hypot(*(world.robots.position - before).T)
        assert moved.max() <= world.robots.speed[0] * (1 + 1e-9)
        before = world.robots.position.copy()
    again = planned(name, 90, rng=3, **SMALL)
    again.run(90)
    assert np.array_equal(again.robots.position, world.robots.position)
    # The targets are those of every other team.
    other = CMOMMT(rng=3, **SMALL)
    other.run(90)
    assert np.array_equal(other.targets.position, world.targets.position)


def test_who_knows_more_observes_more_and_nobody_passes_teleport() -> None:
    table = compare([(4, 8, 3.0)], ["random-walk", *PLANNERS], runs=3, steps=150, seed=1)
    means = table.groupby("team")["observed_fraction"].mean()
    assert means["random-walk"] < means["sharing"] < means["clairvoyant"]
    assert means["random-walk"] < means["informed"] < means["clairvoyant"]
    found = {one.team: one for one in standings(table)}
    assert found["teleport"].observed.mean >= found["clairvoyant"].observed.mean
    assert found["random-walk"].share == 0.0
    assert found["clairvoyant"].share == 1.0
    assert 0 < found["sharing"].share < 1


@pytest.mark.short
def test_a_sharing_team_does_not_know_what_no_robot_senses() -> None:
    worlds = [planned("sharing", 60, rng=5, **SMALL) for _ in range(2)]
    robots, targets = worlds[0].robots, worlds[0].targets
    away = np.hypot(*(targets.position[:, np.newaxis] - robots.position).transpose(2, 0, 1)).min(axis=1)
    hidden = np.flatnonzero(away > 1.2)
    assert len(hidden)
    for row in hidden:
        # Somewhere else, out of sight too.
        spots = [
            (x, y) for x, y in product(np.linspace(-2.4, 2.4, 25), repeat=2)
            if math.hypot(x, y) < 2.4 and np.hypot(*(robots.position - (x, y)).T).min() > 1.2
        ]  # fmt: skip
        worlds[1].targets[row].position = spots[row * 7 % len(spots)]
    for world in worlds:
        world.step()
    assert np.array_equal(worlds[0].robots.position, worlds[1].robots.position)


@pytest.mark.short
def test_what_planners_do_not_know_is_refused() -> None:
    with pytest.raises(ValueError, match=r"drive='car': the planner of 'informed' does not know it; it takes robots"):
        planned("informed", 10, drive="car")
    with pytest.raises(ValueError, match="target_policy='evasive'"):
        planned("clairvoyant", 10, target_policy="evasive")
    with pytest.raises(ValueError, match=r"robot_speed=1e-05: .* places, which is too many"):
        planned("informed", 10, robot_speed=1e-5, robots=1, targets=1)
    assert {*SETTINGS} <= {*CMOMMT().settings}
    assert isinstance(planned("evolved", 10, awareness="ring", rng=1, robots=2), CMOMMT)


@pytest.mark.short
def test_plans_work_in_boxes_too() -> None:
    plans = Plans(Box(3.0, 1.0), 0.1, 0.5, 30)
    paths = np.tile(np.array([[1.2, 0.2]]), (31, 1, 1))
    way = plans.way(np.array([-0.6, 0.0]), paths, np.ones((31, 1)))
    assert math.dist(way[-1], (1.2, 0.2)) <= 0.5
    assert plans.arena.contains(way).all()


@pytest.mark.short
def test_a_measure_of_a_short_run_has_no_sample() -> None:
    found = measure(planned("clairvoyant", 3, rng=1, **SMALL), 3)
    assert math.isnan(found.teleport)
    assert 0 <= found.observed_fraction <= 1
