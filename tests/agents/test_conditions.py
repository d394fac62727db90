"""An agent that is inactive takes no part; a sensor that is out of order finds nobody; both show at once."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from arenas import Cylinder

from teamsight import CMOMMT, Box, Circle, Disc, Robot, Sensor, Target, Torus, World
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.policies import RandomWalk

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

WALK = RandomWalk(random_distance=True)


def row(arena: Any = None, sensor: Sensor | None = None) -> World:
    """Return a world of three robots and two targets in a row, each within range of the next ones only."""
    world = World(arena or Box(20.0, 20.0), rng=1)
    far = {"sensing_range": 1.1, "awareness_range": 1.1, "speed": 0.0}
    robots = world.add(Robot, 3, policy="stationary", awareness="shared", position=[(0, 0), (1, 0), (2, 0)], **far)
    targets = world.add(Target, 2, policy="stationary", position=[(0, 1), (2, 1)], **far)
    world.senses(robots, targets, sensor=sensor)
    return world


def test_lists_and_shares_show_a_failure_at_once() -> None:
    world = row()
    robots, targets = world.groups
    assert (world.observed, world.mean_degree) == (1.0, 4 / 3)
    robots[1].active = False
    assert robots[0].neighbours == robots[1].neighbours == robots[2].neighbours == []
    assert robots[0].percept.relayed.identity.tolist() == []
    assert (world.observed, world.mean_degree) == (1.0, 0.0)
    robots[0].active = False
    assert targets[0].observers == []
    assert not targets[0].is_observed
    assert world.observed == 0.5
    targets[0].active = False
    assert world.observed == 1.0
    robots[1].active = True
    assert [robot.unique_id for robot in robots[1].neighbours] == [robots[2].unique_id]
    assert world.mean_degree == 1.0
    assert robots.active.tolist() == [False, True, True]


def test_shares_are_those_of_whom_is_active_in_each_step() -> None:
    world = row()
    robots, targets = world.groups
    world.run(2)
    robots[0].active = targets[1].active = False
    world.run(3)
    for robot in robots:
        robot.active = False
    world.run(1)
    targets[0].active = False
    world.run(1)
    history = world.recording.history
    assert history["observed"].tolist()[:6] == [1, 1, 0, 0, 0, 0]
    assert math.isnan(history["observed"].iloc[6])
    assert history["mean_neighbours"].tolist()[:5] == [4 / 3, 4 / 3, 1, 1, 1]
    assert history["mean_neighbours"].iloc[5:].isna().all()
    # Rows without targets, or without robots, do not count.
    assert world.observed_fraction == 2 / 6
    assert world.recording.mean_neighbours == pytest.approx((2 * 4 / 3 + 3) / 5, rel=1e-12)
    assert math.isnan(world.observed)
    collected = world.datacollector.get_model_vars_dataframe()
    assert collected["observed_fraction"].iloc[-1] == world.observed_fraction


def test_a_sensor_out_of_order_finds_nobody_in_its_channel_only() -> None:
    world = row()
    robots, targets = world.groups
    robots[0].break_sensor("targets")
    assert robots[0].observed_targets == []
    assert [robot.unique_id for robot in robots[0].neighbours] == [robots[1].unique_id]
    assert [robot.unique_id for robot in robots[1].neighbours] == [robots[0].unique_id, robots[2].unique_id]
    assert world.observed == 0.5
    robots[1].break_sensor("teammates")
    assert robots[1].neighbours == []
    assert world.mean_degree == 2 / 3
    assert robots.channels["targets"].works.tolist() == [False, True, True]
    robots[0].repair_sensor("targets")
    assert robots[0].observed_targets == [targets[0]]
    assert robots[0].sensor_works("targets")
    assert not robots[1].sensor_works("teammates")


@pytest.mark.parametrize("arena", [Disc(3.0), Torus(4.0, 5.0), Box(5.0, 4.0).with_obstacles(Circle((0.5, 0.5), 0.5)), Cylinder(6.0, 5.0)])
def test_an_inactive_body_stays_where_it_is(arena: Any) -> None:
    world = World(arena, rng=4)
    robots = world.add(Robot, 8, policy=WALK, speed=0.4)
    still = robots[2:5]
    for robot in still:
        robot.active = False
    before, facing = robots.position.copy(), robots.heading.copy()
    world.run(25)
    moved = (robots.position != before).any(axis=1)
    assert moved.tolist() == [True, True, False, False, False, True, True, True]
    assert (robots.heading[2:5] == facing[2:5]).all()
    assert not robots.bodies.moved[2:5].any()
    still[0].active = True
    world.run(1)
    assert robots.bodies.moved[2].any()


def test_a_delayed_list_shows_nobody_who_is_inactive_now() -> None:
    world = row(sensor=Sensor(delay=2))
    robots, targets = world.groups
    world.run(4)
    assert robots[0].percept.targets.identity.tolist() == [targets[0].unique_id]
    targets[0].active = False
    assert robots[0].percept.targets.identity.tolist() == []
    targets[0].active = True
    world.run(1)
    # What was measured before is delivered, now that it is true again.
    assert robots[0].percept.targets.identity.tolist() == [targets[0].unique_id]
    targets[0].active = False
    world.run(2)
    # At tick 7 it is there again and is measured; at tick 6 it was not.
    targets[0].active = True
    world.run(1)
    assert robots[0].percept.targets.identity.tolist() == []
    world.run(1)
    assert robots[0].percept.targets.identity.tolist() == [targets[0].unique_id]
    robots[0].break_sensor("targets")
    assert robots[0].percept.targets.identity.tolist() == []


def test_nobody_imagines_an_agent_that_is_inactive() -> None:
    world = World(Disc(2.0), rng=2)
    robots = world.add(Robot, 6, policy=WALK, awareness="pairwise", awareness_range=0.1)
    robots.sensors["teammates"] = Sensor(false_positives=1.0)
    world.run(1)
    assert len(robots.neighbours("teammates").identity) == 6
    robots[0].active = robots[1].active = False
    for _ in range(20):
        world.run(1)
        shown = robots.neighbours("teammates")
        assert shown.start[2] == 0
        assert not set(shown.identity.tolist()) & {robots[0].unique_id, robots[1].unique_id}


def test_trajectories_and_transitions_leave_out_whom_is_inactive() -> None:
    model = CMOMMT(robots=4, targets=6, radius=2.0, policy=WALK, awareness="ring", rng=5)
    model.recording.record_positions()
    model.recording.record_transitions(model.robots)
    model.run(3)
    model.robots[1].active = False
    model.run(4)
    model.robots[1].active = True
    model.run(2)
    track = model.recording.trajectory
    own = track[track["identity"] == model.robots[1].unique_id]
    assert own["x"].isna().tolist() == [False] * 3 + [True] * 4 + [False] * 2
    assert not track[track["identity"] != model.robots[1].unique_id].isna().any(axis=None)
    kept = model.recording.transitions(model.robots)
    assert len(kept.situation) == 4 * 9 - 4
    assert not any(np.isnan(facts).any() for facts in kept.facts.values())


def test_a_run_after_repair_and_reset_is_that_of_a_new_world() -> None:
    def bits(model: CMOMMT) -> list[bytes]:
        return [model.robots.position.tobytes(), model.recording.history.to_csv().encode(), repr(model.observed_fraction).encode()]

    new, used = (CMOMMT(robots=5, targets=8, radius=3.0, rng=7) for _ in range(2))
    used.run(10)
    used.robots[0].active = used.targets[3].active = False
    used.robots[2].break_sensor("targets")
    used.run(10)
    used.reset()
    assert used.robots.active.all()
    assert used.robots[2].sensor_works("targets")
    new.run(50)
    used.run(50)
    assert bits(used) == bits(new)


def test_reused_worlds_begin_with_all_active() -> None:
    worlds, parameters = ReusedWorlds(), {"robots": 5, "targets": 8, "radius": 3.0}
    first = worlds.begin(CMOMMT, parameters, 1)
    first.run(5)
    first.groups[0][0].active = False
    first.run(5)
    again, new = worlds.begin(CMOMMT, parameters, 2), CMOMMT(**parameters, rng=2)
    again.run(40)
    new.run(40)
    assert again.groups[0].active.all()
    assert again.recording.history.equals(new.recording.history)
    assert again.datacollector.get_model_vars_dataframe().equals(new.datacollector.get_model_vars_dataframe())


def test_states_hold_conditions() -> None:
    model, other = (CMOMMT(robots=5, targets=5, radius=2.0, rng=3) for _ in range(2))
    model.run(3)
    model.robots[1].active = False
    model.robots[2].break_sensor("targets")
    model.run(3)
    saved = pickle.loads(pickle.dumps(model.state()))
    model.run(10)
    other.restore(saved)
    assert other.robots.active.tolist() == [True, False, True, True, True]
    assert not other.robots[2].sensor_works("targets")
    other.run(10)
    assert np.array_equal(other.robots.position, model.robots.position)
    assert other.recording.history.equals(model.recording.history)


def test_conditions_follow_their_agents() -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 5, policy=WALK)
    failed, blind = robots[2], robots[3]
    failed.active = False
    blind.break_sensor("teammates")
    robots[0].remove()
    robots[3].remove()
    (new,) = robots.add(1)
    assert [robot.active for robot in robots] == [True, False, True, True]
    assert new.active
    assert [robot.sensor_works("teammates") for robot in robots] == [True, True, False, True]
    assert failed.row == 1
    with pytest.raises(ValueError, match="removed"):
        failed.remove() or setattr(failed, "active", True)


def test_the_first_change_binds_and_later_ones_do_not() -> None:
    model = CMOMMT(robots=5, targets=5, rng=1)
    model.run(1)
    engine = model._engine
    model.robots[0].active = True
    assert engine.is_bound
    assert engine.is_seen
    model.robots[0].active = False
    assert not engine.is_bound
    model.run(1)
    model.robots[1].active = False
    model.robots[0].active = True
    model.robots[2].break_sensor("targets")
    assert engine.is_bound
    assert not engine.is_seen


def test_lists_grow_when_many_agents_come_back() -> None:
    world = World(Disc(30.0), rng=3)
    # So many that room is not made for all pairs.
    robots = world.add(Robot, 90, awareness_range=3.0, policy=WALK)
    for robot in robots[:60]:
        robot.active = False
        robot.position = (0.0, 0.0)
    world.run(1)
    for number in range(0, 60, 10):
        for robot in robots[number : number + 10]:
            robot.active = True
        assert len(robots[0].neighbours) >= number + 9


def test_mesas_space_does_not_find_whom_is_inactive() -> None:
    world = row()
    robots, _ = world.groups
    robots[1].active = False
    assert robots[1].pos is not None
    assert robots[1] not in robots[0].get_neighbors_in_radius(5.0)[0]
    assert robots[1] not in robots[0].get_nearest_neighbors(9)[0]
    assert robots[1] not in world.space.get_k_nearest_agents((1, 0), 3)[0]
    assert len(world.space.agents) == 5


def test_displays_say_who_is_inactive() -> None:
    world = row()
    robots, _ = world.groups
    assert "inactive" not in repr(world)
    robots[1].active = False
    robots[2].break_sensor("targets")
    assert "3 robots (1 inactive)" in repr(world)
    assert "3 agents (1 inactive)" in repr(robots)
    assert repr(robots[1]).endswith(", inactive>")
    assert "inactive" in robots[1]._repr_html_()
    assert "out of order" in robots[2]._repr_html_()
    assert "(1 inactive)" in world._repr_html_()


def test_what_cannot_be_is_refused() -> None:
    class Suicidal(Robot):
        def decide(self, percept: Any, rng: np.random.Generator) -> tuple[float, float]:
            self.active = False
            return 0.0, 0.0

    world = row()
    robots, targets = world.groups
    for value in (0, 1, None, "no", math.nan):
        with pytest.raises(TypeError, match="active=.*True or False"):
            robots[0].active = value
    robots[0].active = np.bool_(False)
    assert robots[0].active is False
    with pytest.raises(AttributeError, match=r"robots\[0\].active"):
        robots.active = False
    with pytest.raises(ValueError, match="read-only"):
        robots.active[0] = True
    with pytest.raises(KeyError, match="'lidar'.*no such channel, but 'teammates', 'targets'.*senses"):
        robots[0].break_sensor("lidar")
    with pytest.raises(KeyError, match="but none"):
        targets[0].sensor_works("targets")
    world.add(Suicidal, 1)
    with pytest.raises(RuntimeError, match=r"active: called in decide.*clock\.at"):
        world.step()
    assert world.tick == 0


def test_late_relayed_lists_show_nobody_who_is_inactive_now() -> None:
    world = row()
    robots, targets = world.groups
    robots.sensors["teammates"] = Sensor(delay=2)
    world.run(5)
    assert robots[1].percept.relayed.identity.tolist() == [targets[0].unique_id, targets[1].unique_id]
    targets[0].active = False
    assert robots[1].percept.relayed.identity.tolist() == [targets[1].unique_id]
    targets[0].active = True
    robots[0].break_sensor("targets")
    # What this one has sensed before, it still relays; it is there and knows of it.
    assert robots[1].percept.relayed.identity.tolist() == [targets[0].unique_id, targets[1].unique_id]
    robots[0].active = False
    assert robots[1].percept.relayed.identity.tolist() == [targets[1].unique_id]
