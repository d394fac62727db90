"""Sensors in use: reused worlds, changes in mid-run, what counts, policies and transitions."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from sensed_worlds import SENSORS, fingerprint, herd, percept_of, shown

from teamsight import CMOMMT, Sensor, World, run_many
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.sensing.sensor import standard_sense
from teamsight.core.kernel import kernel

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


@pytest.mark.parametrize("name", SENSORS)
def test_a_reused_world_gives_the_bits_of_a_new_one(name: str) -> None:
    worlds = ReusedWorlds()
    settings = {"robots": 7, "targets": 9, "radius": 2.0, "awareness": "pairwise", "sensor": SENSORS[name]}
    runs = [(settings | {"radius": radius}, seed) for radius, seed in ((2.0, 1), (2.0, 2), (3.0, 2), (2.0, 1))]
    worlds.expect(runs)
    used = set()
    for parameters, seed in runs:
        world, new = worlds.begin(CMOMMT, parameters, seed), CMOMMT(**parameters, rng=seed)
        for each in (world, new):
            each.run(25)
        assert fingerprint(world) == fingerprint(new)
        used.add(id(world))
    assert len(used) == 1
    worlds.close()


def test_a_sensor_that_a_run_changes_does_not_stay_for_the_next() -> None:
    worlds, parameters = ReusedWorlds(), {"robots": 5, "targets": 9, "radius": 2.0}
    for seed, change in (
        (1, lambda world: setattr(world, "sensor", Sensor(missed=0.5))),
        (2, lambda world: world.robots.sensors.update(teammates=Sensor(range_noise=0.1))),
        (3, lambda world: world.senses(world.robots, world.targets, as_="prey", counts=True)),
    ):
        world = worlds.begin(CMOMMT, parameters, seed)
        world.run(5)
        change(world)
        following, new = worlds.begin(CMOMMT, parameters, seed + 10), CMOMMT(**parameters, rng=seed + 10)
        for each in (following, new):
            each.run(20)
        assert fingerprint(following) == fingerprint(new)
    worlds.close()


def test_run_many_takes_sensors() -> None:
    sensors = [None, SENSORS["all"], Sensor(missed=1.0)]
    table = run_many({"sensor": sensors, "robots": 4, "targets": 4}, seeds=[3, 4], steps=40)
    # As worker processes receive them.
    assert pickle.loads(pickle.dumps(sensors)) == sensors
    for _, row in table.iterrows():
        model = CMOMMT(robots=4, targets=4, sensor=row["sensor"], rng=int(row["seed"]))
        model.run(40)
        assert row["observed_fraction"] == model.observed_fraction


def test_a_sensor_that_is_set_in_mid_run_works_from_there_on() -> None:
    def make(*runs: int) -> World:
        world = herd({}, seed=8)
        for steps in runs:
            world.run(steps)
        world.groups[0].sensors["targets"] = SENSORS["all"]
        world.groups[0].sensors["teammates"] = SENSORS["delay"]
        return world

    one, other = make(10), make(3, 7)
    one.run(20)
    for _ in range(20):
        other.step()
    assert fingerprint(one) == fingerprint(other)
    unchanged = herd({}, seed=8)
    unchanged.run(30)
    assert not np.array_equal(unchanged.groups[0].position, one.groups[0].position)
    del one.groups[0].sensors["targets"], one.groups[0].sensors["teammates"]
    exact = percept_of(one.groups[0]).targets
    assert np.array_equal(exact.identity, one.groups[0].relations["targets"].identity[: len(exact.identity)])
    assert np.array_equal(exact.start, one.groups[0].relations["targets"].graph.start)


def test_agents_that_leave_while_measurements_are_on_their_way() -> None:
    def make() -> World:
        world = herd({"targets": Sensor(delay=4), "teammates": Sensor(delay=2)}, seed=4)
        world.clock.at(9, lambda: [world.groups[2][0].remove(), world.groups[0][2].remove()])
        return world

    one, other = make(), make()
    one.run(20)
    for _ in range(20):
        other.step()
    assert fingerprint(one) == fingerprint(other)


def test_only_true_detections_count_and_neighbours_are_geometry() -> None:
    blind, plain = herd({"targets": Sensor(missed=1.0, false_positives=1.0)}), herd({})
    for world in (blind, plain):
        world.run(1)
    assert blind.observed == 0 < plain.observed
    assert blind.observed_fraction == 0
    assert (percept_of(blind.groups[0]).targets.start > 0).any()
    assert not any(robot.observed_targets for robot in blind.groups[0])
    assert not any(deer.is_observed for deer in blind.groups[2])
    assert blind.max_neighbours == plain.max_neighbours
    hidden = herd({"teammates": Sensor(missed=1.0)})
    hidden.run(1)
    assert hidden.max_neighbours == plain.max_neighbours > 0
    assert percept_of(hidden.groups[0]).teammates.start[-1] == 0


def test_noise_belongs_to_agents_not_to_rows() -> None:
    """An agent that leaves changes what observers measure of no other agent."""
    sensor = Sensor(range_noise=0.1, missed=0.3)
    one, other = (herd({"targets": sensor, "teammates": sensor}, awareness="pairwise", seed=6) for _ in range(2))
    leaver, gone = other.groups[0][1], other.groups[2][3]
    identities = {leaver.unique_id, gone.unique_id}
    leaver.remove()
    gone.remove()
    rows = [0, 2, 3, 4, 5]
    for channel in ("targets", "teammates"):
        before, after = shown(getattr(percept_of(one.groups[0]), channel)), shown(getattr(percept_of(other.groups[0]), channel))
        for row, found in zip(rows, after, strict=True):
            assert found == {key: way for key, way in before[row].items() if key not in identities}


@pytest.mark.parametrize("awareness", ["ring", "nearest", "pairwise", "shared"])
@pytest.mark.parametrize("policy", ["a-cmommt", "evolved", "centroid"])
def test_policies_and_degrees_cope_with_the_worst_sensors(policy: str, awareness: str) -> None:
    worst = Sensor(range_noise=5.0, bearing_noise=3.0, false_positives=1.0, delay=1)
    model = CMOMMT(robots=6, targets=6, radius=1.0, policy=policy, awareness=awareness, sensor=worst, rng=2)
    model.robots.sensors["teammates"] = worst
    for _ in range(10):
        model.run(10)
        assert np.isfinite(model.robots.position).all()
        situations = np.array([robot.situation for robot in model.robots])
        assert situations.min() >= 0
        assert situations.max() <= 1


@pytest.mark.parametrize("name", SENSORS)
def test_transitions_are_the_same_on_both_paths_and_count_true_detections(name: str) -> None:
    one, other = (herd(dict.fromkeys(("targets", "teammates"), SENSORS[name]), seed=9) for _ in range(2))
    for world in (one, other):
        for group in world.groups[:2]:
            world.recording.record_transitions(group)
    one.run(30)
    counts = []
    for _ in range(30):
        other.step()
        counts.append([[len(robot.observed_targets) for robot in group] for group in other.groups[:2]])
    for number, group in enumerate(one.groups[:2]):
        found, again = one.recording.transitions(group), other.recording.transitions(other.groups[number])
        for a, b in zip([*found[:3], *found.facts.values()], [*again[:3], *again.facts.values()], strict=True):
            assert a.tobytes() == b.tobytes()
        assert found.facts["sensed"].tolist() == [count for step in counts for count in step[number]]


_MISSED = tuple(Sensor(missed=0.3).parameters.tolist())


@kernel
def _greedy(view: Any, parameters: Any, sensed: Any) -> int:
    need = 10 * view.in_range.start[view.heading.shape[0]] + 100
    if parameters[0] > 0.0:
        return sensed.distance.shape[0] + 1
    if need <= sensed.distance.shape[0]:
        standard_sense(view, _MISSED, sensed)
    return need


class Greedy(Sensor):
    """Needs more room than the engine expects; without end if it is given a range noise."""

    sense = _greedy

    @property
    def parameters(self) -> Any:
        return np.array([self.range_noise])


def test_a_sensor_gets_the_room_that_it_asks_for() -> None:
    channels = ("targets", "teammates")
    greedy = herd(dict.fromkeys(channels, Greedy(delay=1)))
    plain = herd(dict.fromkeys(channels, Sensor(missed=0.3, delay=1)))
    for world in (greedy, plain):
        world.run(25)
    assert fingerprint(greedy) == fingerprint(plain)


def test_a_sensor_that_never_has_enough_room_is_named() -> None:
    world = herd({"targets": Greedy(range_noise=1.0)})
    with pytest.raises(ValueError, match=r"sensors\['targets'\]=Greedy\(range_noise=1.0\) of fast: sense asks .* check"):
        world.run(1)
    assert world.tick == 0
    del world.groups[0].sensors["targets"], world.groups[1].sensors["targets"]
    world.run(1)


def test_a_state_with_measurements_on_their_way_goes_on_in_an_equal_world() -> None:
    sensors = {"targets": SENSORS["all"], "teammates": SENSORS["delay"]}
    one, other = herd(sensors), herd(sensors, seed=2)
    one.run(11)
    saved = pickle.loads(pickle.dumps(one.state()))
    other.run(3)
    other.restore(saved)
    for world in (one, other):
        world.run(9)
    assert fingerprint(one) == fingerprint(other)


def test_agents_that_arrive_sense_and_are_sensed() -> None:
    def make() -> World:
        world = herd({"targets": SENSORS["all"], "teammates": Sensor(delay=2, false_positives=0.5)})
        world.clock.at(7, lambda: world.groups[0].add(3))
        world.clock.at(9, lambda: world.groups[0][1].remove())
        world.clock.at(11, lambda: world.groups[2].add(4))
        return world

    one, other = make(), make()
    one.run(30)
    for _ in range(30):
        other.step()
    assert fingerprint(one) == fingerprint(other)
    assert len(one.groups[0]) == 8


def test_groups_without_agents_are_sensed_and_sense() -> None:
    world = herd({"targets": SENSORS["all"], "teammates": SENSORS["all"]})
    for group in (world.groups[2], world.groups[3], world.groups[0]):
        for agent in list(group):
            agent.remove()
        world.run(2)
    assert world.tick == 6
