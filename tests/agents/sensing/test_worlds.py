"""Sensors in worlds: percepts are what the slow twin senses, and all ways to run a world give the same bits."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from chance import fresh_seed
from naive import paper
from naive import sensing as naive

from teamsight import CMOMMT, Box, Circle, Disc, Robot, Sensor, Target, Torus, World, run_many
from teamsight.agents.awareness import NoAwareness, PairwiseAwareness, RingAwareness, SharedAwareness
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.agents.sensing import View
from teamsight.agents.sensing.interface import salt_of
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies import ACmommt, Centroid
from teamsight.world.noise import Stream, stream_number

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

WIDE = math.radians(120)
SENSORS = {
    "view": Sensor(field_of_view=WIDE), "range": Sensor(range_noise=0.1), "bearing": Sensor(bearing_noise=0.2),
    "missed": Sensor(missed=0.3), "false": Sensor(false_positives=0.4), "delay": Sensor(delay=3),
    "all": Sensor(WIDE, 0.1, 0.2, 0.2, 0.3, 2),
}  # fmt: skip
DEGREES = [NoAwareness(), RingAwareness(5), PairwiseAwareness(), SharedAwareness()]
# One arena in which sight is blocked, and one large enough for the search in cells.
ARENAS = {
    "disc": Disc(2.0), "torus": Torus(4.0, 5.0),
    "obstacles": Box(4.0, 4.0).with_obstacles(Circle((0.5, 0.5), 0.4), Circle((-1.0, 0.0), 0.3)),
}  # fmt: skip


def herd(sensors: dict[str, Sensor], arena: Any = ARENAS["disc"], seed: int = 1, **options: Any) -> World:
    """Return a world of two groups of robots, two of targets, and predators, with these sensors by channel."""
    world = World(arena, rng=seed)
    degree = options.get("awareness", "shared")
    fast = world.add(Robot, 6, policy=options.get("policy", ACmommt()), awareness=degree, speed=0.1, name="fast")
    slow = world.add(Robot, 3, policy=Centroid(), awareness=degree, awareness_range=[0.5, 1.0, 1.8], name="slow")
    deer = world.add(Target, 5, policy="evasive", speed=0.08, sensing_range=0.7, name="deer")
    flies = world.add(Target, options.get("flies", 9), policy="random-walk", name="flies")
    for robots in (fast, slow):
        world.senses(robots, deer, sensor=sensors.get("targets"))
        world.senses(robots, flies)
        world.senses(robots, deer, as_="large", sensor=sensors.get("large"))
        if "teammates" in sensors:
            robots.sensors["teammates"] = sensors["teammates"]
    world.senses(deer, fast)
    return world


def expected(world: World, group: Any, channel: str, sensor: Sensor) -> list[dict[int, tuple[float, float]]]:
    """Return what the robots of a group sense now, by identity: the slow twin on the slow neighbour search."""
    observed = group.channels[channel].observed
    there = np.concatenate([other.position for other in observed])
    everyone = np.concatenate([other.identity for other in observed])
    sizes = [len(other) for other in observed]
    own = sum(sizes[: observed.index(group)]) if group in observed else -1
    reach = np.array([agent.awareness_range if channel == "teammates" else agent.sensing_range for agent in group])
    period = tuple(length if length else math.inf for length in world.arena.period)
    rows: list[list[int]] = [[] for _ in group]
    ways = []
    for i, here in enumerate(group.position):
        for j, place in enumerate(there):
            way = tuple((place - here).tolist())
            way = paper.shortest(way, period) if math.isfinite(sum(period)) else way
            if math.hypot(*way) <= reach[i] and not (own >= 0 and j == own + i):
                rows[i].append(j)
                ways.append(way)
    start = np.cumsum([0, *map(len, rows)])
    in_range = NeighbourList(start, np.array([j for row in rows for j in row]), np.array(ways), np.zeros(0))
    view = View(
        np.array([world.tick]), world._data.key, salt_of(channel), stream_number(Stream.SENSOR, group.number),
        group.bodies.member, group.position, group.heading, reach, everyone, own, in_range, world.arena.sight,
    )  # fmt: skip
    sensed = naive.sense(sensor, view, lambda here, way: _is_hidden(world, here, way, sensor))
    return [
        {int(everyone[index if index >= 0 else ~index]): way for index, way in robot.items()} for robot in sensed
    ]


def _is_hidden(world: World, here: Any, way: tuple[float, float], sensor: Sensor) -> bool:
    z, step, sight = complex(*here), complex(*way), world.arena.sight
    for x, y, radius in sight.discs if sensor.occluded else ():
        to = complex(x, y) - z
        share = min(max((to * step.conjugate()).real / abs(step) ** 2, 0), 1) if step else 0
        if abs(to - share * step) < radius - sight.slack:
            return True
    return False


def percept_of(group: Any) -> Any:
    """Return the percept at the present positions."""
    assert group[0].percept is not None
    return group.percept


def shown(percept: NeighbourList) -> list[dict[int, tuple[float, float]]]:
    return [
        {int(percept.identity[k]): tuple(percept.offset[k].tolist()) for k in range(begin, end)}
        for begin, end in zip(percept.start[:-1], percept.start[1:], strict=True)
    ]


@pytest.mark.parametrize("arena", ARENAS)
@pytest.mark.parametrize("name", SENSORS)
def test_percepts_are_what_the_slow_twin_senses(name: str, arena: str) -> None:
    sensor = SENSORS[name]
    world = herd({"targets": sensor, "teammates": sensor, "large": sensor}, ARENAS[arena], fresh_seed(), awareness="pairwise")
    measured: dict[tuple[Any, str], list[Any]] = {}
    for _ in range(8):
        for group in world.groups[:2]:
            for channel in ("targets", "teammates", "large"):
                lists = measured.setdefault((group, channel), [])
                lists.append(expected(world, group, channel, sensor))
                due = lists[-1 - sensor.delay] if len(lists) > sensor.delay else [{}] * len(group)
                percept = percept_of(group)
                found = shown(percept.channels.large if channel == "large" else getattr(percept, channel))
                for one, other in zip(found, due, strict=True):
                    assert one.keys() == other.keys()
                    for identity, way in one.items():
                        assert way == pytest.approx(other[identity], abs=1e-9)
        world.run(2) if sensor.delay == 0 else world.step()


def fingerprint(world: World) -> list[bytes]:
    """Return all that a user can see of what has happened."""
    seen: list[Any] = [world.tick, world.observed, world.observed_fraction, world.mean_neighbours, world.max_neighbours]
    for group in world.groups:
        seen += [group.position, group.heading, group.identity, *(group.policy_state or ())]
        for channel in group.channels:
            seen += list(group.neighbours(channel))
            seen += [[each.unique_id for each in agent.sensed(channel)] for agent in group]
        percept = percept_of(group)
        seen += [*percept.targets, *percept.teammates, *percept.relayed, percept.situation]
        seen += [agent.situation for agent in group if isinstance(agent, Robot)]
    return [*(np.asarray(part, float).tobytes() for part in seen), world.recording.history.to_csv().encode()]


PATHS: list[Callable[[World], None]] = [
    lambda world: [world.step() for _ in range(30)] and None,
    lambda world: [world.run(k) for k in (1, 2, 3, 5, 7, 11, 1)] and None,
    lambda world: [world.run(9), world.step(), world.reset(), world.run(14), world.step(), world.run(15)] and None,
    lambda world: [world.run(14), world.step(), _restored(world), world.run(15)] and None,
]


def _restored(world: World) -> None:
    saved = pickle.loads(pickle.dumps(world.state()))
    world.run(7)
    world.restore(saved)


def assert_one_answer(make: Callable[[], World]) -> None:
    reference = make()
    reference.run(30)
    wanted = fingerprint(reference)
    for number, path in enumerate(PATHS):
        world = make()
        path(world)
        found = fingerprint(world)
        assert [k for k, pair in enumerate(zip(wanted, found, strict=True)) if pair[0] != pair[1]] == [], number


@pytest.mark.parametrize("arena", ARENAS)
@pytest.mark.parametrize("name", SENSORS)
def test_every_sensor_in_every_channel_on_every_path(name: str, arena: str) -> None:
    seed, sensor = fresh_seed(), SENSORS[name]
    assert_one_answer(lambda: herd({"targets": sensor, "teammates": sensor, "large": sensor}, ARENAS[arena], seed))


@pytest.mark.parametrize("awareness", DEGREES, ids=str)
def test_every_degree_of_awareness_with_a_sensor_of_teammates(awareness: Any) -> None:
    seed = fresh_seed()
    assert_one_answer(lambda: herd({"teammates": SENSORS["all"]}, ARENAS["torus"], seed, awareness=awareness))


def test_a_python_policy_gives_the_bits_of_its_kernel() -> None:
    class InPython(ACmommt):
        def decide(self, percept: Any, state: Any, noise: Any) -> Any:
            return super().decide(percept, state, noise)

    sensors = dict.fromkeys(("targets", "teammates"), SENSORS["all"])
    kernel, python = herd(sensors), herd(sensors, policy=InPython())
    for world in (kernel, python):
        world.run(40)
    assert np.array_equal(kernel.groups[0].position, python.groups[0].position)
    assert not python.groups[0].is_compiled


@pytest.mark.parametrize("arena", [Disc(9.0), Torus(16.0, 16.0)], ids=str)
def test_the_search_in_cells(arena: Any) -> None:
    reference, other = _many(arena), _many(arena)
    reference.run(12)
    assert reference.groups[0].relations["targets"].search.has_cells
    for _ in range(12):
        other.step()
    assert fingerprint(reference) == fingerprint(other)


def _many(arena: Any) -> World:
    world = World(arena, rng=5)
    robots = world.add(Robot, 90, policy="a-cmommt", awareness="shared")
    targets = world.add(Target, 90, policy="random-walk")
    world.senses(robots, targets, sensor=SENSORS["all"])
    robots.sensors["teammates"] = SENSORS["all"]
    return world


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


def test_run_many_takes_sensors() -> None:
    sensors = [None, SENSORS["all"], Sensor(missed=1.0)]
    table = run_many({"sensor": sensors, "robots": 4, "targets": 4}, seeds=[3, 4], steps=40)
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
