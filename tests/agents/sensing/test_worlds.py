"""Sensors in worlds: percepts are what the slow twin senses, and all ways to run a world give the same bits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from chance import fresh_seed
from naive import paper
from naive import sensing as naive
from sensed_worlds import ARENAS, SENSORS, assert_one_answer, fingerprint, herd, percept_of, shown

from teamsight import Disc, Robot, Sensor, Target, Torus, World
from teamsight.agents.awareness import NoAwareness, PairwiseAwareness, RingAwareness, SharedAwareness
from teamsight.agents.sensing import View
from teamsight.agents.sensing.sensor import salt_of
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies import ACmommt
from teamsight.world.noise import Stream, stream_number

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

DEGREES = [NoAwareness(), RingAwareness(5), PairwiseAwareness(), SharedAwareness()]


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
    robots = world.add(Robot, 100, policy="a-cmommt", awareness="shared")
    targets = world.add(Target, 100, policy="random-walk")
    world.senses(robots, targets, sensor=SENSORS["all"])
    robots.sensors["teammates"] = SENSORS["all"]
    return world
