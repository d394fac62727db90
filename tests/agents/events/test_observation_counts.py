"""Observation counts agree with positions read after each step, on both paths, through all that changes groups."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from naive.evenness import Evenness

from teamsight import CMOMMT, Box, Robot, Sensor, Target, World
from teamsight.agents.events import observation_counts as evenness
from teamsight.agents.events.observation_counts import ObservationCounts

DIVISIONS: dict[str, Callable[[World], Any]] = {
    "run": lambda world: world.run(60),
    "step": lambda world: [world.step() for _ in range(60)],
    "parts": lambda world: [world.run(20), world.step(), world.run(39)],
}


def team(rng: int = 4, **given: Any) -> CMOMMT:
    return CMOMMT(rng=rng, robots=6, targets=5, radius=2.5, robot_speed=0.3, target_speed=0.2, **given)


def counted(counts: ObservationCounts) -> dict[int, tuple[int, int, int]]:
    table = counts.table
    rows = table[["steps", "observed", "sightings"]].itertuples(index=False, name=None)
    return dict(zip(table["target"].tolist(), rows, strict=True))


def compare(counts: ObservationCounts, twin: Evenness) -> None:
    assert counted(counts) == twin.counts
    assert counts.spread == pytest.approx(twin.spread)
    assert counts.entropy == pytest.approx(twin.entropy)
    assert counts.redundancy == pytest.approx(twin.redundancy)


@pytest.mark.short
@pytest.mark.parametrize("advance", DIVISIONS.values(), ids=DIVISIONS.keys())
def test_counts_are_what_positions_show(advance: Any) -> None:
    model, other, twin = team(), team(), Evenness()
    counts = model.count_observations()
    for _ in range(60):
        other.step()
        twin.look(other.robots, other.targets)
    advance(model)
    compare(counts, twin)
    # If all targets are always there, their mean share is the observed fraction; and counting changes no bit.
    assert counts.table["share"].mean() == pytest.approx(model.observed_fraction)
    assert np.array_equal(model.robots.position, other.robots.position)
    assert (evenness.spread(model), evenness.entropy(model)) == (counts.spread, counts.entropy)
    assert evenness.redundancy(model) == counts.redundancy > 1


@given(seed=st.integers(0, 2**32 - 1), advance=st.sampled_from(list(DIVISIONS.values())))
@settings(max_examples=10)
def test_any_world_with_agents_that_come_go_and_rest(seed: int, advance: Any) -> None:
    models, twin = [], Evenness()
    for _ in range(2):
        model = team(seed)
        models.append(model)
        counts = model.count_observations()
        model.clock.at(7, lambda model=model: setattr(model.targets[1], "active", False))
        model.clock.at(15, lambda model=model: model.targets.add(2))
        model.clock.at(22, lambda model=model: model.targets[0].remove())
        model.clock.at(23, lambda model=model: model.robots[2].remove())
        model.clock.at(31, lambda model=model: setattr(model.targets[0], "active", True))
        model.clock.at(40, lambda model=model: setattr(model.robots[0], "active", False))
    for _ in range(60):
        models[0].step()
        twin.look(models[0].robots, models[0].targets)
    advance(models[1])
    compare(counts, twin)
    assert len(counts.table) == 7


def test_a_robot_counts_once_for_a_target_that_it_senses_in_two_channels_and_groups_count_together() -> None:
    worlds, twin = [], Evenness()
    for _ in range(2):
        world = World(Box(5, 4), rng=3)
        scouts = world.add(Robot, 3, name="scouts", policy="random-walk", speed=0.2)
        haulers = world.add(Robot, 4, name="haulers", policy="random-walk", speed=0.1, sensing_range=1.5)
        prey = world.add(Target, 6, name="prey", policy="random-walk", speed=0.2)
        rocks = world.add(Target, 2, name="rocks", policy="stationary")
        world.senses(scouts, prey)
        world.senses(scouts, prey, as_="near", sensor=Sensor(range=0.5), counts=True)
        world.senses(haulers, prey, as_="near", sensor=Sensor(range=1.5), counts=True)
        world.senses(haulers, rocks, as_="rocks")
        worlds.append((world, [*scouts, *haulers], prey, rocks))
    counts = worlds[0][0].count_observations()
    worlds[0][0].run(50)
    world, robots, prey, rocks = worlds[1]
    for _ in range(50):
        world.step()
        twin.look(robots, prey)
    compare(counts, twin)
    # Rocks are sensed in a channel that does not count, so they are no targets.
    assert set(counts.table["group"]) == {"prey"}
    assert not {rock.unique_id for rock in rocks} & set(counts.table["target"])


def test_missed_detections_are_not_observed() -> None:
    some, none = team(), team(sensor=Sensor(missed=1.0))
    half = team(sensor=Sensor(missed=0.5))
    tables = []
    for model in (some, half, none):
        model.count_observations()
        model.run(80)
        tables.append(model.count_observations().table["sightings"].sum())
    assert tables[0] > tables[1] > tables[2] == 0
    assert math.isnan(evenness.entropy(none))
    assert math.isnan(evenness.redundancy(none))
    assert evenness.spread(none) == 0.0


def test_worlds_without_targets_or_steps_have_no_numbers() -> None:
    for model in (CMOMMT(robots=3, targets=5, rng=1), World(Box(2, 2), rng=1)):
        counts = model.count_observations()
        assert len(counts.table) == 0
        assert all(math.isnan(one) for one in (counts.spread, counts.entropy, counts.redundancy))
    model.run(3)
    assert math.isnan(counts.spread)


def test_counts_follow_states_and_resets() -> None:
    model = team()
    counts = model.count_observations()
    model.run(30)
    saved, then = model.state(), counts.table
    model.targets[0].remove()
    model.run(30)
    later = counts.table
    model.restore(saved)
    assert counts.table.equals(then)
    model.targets[0].remove()
    model.run(30)
    assert counts.table.equals(later)
    model.reset(rng=4)
    assert len(counts.table) == 0
    fresh = team()
    fresh.targets[0].remove()
    fresh.count_observations()
    for one in (model, fresh):
        one.run(10)
    assert model.count_observations() is counts
    assert model.count_observations().table.equals(fresh.count_observations().table)


def test_counting_begins_when_asked_for_and_ends_when_detached() -> None:
    model = team()
    model.run(10)
    counts = model.count_observations()
    model.run(5)
    assert set(counts.table["steps"]) == {5}
    model.detach(counts)
    model.run(5)
    assert len(model._data.watchers) == 0
    with pytest.raises(ValueError, match=r"spread\(CMOMMT\): .*call world\.count_observations\(\) before the run"):
        evenness.spread(model)
    again = model.count_observations()
    model.run(3)
    assert set(again.table["steps"]) == {3}
