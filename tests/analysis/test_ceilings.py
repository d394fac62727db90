"""Ceilings: exact where they claim it, possible for robots, and blind to what they must not know."""

from __future__ import annotations

import math
from itertools import combinations, product
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr, ndtri, stdtrit
from scipy.stats import qmc, ttest_ind

from teamsight import CMOMMT, Box, Disc
from teamsight.analysis.ceilings import (
    _FADES,
    _LEG,
    OBSERVED,
    PLANNERS,
    SETTINGS,
    Far,
    Lost,
    Observed,
    Plans,
    Walkers,
    _over,
    compare,
    measure,
    most_covered,
    planned,
    share_text,
    standings,
    team_of,
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


def prospect(plans: Plans, place: np.ndarray, start: np.ndarray, far: Far) -> float:
    """What a place is worth at the end, which is that of the middle of its block."""
    # Blocks begin at the corner of the box that a robot cannot leave.
    spacing, margin = plans.speed, _LEG
    low = plans.places[0, 0]
    corner = np.maximum(np.rint((start - low) / spacing) - (plans.legs * _LEG + 1), margin)
    block = (np.rint((place - low) / spacing) - corner) // _LEG
    middle = low + spacing * (corner + block * _LEG + _LEG // 2)
    found = 0.0
    for at, pull, rest, kind in zip(*far, strict=True):
        beyond = max(int(math.dist(at, middle) / spacing) - plans.reach / spacing, 0.0)
        found += pull * max(_FADES[kind] ** beyond - rest, 0.0)
    return found


def best_way(
    plans: Plans, start: np.ndarray, paths: np.ndarray, worth: np.ndarray, lost: Lost, far: Far
) -> tuple[float, Any]:
    """What the best way is worth, by trying all of them, and what a way is worth."""
    places = [one for one in plans.places.reshape(-1, 2) if plans.arena.contains(one)]
    stride = _LEG * plans.speed * (1 + 1e-9)

    def of_leg(place: np.ndarray, leg: int) -> float:
        middle = (leg + 1) * _LEG
        total = prospect(plans, place, start, far) if leg == plans.legs - 1 else 0.0
        for tick in range(middle - (_LEG - 1) // 2, min(middle + _LEG // 2 + 1, len(worth))):
            total += sum(
                w for w, at in zip(worth[tick], paths[tick], strict=True) if math.dist(at, place) <= plans.reach
            )
        chances = zip(lost.chance[leg], lost.cloud[leg], strict=True)
        return total + sum(w for w, at in chances if math.dist(at, place) <= plans.reach)

    def rest(place: np.ndarray, leg: int) -> float:
        if leg == plans.legs:
            return 0.0
        near = [one for one in places if math.dist(one, place) <= stride]
        return max(of_leg(one, leg) + rest(one, leg + 1) for one in near)

    return rest(start, 0), of_leg


@pytest.mark.short
@pytest.mark.parametrize("seed", range(5))
def test_a_way_is_the_best_of_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    plans = Plans(Disc(0.5), 0.12, 0.3, 3 * _LEG)
    paths = rng.uniform(-0.5, 0.5, (plans.ticks + 1, 3, 2))
    worth = rng.random((plans.ticks + 1, 3))
    lost = Lost(rng.uniform(-0.5, 0.5, (plans.legs, 4, 2)), rng.random((plans.legs, 4)), np.zeros(4))
    far = Far(rng.uniform(-2, 2, (5, 2)), 30 * rng.random(5), rng.uniform(0.5, 1, 5), rng.integers(0, 2, 5))
    start = np.array([0.1, -0.05])
    way = plans.way(start, paths, worth, lost, far)
    assert np.array_equal(way[0], start)
    steps = np.hypot(*np.diff(way, axis=0).T)
    assert steps.max() <= 0.12 * (1 + 1e-9)
    assert plans.arena.contains(way).all()
    most, of_leg = best_way(plans, start, paths, worth, lost, far)
    assert sum(of_leg(way[(leg + 1) * _LEG], leg) for leg in range(plans.legs)) == pytest.approx(most)


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
    assert found["random-walk"].share.mean == 0.0
    assert found["clairvoyant"].share.mean == 1.0
    assert 0 < found["sharing"].share.mean < 1


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
@pytest.mark.parametrize("seed", range(3))
def test_where_a_target_is_makes_no_difference_until_a_robot_senses_it(seed: int) -> None:
    setting = {"robots": 2, "targets": 4, "radius": 4.0}
    worlds = [planned("sharing", 60, rng=seed, **setting) for _ in range(2)]

    def is_hidden(world: CMOMMT, target: int) -> bool:
        away = world.robots.position - world.targets.position[target]
        return bool(np.hypot(*away.T).min() > 1.0)

    target = next(row for row in range(4) if is_hidden(worlds[0], row))
    spots = np.random.default_rng(seed).uniform(-2.8, 2.8, (50, 2))
    for spot in spots:
        worlds[1].targets[target].position = tuple(spot)
        if is_hidden(worlds[1], target) and math.dist(spot, worlds[0].targets.position[target]) > 1.0:
            break
    steps = 0
    while steps < 60 and all(is_hidden(world, target) for world in worlds):
        for world in worlds:
            world.step()
        assert np.array_equal(worlds[0].robots.position, worlds[1].robots.position)
        steps += 1
    assert steps > 3


@pytest.mark.short
def test_a_lost_target_is_where_nobody_senses() -> None:
    world = planned("sharing", 60, rng=2, **SMALL)
    planner: Any = world.robots.policy
    was_lost = False
    for tick in range(60):
        if tick % 10 == 5:
            # Where nothing is that a robot would not sense.
            planner._clouds.bodies.position[:] = world.robots.position[0]
        robots, targets = np.array(world.robots.position), np.array(world.targets.position)
        world.step()
        known, points = planner._known, planner._clouds.bodies.position.reshape(len(targets), -1, 2)
        sensed = np.hypot(*(targets[:, np.newaxis] - robots).transpose(2, 0, 1)) <= 1.0
        assert np.array_equal(known, sensed.any(axis=1))
        away = np.hypot(*(points[~known, :, np.newaxis] - robots).transpose(3, 0, 1, 2))
        assert (away > 1.0).all()
        assert world.arena.contains(points[~known]).all()
        was_lost |= not known.all()
    assert was_lost


@pytest.mark.short
def test_walkers_turn_as_often_as_targets_do() -> None:
    world, n = CMOMMT(robots=1, targets=1, radius=50.0, rng=1), 40_000
    heading = np.tile([1.0, 0.0], (n, 1))
    walkers = Walkers(world, np.zeros((n, 2)), heading, np.full(n, 0.075))
    walkers.walk(np.random.default_rng(0), 3)
    # 1 − 0.95³ of them, and all as far.
    assert walkers.has_turned.mean() == pytest.approx(1 - 0.95**3, abs=0.01)
    assert np.hypot(*walkers.bodies.position.T) == pytest.approx(0.225)
    assert (walkers.bodies.heading[:, 0] < 0.999).mean() == pytest.approx(1 - 0.95**3, abs=0.01)
    walkers.walk(None, 2)
    assert np.hypot(*walkers.bodies.position.T) == pytest.approx(0.375)


@pytest.mark.short
def test_policies_have_options_and_teams_settings() -> None:
    assert team_of("a-cmommt:gain=4,idle=wander") == {
        "policy": "a-cmommt", "policy_options": {"gain": 4, "idle": "wander"},
    }  # fmt: skip
    assert team_of("evolved") == {"policy": "evolved", "awareness": "ring"}
    assert team_of("sharing") == {"policy": "sharing"}
    for text, message in (("a-cmomt:gain=1", "did you mean"), ("a-cmommt:gain", "NAME=VALUE")):
        with pytest.raises(ValueError, match=message):
            team_of(text)
    how: dict[str, Any] = {"runs": 1, "steps": 20, "seed": 3}
    named = {"one": {"policy": "a-cmommt", "policy_options": {"gain": 4}}, "other": {"policy": "random-walk"}}
    by_text = compare([(2, 3, 2.0)], ["a-cmommt:gain=4", "random-walk"], **how)
    by_name = compare([(2, 3, 2.0)], named, **how)
    assert by_name["team"].tolist() == ["one", "other"]
    assert by_text["observed_fraction"].tolist() == by_name["observed_fraction"].tolist()


@pytest.mark.short
def test_means_over_cells_count_cells_alike() -> None:
    fractions = {("slow", 1.0): [0.2, 0.4], ("slow", 2.0): [0.5, 0.7], ("clairvoyant", 1.0): [0.6, 0.8],
                 ("clairvoyant", 2.0): [0.9, 0.9]}  # fmt: skip
    table = pd.DataFrame([
        {"robots": 3, "radius": radius, "team": team, "replicate": number, "observed_fraction": one, "teleport": 1.0}
        for (team, radius), observed in fractions.items() for number, one in enumerate(observed)
    ])  # fmt: skip
    slow, ceiling, teleport = standings(table, overall=True)
    assert slow.observed.mean == pytest.approx(45.0)
    assert ceiling.more.mean == pytest.approx(35.0)
    # The variance of each cell's mean is 0 and 100, so one degree of freedom is left: Student's quantile is 12.706.
    assert ceiling.more.high - ceiling.more.mean == pytest.approx(12.7062 * math.sqrt(0 + 100) / 2, rel=1e-4)
    assert (slow.share, ceiling.share, teleport.observed.mean) == ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 100.0)
    # From 45 to 80 teleport gains 55: 70 and 50 in one cell, 50 and 30 in the other, where the ways are 40, 40, 40, 20.
    assert teleport.share.mean == pytest.approx(55 / 35)
    left = [(gain - 55 / 35 * way) / 35 for gain, way in ((80, 40), (60, 40), (50, 40), (30, 20))]
    squares = [(left[at] - left[at + 1]) ** 2 / 4 for at in (0, 2)]
    error = math.sqrt(sum(squares)) / 2
    quantile = stdtrit(sum(squares) ** 2 / sum(one**2 for one in squares), 0.975)
    assert teleport.share.high - teleport.share.mean == pytest.approx(quantile * error, rel=1e-4)
    assert share_text(teleport.share) == f"157 % ({100 * teleport.share.low:.0f} to {100 * teleport.share.high:.0f})"
    assert [share_text(one.share) for one in (slow, ceiling)] == ["0 %", "100 %"]
    assert standings(table, "clairvoyant", overall=True)[0].more.mean == pytest.approx(-35.0)
    (alone, *_) = standings(table[table["replicate"] == 0], overall=True)
    assert alone.observed.high == math.inf
    without = standings(table[table["team"] == "slow"], overall=True)[0]
    assert [share_text(one.share) for one in (alone, without)] == ["0 %", ""]


@pytest.mark.short
def test_an_interval_over_two_cells_is_that_of_welch() -> None:
    rng = np.random.default_rng(1)
    one, other = rng.normal(0.0, 1.0, 7), rng.normal(1.0, 4.0, 5)
    welch = ttest_ind(one, -other, equal_var=False).confidence_interval()
    assert _over([one, other])[1:] == pytest.approx([welch.low / 2, welch.high / 2], rel=1e-9)
    assert _over([np.ones(2), np.zeros(3)]) == (0.5, 0.5, 0.5)


@pytest.mark.short
@pytest.mark.parametrize("spread", [1.0, 0.9, 0.7, 0.5])
def test_intervals_of_two_runs_in_each_cell_hold_the_mean_often_enough(spread: float) -> None:
    """For cells whose standard deviations differ: by a fixed set of points in place of chance."""
    cells, points = 8, 511
    sigma = spread ** np.arange(cells)
    # The difference of two runs decides how wide the interval is, and the mean is normal whatever that is.
    # The first point of the sequence is 0, which has no quantile.
    level = qmc.Sobol(cells, scramble=False).fast_forward(1).random(points)
    halves = ndtri(level) * sigma / math.sqrt(2.0)
    wide = np.array([_over([np.array([-half, half]) for half in point]).high for point in halves])
    se = math.sqrt(float((sigma**2).sum()) / 2.0) / cells
    assert 0.95 <= float((2.0 * ndtr(wide / se) - 1.0).mean()) <= 0.99


@pytest.mark.short
def test_a_measure_is_kept_and_read_again() -> None:
    for found in (Observed(0.25, math.nan), Observed(0.5, 0.75)):
        again = OBSERVED.decode(OBSERVED.encode(found))
        assert isinstance(again, Observed)
        assert str(again) == str(found)


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
