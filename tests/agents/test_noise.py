"""Noise between models: what does not belong to somebody changes none of its numbers."""

from __future__ import annotations

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Disc, Robot, Target, World
from teamsight.policies import RandomWalk


def targets_after(steps: int = 40, **settings: object) -> np.ndarray:
    model = CMOMMT(**{"rng": 8, **settings})  # type: ignore[arg-type]
    model.run(steps)
    return np.array(model.targets.position)


@pytest.mark.short
@pytest.mark.parametrize(
    "settings",
    [
        {"policy": "centroid"}, {"policy": "random-walk"}, {"policy": "stationary"}, {"awareness": "shared"}, {"delta": 3},
        {"robots": 3}, {"robots": 30}, {"awareness_range": 0.4}, {"robot_speed": 0.5}, {"policy_options": {"idle": "wander"}}, {"policy_options": {"weights": "none"}},
    ],
    ids=str,
)  # fmt: skip
def test_targets_are_the_same_whatever_the_robots_are(settings: dict[str, object]) -> None:
    assert np.array_equal(targets_after(), targets_after(**settings))


def test_targets_differ_between_seeds() -> None:
    assert not np.any(targets_after() == targets_after(rng=9))


def test_more_targets_change_nothing_for_those_that_were_there() -> None:
    assert np.array_equal(targets_after(), targets_after(targets=40)[:15])


def test_policies_meet_the_same_placement() -> None:
    one, other = CMOMMT(rng=4, policy="centroid"), CMOMMT(rng=4, policy="a-cmommt", awareness="none")
    assert np.array_equal(one.robots.position, other.robots.position)
    assert np.array_equal(one.robots.heading, other.robots.heading)


def test_a_later_group_changes_nothing_for_earlier_ones() -> None:
    ends = []
    for late in (False, True):
        world = World(Disc(3.0), rng=1)
        walkers = world.add(Target, 7, policy=RandomWalk())
        world.run(10)
        if late:
            world.add(Robot, 5, policy=RandomWalk())
        world.run(10)
        ends.append(walkers.position.copy())
    assert np.array_equal(*ends)


def test_somebody_who_leaves_takes_nobodys_numbers() -> None:
    model, other = CMOMMT(rng=1), CMOMMT(rng=1)
    other.targets[4].remove()
    model.run(30)
    other.run(30)
    assert np.array_equal(np.delete(model.targets.position, 4, axis=0), other.targets.position)


def test_groups_and_robots_have_noise_of_their_own() -> None:
    world = World(Disc(3.0), rng=1)
    groups = [world.add(Target, 20, policy=RandomWalk()) for _ in range(3)]
    places = np.concatenate([group.position for group in groups])
    world.run(1)
    headings = np.concatenate([group.heading for group in groups])
    for numbers in (places, headings):
        assert len(np.unique(numbers)) == numbers.size


def test_a_callable_is_given_noise_of_its_own() -> None:
    drawn: dict[tuple[int, int], float] = {}

    def rule(percept: object, rng: np.random.Generator) -> tuple[float, float]:
        drawn[len(drawn) // 6, len(drawn) % 6] = rng.random()
        return 0.0, 0.0

    model = CMOMMT(robots=6, policy=rule, rng=1)
    for _ in range(5):
        model.step()
    assert len(set(drawn.values())) == 30


def test_targets_turn_as_often_as_they_should() -> None:
    world = World(Disc(1000.0), rng=fresh_seed())
    targets = world.add(Target, 400, policy=RandomWalk(0.05), placement=np.zeros((400, 2)))
    turns, directions = 0, []
    for _ in range(100):
        before = targets.heading.copy()
        world.step()
        turned = np.any(targets.heading != before, axis=1)
        turns += int(turned.sum())
        directions.append(targets.heading[turned])
    # 40,000 decisions: the standard deviation of the share is 0.0011, of the mean direction 1/√(2·2000) = 0.016; 5 of each.
    assert turns / 40_000 == pytest.approx(0.05, abs=0.0055)
    assert np.concatenate(directions).mean(axis=0) == pytest.approx([0, 0], abs=0.08)
