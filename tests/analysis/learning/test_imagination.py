"""A model of the world is learned from transitions alone, and a policy is sought in the worlds that it imagines."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from teamsight.analysis.learning.explore import Exploration, explore
from teamsight.analysis.learning.imagination import WorldModel, imagine, learn_model, statistics
from teamsight.analysis.learning.plans import Imagining
from teamsight.policies.group_forces import BY_HAND, GroupForces
from teamsight.policies.memory import LazyMemory

MODEL = WorldModel(0.1, 0.075, 1.0, 0.05, 3.0)
SMALL = Imagining(generations=3, population=5, robots=(3,), radius=(2.0, 3.0), targets=4, steps=20)


def by_hand(
    sectors: int, rows: list[tuple[float, int, float, float, float]], beside: float = 1.0
) -> LazyMemory:
    """Return transitions straight on: distance of a lone target, its sector, its next distance, share and a teammate's."""
    situation, following = np.ones((2, len(rows), 2 * sectors), np.float32)
    action = np.zeros((len(rows), 2), np.float32)
    for i, (distance, sector, later, share, teammate) in enumerate(rows):
        situation[i, [sector, sector + 1, sectors]] = distance, beside, teammate
        following[i, [sector, sectors]] = later, round(teammate - 0.1 * share, 3)
        action[i] = 0.0, share
    facts = {"sensed": np.ones(len(rows))}
    settings = {"targets": 4, "teammate_layout": "sectors"}
    return LazyMemory.of(situation, action, following, facts, own=sectors, settings=settings)


def test_statistics_of_transitions_by_hand_are_those_of_a_closed_form() -> None:
    # Two chains of two steps: to a target ahead, and away from one behind.
    steps = [
        (0.6, 0, 0.55, 0.7, 0.6), (0.55, 0, 0.56, 0.1, 0.53),
        (0.4, 8, 0.45, 0.4, 0.5), (0.45, 8, 0.5, 0.2, 0.46),
    ]  # fmt: skip
    found = statistics(by_hand(16, steps))
    x, y = np.array([0.7, 0.1, -0.4, -0.2]), np.array([-0.05, 0.01, 0.05, 0.05])
    step = -(x @ y) / (x @ x)
    one, other, third, fourth = rest = y + step * x
    straight = (one * other + third * fourth) / math.hypot(one, third) / math.hypot(other, fourth)
    assert found.step == pytest.approx(step, abs=1e-6)
    assert found.spread == pytest.approx(math.sqrt(np.mean(rest**2)), abs=1e-6)
    assert found.straight == pytest.approx(straight, abs=1e-5)
    assert found.teammate_step == pytest.approx(0.1, abs=1e-6)
    assert found.sensed == 1 / 4


def test_a_target_whose_sector_neighbour_is_sensed_too_does_not_count() -> None:
    steps = [(0.6, 0, 0.5, 1.0, 0.6), (0.5, 0, 0.4, 1.0, 0.5), (0.4, 0, 0.35, 1.0, 0.4)]
    assert statistics(by_hand(16, steps)).step == pytest.approx((0.1 + 0.1 + 0.05) / 3)
    with pytest.raises(ValueError, match="shows no lone target or no lone teammate for two steps; explore longer"):
        statistics(by_hand(16, steps, beside=0.9))


@pytest.mark.parametrize(
    "world",
    [{}, {"sensing_range": 0.5}, {"awareness_range": 2.0}, {"robot_speed": 0.06, "target_speed": 0.1}],
    ids=["default", "sensing", "awareness", "speeds"],
)
def test_the_model_is_that_of_the_world(world: dict[str, Any]) -> None:
    """Within a fifth; of the turns within 0.15. Of 9,600 transitions in such worlds the standard deviations are 7 % and 0.03."""
    memory = explore(Exploration(seed=5, runs=32, world=world))
    # Speeds and ranges are not read.
    kept = {name: memory.settings[name] for name in ("robots", "targets", "radius", "teammate_layout")}
    facts = {name: memory.fact(name) for name in memory.facts}
    memory = LazyMemory.of(
        memory.situation, memory.action, memory.next_situation, facts, own=memory.own, settings=kept
    )
    model = learn_model(memory)
    sensing, awareness = world.get("sensing_range", 1.0), world.get("awareness_range", 1.0)
    robot, target = world.get("robot_speed", 0.1), world.get("target_speed", 0.075)
    assert model.robot_speed == pytest.approx(robot / sensing, rel=0.2)
    assert model.target_speed == pytest.approx(target / sensing, rel=0.2)
    assert model.awareness_range == pytest.approx(awareness / sensing, rel=0.2)
    assert model.radius == pytest.approx(3.0 / sensing, rel=0.2)
    assert model.turn_probability == pytest.approx(0.05, abs=0.15)


def test_targets_that_turn_at_each_step_are_distinguished_from_those_that_seldom_do() -> None:
    options = {"target_policy_options": {"turn_probability": 1.0}}
    assert learn_model(explore(Exploration(runs=8, world=options))).turn_probability > 0.8


def test_a_memory_without_a_ring_of_teammates_is_refused() -> None:
    memory = explore(Exploration(awareness="none"))
    with pytest.raises(ValueError, match="show no ring of teammates; explore with awareness='ring'"):
        learn_model(memory)


def test_a_memory_of_another_scenario_is_refused() -> None:
    with pytest.raises(ValueError, match="its settings lack one number for robots, radius; explore CMOMMT, once"):
        learn_model(by_hand(16, [(0.6, 0, 0.5, 1.0, 0.6)]))


def test_the_search_depends_on_its_seed_alone_and_leaves_the_start() -> None:
    done: list[float] = []
    found = [imagine(MODEL, SMALL, progress=lambda one, of: done.append(one / of)).constants]
    found += [imagine(MODEL, plan).constants for plan in (SMALL, replace(SMALL, seed=1))]
    assert found[0] == found[1] != found[2]
    assert GroupForces.vector(BY_HAND) not in found
    assert done == [1 / 3, 2 / 3, 1]


def test_an_imagined_world_has_the_numbers_of_the_model() -> None:
    found = WorldModel(0.2, 0.15, 2.0, 0.1, 6.0).parameters(1.5)
    assert (found["robot_speed"], found["target_speed"], found["sensing_range"]) == (0.2, 0.15, 1.0)
    assert (found["awareness_range"], found["radius"]) == (2.0, 9.0)
    assert found["target_policy_options"] == {"turn_probability": 0.1}


def test_a_plan_of_crowded_worlds_alone_is_refused() -> None:
    model = WorldModel(0.1, 0.075, 1.0, 0.05, 3.0)
    with pytest.raises(ValueError, match="robots, radius: so many robots observe all targets"):
        imagine(model, Imagining(robots=(30,), radius=(2.0,)))


def test_the_worlds_of_a_plan_leave_out_crowded_ones() -> None:
    assert Imagining(robots=(5, 10), radius=(2.0, 3.0, 4.0)).cells == [(5, 3.0), (5, 4.0), (10, 4.0)]
