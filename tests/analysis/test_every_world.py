"""Every analysis on worlds that are not the paper's; see `every_world`."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import mesa
import numpy as np
import pandas as pd
import pytest

from teamsight import CMOMMT, Robot, Sensor, Target, World, run_many
from teamsight.agents.awareness import RingAwareness
from teamsight.agents.components import Failures
from teamsight.agents.recording.explore import explore
from teamsight.analysis import neighbour_graph
from teamsight.analysis.contacts import of_world
from teamsight.analysis.delta import choose_delta
from teamsight.analysis.learning.explore import explore_worlds
from teamsight.analysis.learning.learners import LEARNERS, awareness_for, learn
from teamsight.analysis.runs.checkpoint import Checkpoint
from teamsight.analysis.runs.executor import JobError
from teamsight.analysis.runs.processes import WorkerPool
from teamsight.analysis.runs.run import OUTCOMES, Run
from teamsight.analysis.runs.simulate import run_all
from teamsight.analysis.teams import team_graph
from teamsight.policies import RandomWalk

sys.path.insert(0, str(Path(__file__).parent))  # the suite is imported by file, so helpers are found by path
from every_world import Two, Zoo, obstructed, only_by_seed, without_a_world

# Some groups explore although they sense no targets; one test is about the warning.
pytestmark = pytest.mark.filterwarnings("ignore:.*senses nothing in the channel")


@pytest.mark.parametrize(
    ("model", "name"),
    [
        (Zoo, "Zoo, 9 robots"),
        (only_by_seed, "only_by_seed, 9 robots"),
        (partial(Zoo, scouts=3), "Zoo(scouts=3), 8 robots"),
        (lambda number: Zoo(rng=number), "<lambda>, 9 robots"),
        (CMOMMT, "CMOMMT, 10 robots"),
    ],
)
def test_delta_of_a_class_or_function_whatever_its_seed_is_called(model: Any, name: str) -> None:
    report = choose_delta(model, runs=3, steps=12, risk=0.7, rng=1)
    assert report.subject.startswith(name)
    seed = int(report.maxima["seed"][2])
    world = CMOMMT(rng=seed) if model is CMOMMT else Zoo(3 if isinstance(model, partial) else 4, rng=seed)
    world.run(12)
    assert report.maxima["max_neighbours"][2] == world.max_neighbours


@pytest.fixture(scope="module")
def pool() -> Iterator[WorkerPool]:
    with WorkerPool(2) as started:
        yield started


def test_delta_does_not_depend_on_the_workers(pool: WorkerPool) -> None:
    one = choose_delta(Zoo, runs=6, steps=12, risk=0.5, rng=1)
    two = choose_delta(Zoo, runs=6, steps=12, risk=0.5, rng=1, pool=pool)
    pd.testing.assert_frame_equal(one.maxima, two.maxima)
    pd.testing.assert_frame_equal(one.ring, two.ring)


def test_delta_of_one_team_counts_that_team_alone() -> None:
    reports = {team: choose_delta(Zoo, runs=4, steps=20, risk=0.7, rng=1, team=team) for team in (None, "robots", "rivals")}
    assert [report.robots for report in reports.values()] == [9, 9, 5]
    largest = [report.maxima["max_neighbours"].to_numpy() for report in reports.values()]
    assert (np.maximum(largest[1], largest[2]) == largest[0]).all()
    assert "Zoo, 5 robots of team rivals, 4 runs" in reports["rivals"].subject
    assert not any("teams" in note for note in reports["rivals"].notes)
    assert "give team to choose δ for one of them" in " ".join(reports[None].notes)
    for row in reports["rivals"].maxima.itertuples():
        table = neighbour_graph.over_time(Zoo(rng=row.seed), 20, team="rivals")
        assert table["max_degree"].iloc[1:].max() == row.max_neighbours
        assert (table["robots"] == 5).all()
    with pytest.raises(ValueError, match=r"team='wolves': no group of the world of seed \d+ is on it .*known are 'robots', 'rivals'"):
        choose_delta(Zoo, runs=2, steps=5, team="wolves")
    with pytest.raises(ValueError, match=r"team='wolves': .* known are 'robots', 'rivals'"):
        neighbour_graph.over_time(Zoo(rng=1), 5, team="wolves")


def test_steps_that_were_made_before_do_not_count_for_one_team_either() -> None:
    def begun(seed: int) -> World:
        world = Zoo(rng=seed)
        world.run(12)
        for foe in list(world.foes)[1:]:
            foe.remove()
        return world

    report = choose_delta(begun, runs=2, steps=5, risk=0.9, rng=1, team="rivals")
    assert report.maxima["max_neighbours"].tolist() == [0, 0]


def half_blind(rng: int) -> World:
    """Return a team of which five robots see only what is ahead of them."""
    world = Two(rng=rng)
    world.first.sensors["teammates"] = Sensor(field_of_view=2.0, missed=0.2)
    return world


def test_the_graph_of_whom_robots_really_sense() -> None:
    worlds = [half_blind(rng=3), half_blind(rng=3)]
    near = neighbour_graph.over_time(worlds[0], 10)
    sensed = neighbour_graph.over_time(worlds[1], 10, sensed=True)
    assert (sensed["mean_degree"] <= near["mean_degree"]).all()
    assert (sensed["mean_degree"] < near["mean_degree"]).any()
    world = worlds[1]
    graph = team_graph(world, sensed=True)
    rows = {identity: row for row, identity in enumerate(world.teammates.identity.tolist())}
    for row, robot in enumerate([*world.first, *world.second]):
        own = slice(graph.start[row], graph.start[row + 1])
        assert graph.identity[own].tolist() == [rows[other.unique_id] for other in robot.sensed("teammates")]
        positions = world.teammates.position[graph.identity[own]]
        assert graph.distance[own] == pytest.approx(np.hypot(*(positions - robot.position).T))
    # Without a sensor nothing changes.
    plain = [neighbour_graph.over_time(Two(rng=3), 5, sensed=given) for given in (False, True)]
    pd.testing.assert_frame_equal(*plain)


def test_delta_says_that_a_sensor_shows_fewer_than_the_neighbours() -> None:
    report = choose_delta(half_blind, runs=2, steps=5, risk=0.9, rng=1)
    hidden = "also those that a sensor in order misses or an obstacle hides"
    assert hidden in " ".join(report.notes)
    assert choose_delta(Two, runs=2, steps=5, risk=0.9, rng=1).notes == ()
    annulus = choose_delta(obstructed, runs=2, steps=5, risk=0.9, rng=1)
    assert hidden in " ".join(annulus.notes)
    assert annulus.prediction is None
    near, sensed = (neighbour_graph.over_time(obstructed(1), 5, sensed=given) for given in (False, True))
    assert sensed["mean_degree"].mean() < near["mean_degree"].mean()


def stopping(seed: int) -> World:
    world = Two(rng=seed)
    world.clock.at(3, lambda: setattr(world, "running", False))
    return world


def test_delta_says_that_runs_have_ended_early() -> None:
    report = choose_delta(stopping, runs=3, steps=20, risk=0.9, rng=1)
    assert "3 of 3 runs ended before step 20, the first after 3 steps" in " ".join(report.notes)
    assert choose_delta(Two, runs=3, steps=20, risk=0.9, rng=1).notes == ()


def test_many_runs_of_a_class_are_those_of_its_worlds() -> None:
    table = run_many({"scouts": [2, 4]}, model=Zoo, steps=15, replicates=2, rng=1)
    assert table["scouts"].tolist() == [2, 2, 4, 4]
    for row in table.itertuples():
        world = Zoo(row.scouts, rng=row.seed)
        for _ in range(15):
            world.step()
        found = world.observed_fraction, world.max_neighbours, world.recording.mean_neighbours
        assert (row.observed_fraction, row.max_neighbours, row.mean_neighbours) == found


def test_without_targets_the_observed_fraction_is_nan_and_numbers_of_neighbours_are_not() -> None:
    def alone(rng: int) -> World:
        world = Two(rng=rng)
        for target in list(world.prey):
            target.remove()
        return world

    (row,) = run_many({}, model=alone, steps=5, seeds=[1]).to_dict("records")
    assert math.isnan(row["observed_fraction"])
    assert row["mean_neighbours"] > 0


def test_a_function_that_returns_no_world_is_named() -> None:
    with pytest.raises(JobError, match=r"model returned None: must return a World, .*rng=3"):
        run_many({}, model=without_a_world, steps=5, seeds=[3])


def test_lambdas_do_not_share_results() -> None:
    runs = [Run({}, 1, 5, model=model) for model in (lambda rng: Two(2, rng=rng), lambda rng: Two(9, rng=rng))]
    one, other = run_all(runs)
    assert one != other


def test_a_checkpoint_keeps_runs_of_a_class(tmp_path: Path) -> None:
    runs = [Run({"scouts": 3}, seed, 12, model=Zoo) for seed in (1, 2)]
    checkpoint = Checkpoint(tmp_path / "zoo.checkpoint", OUTCOMES)
    found = run_all(runs, checkpoint=checkpoint)
    assert checkpoint.count(run.key for run in runs) == 2
    assert run_all(runs, checkpoint=checkpoint) == found == run_all(runs)


def test_batches_of_mesa() -> None:
    parameters = {"scouts": [2, 4], "rng": [1, 2]}
    rows = mesa.batch_run(Zoo, parameters, number_processes=1, max_steps=12, display_progress=False)
    for row in rows:
        world = Zoo(row["scouts"], rng=row["rng"])
        world.run(12)
        assert row["seed_used"] == row["rng"]
        assert (row["observed_fraction"], row["max_neighbours"]) == (world.observed_fraction, world.max_neighbours)


def test_the_graph_over_time_and_as_networkx() -> None:
    world = Zoo(rng=1)
    table = neighbour_graph.over_time(world, 20, every=5)
    assert table["robots"].tolist() == [12, 12, 12, 14, 14]
    members = world.teammates
    network = neighbour_graph.to_networkx(world.neighbours, members.position, members.identity, directed=True)
    assert network.number_of_edges() == world.neighbours.degree.sum() == round(14 * world.mean_degree)
    rivals = set(world.foes.identity.tolist())
    assert all((one in rivals) == (other in rivals) for one, other in network.edges)


def test_a_trajectory_of_groups_with_ranges_of_their_own() -> None:
    world = Two(rng=1)
    world.recording.record_positions()
    world.run(10)
    trajectory = world.recording.trajectory
    found = neighbour_graph.over_trajectory(trajectory, {"first": 1.0, "second": 2.0}, world.arena)
    history = world.recording.history
    assert found["max_degree"].tolist() == history["max_neighbours"].tolist()
    assert found["mean_degree"].tolist() == pytest.approx(history["mean_neighbours"].tolist())
    with pytest.raises(ValueError, match=r"the groups first, second, prey: select one.*awareness_range=\{'first': 1.0"):
        neighbour_graph.over_trajectory(trajectory, 1.0)
    with pytest.raises(ValueError, match=r"names the group 'third', but the trajectory holds 'first', 'second', 'prey'"):
        neighbour_graph.over_trajectory(trajectory, {"first": 1.0, "third": 2.0})


@pytest.mark.parametrize("name", sorted(set(LEARNERS) - {"tabular"}))
@pytest.mark.parametrize("group", ["first", "second"])
def test_what_one_group_learns_drives_it_beside_the_other(name: str, group: str) -> None:
    explored = Two(rng=1)
    memory = explore(explored, 60, getattr(explored, group))
    assert memory.settings["robots"] == 7
    assert memory.settings["awareness_range"] == {"first": 1.0, "second": 2.0}[group]
    worlds = [Two(rng=2), Two(rng=2)]
    for world in worlds:
        world.adjust(getattr(world, group), policy=learn(name, memory), awareness=awareness_for(memory))
    worlds[0].run(8)
    for _ in range(8):
        worlds[1].step()
    assert worlds[0].observed_fraction == worlds[1].observed_fraction
    assert np.array_equal(worlds[0].first.position, worlds[1].first.position)


@pytest.mark.parametrize(
    ("group", "robots", "rows"), [("scouts", [7, 9], 100), ("foes", 5, 100), ("prey", 6, 120), ("beacons", 2, 40)]
)
def test_exploring_across_arrivals_keeps_a_row_for_each_step_and_robot(group: str, robots: Any, rows: int) -> None:
    world = Zoo(rng=1)
    memory = explore(world, 20, getattr(world, group))
    assert len(memory) == rows
    assert memory.settings["robots"] == robots
    sensors = {"scouts": {"targets"}, "foes": {"teammates"}}.get(group, set())
    assert set(memory.settings.get("sensors", ())) == sensors
    # Recording changes nothing.
    other = Zoo(rng=1)
    other.run(20)
    assert np.array_equal(world.scouts.position, other.scouts.position)


def test_exploring_with_an_awareness_whose_width_changes_is_refused() -> None:
    world = Zoo(rng=1)
    with pytest.raises(ValueError, match=r"28 and 32 inputs, because the team size has changed; use RingAwareness"):
        explore(world, 20, world.guards)


def test_the_settings_of_an_exploration_have_both_values_of_what_changed() -> None:
    world = Two(rng=1)

    def change() -> None:
        world.adjust(world.first, speed=0.3, policy="centroid")
        world.second[0].remove()

    world.clock.at(5, change)
    settings = explore(world, 10, world.first).settings
    assert settings["robot_speed"] == [0.1, 0.3]
    assert settings["robots"] == [6, 7]
    assert settings["policy"].startswith("RandomWalk(")
    assert ", then Centroid(" in settings["policy"]
    assert settings["sensing_range"] == 1.0


def test_the_settings_of_a_group_that_has_left_are_those_it_had() -> None:
    world = Two(rng=1)
    world.clock.at(5, lambda: [robot.remove() for robot in list(world.first)])
    memory = explore(world, 10, world.first)
    assert len(memory) == 25
    assert (memory.settings["robot_speed"], memory.settings["awareness_range"]) == (0.1, 1.0)
    assert memory.settings["robots"] == [2, 7]


def test_an_exploration_counts_the_steps_that_were_made() -> None:
    world = stopping(1)
    assert explore(world, 20).settings["steps"] == 3
    with pytest.raises(ValueError, match=r"has stopped \(running is False\); explore another, or set running to True"):
        explore(world, 20)


def test_transitions_under_different_degrees_are_not_joined() -> None:
    world = Two(rng=1)
    # As many inputs as a list of six teammates.
    world.adjust(world.first, awareness=RingAwareness(delta=12))
    world.clock.at(5, lambda: world.adjust(world.first, awareness="pairwise"))
    with pytest.raises(ValueError, match=r"recorded under RingAwareness\(delta=12\) and PairwiseAwareness\(\)"):
        explore(world, 10, world.first)


def test_nobody_on_a_team_explores_only_when_named() -> None:
    world = World(Two(rng=1).arena, rng=1)
    prey = world.add(Target, 3, policy=RandomWalk())
    with pytest.raises(ValueError, match="no robot is on a team; give the group"):
        explore(world, 5)
    with pytest.warns(UserWarning, match=r"'targets'.* senses nothing in the channel 'targets', so .* all facts are 0"):
        assert len(explore(world, 5, prey)) == 15
    world.add(Robot, 2, policy=RandomWalk(), awareness="ring")
    assert len(explore(world, 5)) == 10


def test_exploring_many_worlds_gathers_one_group_whatever_the_workers(pool: WorkerPool) -> None:
    memory = explore_worlds(Two, 20, 3, group="second", rng=5)
    assert len(memory) == 3 * 20 * 2
    assert memory.settings["degree"] == "pairwise"
    seeds = [one["seed"] for one in memory.settings["merged"]]
    first, *others = [explore(world := Two(rng=seed), 20, world.second) for seed in seeds]
    assert memory.digest == first.merge(*others).digest
    assert explore_worlds(Two, 20, 3, group="second", rng=5, pool=pool).digest == memory.digest
    assert len(explore_worlds(Two, 20)) == 100
    with pytest.raises(JobError, match="group='third': the world has no such group; known are 'first', 'second', 'prey'"):
        explore_worlds(Two, 20, group="third")


def test_rows_across_arrivals_are_those_of_the_robots_that_are_there() -> None:
    worlds = [Zoo(rng=1), Zoo(rng=1)]
    for world in worlds:
        world.recording.record_transitions(world.scouts)
    worlds[0].run(20)
    for _ in range(20):
        worlds[1].step()
    found, stepped = (world.recording.transitions(world.scouts) for world in worlds)
    assert np.array_equal(found.situation, stepped.situation)
    # A robot's next situation is its situation of the step after; two robots more from tick 10 on.
    before, after = found.situation[:40].reshape(10, 4, -1), found.next_situation[:40].reshape(10, 4, -1)
    assert np.array_equal(before[1:], after[:-1])
    before, after = found.situation[40:].reshape(10, 6, -1), found.next_situation[40:].reshape(10, 6, -1)
    assert np.array_equal(before[1:], after[:-1])


def test_what_does_not_count_is_in_no_observed_fraction() -> None:
    world = Zoo(rng=1)
    world.run(5)
    sensing = [*world.scouts, *world.foes]
    seen = {target.unique_id for robot in sensing for target in robot.sensed("targets")}
    assert world.observed == len(seen) / 6
    assert any(robot.sensed("rivals") for robot in world.guards)


def test_the_graph_over_time_is_that_of_active_robots() -> None:
    def failing() -> CMOMMT:
        model = CMOMMT(robots=10, radius=1.5, policy="random-walk", rng=6)
        model.attach(Failures(10.0, 10.0), model.robots)
        model.recording.record_positions()
        return model

    stepped, recorded = failing(), failing()
    live = neighbour_graph.over_time(stepped, 40).iloc[1:].reset_index(drop=True)
    sensed = neighbour_graph.over_time(failing(), 40, sensed=True).iloc[1:].reset_index(drop=True)
    recorded.run(40)
    trajectory = recorded.recording.trajectory
    robots = trajectory[trajectory["group"] == "robots"]
    kept = neighbour_graph.over_trajectory(robots, 1.0)
    pd.testing.assert_frame_equal(live, kept, check_dtype=False)
    pd.testing.assert_frame_equal(live, sensed)
    assert live["robots"].min() < 10
    assert of_world(recorded).components["components"].tolist() == live["components"].tolist()
