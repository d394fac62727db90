"""Occlusion by bodies: what is hidden is what a direct computation says, on every path, and in any order of agents."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from chance import fresh_seed
from hypothesis import assume, given
from hypothesis import strategies as st
from naive import occlusion as naive
from sensed_worlds import assert_one_answer

from teamsight import CMOMMT, Box, Circle, Disc, Robot, Sensor, Target, Torus, World, check_sensor
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.core.kernel import Entry, Record
from teamsight.world.motion import bodies_at
from teamsight.world.occlusion import GATHER_BODIES, Opaque, gathering, is_hidden

BODIES = Sensor(occluded="bodies")
ARENAS = [
    Box(5.0, 4.0), Disc(2.5), Torus(5.0, 6.0), Torus(5.0, 6.0).with_obstacles(Circle((2.4, 0.3), 0.5)),
]  # fmt: skip


class Looks(NamedTuple):
    lines: Annotated[npt.NDArray[np.float64], "n", 4]
    hidden: Annotated[npt.NDArray[np.bool_], "n"]
    opaque: Opaque


LOOKS = Record(Looks)
looks_at = LOOKS.at


def _look(address: int) -> int:
    looks = looks_at(address)
    lines = looks.lines
    for k in range(lines.shape[0]):
        looks.hidden[k] = is_hidden(lines[k, 0], lines[k, 1], lines[k, 2], lines[k, 3], 0, 1, looks.opaque)
    return 0


LOOK = Entry(_look)


@given(
    seed=st.integers(0, 2**32), size=st.sampled_from([0, 1, 2, 3, 20, 64, 65, 90, 300]),
    arena=st.sampled_from([Box(4.0, 4.0), Box(30.0, 0.5), Torus(4.0, 6.0), Torus(2.0, 40.0), Disc(3.0)]),
    widest=st.sampled_from([0.01, 0.1, 0.5]), whole=st.booleans(),
)  # fmt: skip
def test_what_is_hidden_is_what_the_slow_twin_says(
    seed: int, size: int, arena: Any, widest: float, whole: bool
) -> None:
    rng = np.random.default_rng(seed)
    position = arena.place(*rng.random((2, size + 20)))
    # On whole numbers lines run along the cells, and places coincide.
    position = np.rint(position * 2) / 2 if whole else position
    table = bodies_at(position[:size], np.tile([1.0, 0.0], (size, 1)))
    table.radius[:] = rng.uniform(0, widest, size) * rng.integers(0, 2, size)
    table.active[:] = rng.random(size) < 0.8
    table.identity[:] = rng.permutation(size)
    record = gathering([table], arena)
    GATHER_BODIES(record)
    starts = position[size : size + 10]
    lines = np.concatenate([starts, arena.displacement(starts, position[size + 10 :])], axis=1)
    looks = LOOKS.pack(Looks(lines, np.zeros(10, np.bool_), record.value.opaque))
    LOOK(looks)
    active = table.active
    there = list(zip(table.position[active].tolist(), table.radius[active], table.identity[active].tolist(), strict=True))
    for line, is_found in zip(lines.tolist(), looks.value.hidden, strict=True):
        gaps = naive.clearances(line[:2], line[2:], (0, 1), there, arena.period)
        # A line that grazes a body is a matter of rounding.
        assume(all(abs(gap) > 1e-12 for gap in gaps))
        assert is_found == any(gap < 0 for gap in gaps)


def crowd(arena: Any, seed: int, *, robots: int = 14, contact: Any = "pass", delay: int = 0) -> World:
    """Return a world of robots, and of targets of several sizes, some of which are points."""
    sensor = Sensor(occluded="bodies", missed=0.1, delay=delay)
    world = World(arena, contact=contact, rng=seed)
    team = world.add(Robot, robots, policy="a-cmommt", awareness="pairwise", radius=0.15, speed=0.1,
                     sensing_range=1.9, awareness_range=1.9)  # fmt: skip
    prey = world.add(Target, 12, policy="random-walk", radius=[0.0, 0.1, 0.2] * 4, speed=0.1)
    world.senses(team, prey, sensor=sensor)
    team.sensors["teammates"] = sensor
    return world


def seen(world: World, channel: str) -> list[set[int]]:
    """Return whom the first group senses, by identity."""
    found = world.groups[0].neighbours(channel)
    return [set(found.identity[begin:end].tolist()) for begin, end in zip(found.start[:-1], found.start[1:], strict=True)]


def expected(world: World, channel: str) -> list[set[int]]:
    """Return the same by direct computation."""
    team, found = world.groups[0], []
    groups = [(group.position.tolist(), group.radius, group.identity.tolist()) for group in world.groups]
    bodies = [one for group in groups for one in zip(*group, strict=True)]
    active = {agent.unique_id for group in world.groups for agent in group if agent.active}
    bodies = [body for body in bodies if body[2] in active]
    for row, here in enumerate(team.position.tolist()):
        mine, row_found = int(team.identity[row]), set()
        for observed in team.channels[channel].observed:
            for place, identity in zip(observed.position, observed.identity.tolist(), strict=True):
                way = tuple(world.arena.displacement(here, place).tolist())
                if identity == mine or identity not in active or math.hypot(*way) > team.sensing_range[row]:
                    continue
                gaps = naive.clearances(here, way, (mine, identity), bodies, world.arena.period)
                if mine in active and all(gap >= 0 for gap in gaps):
                    row_found.add(identity)
        found.append(row_found)
    return found


@pytest.mark.parametrize("robots", [14, 60])
@pytest.mark.parametrize("arena", [Box(5.0, 4.0), Torus(5.0, 6.0)], ids=str)
def test_percepts_show_whom_no_body_hides(arena: Any, robots: int) -> None:
    world = crowd(arena, fresh_seed(), robots=robots)
    team = world.groups[0]
    for channel in ("targets", "teammates"):
        team.sensors[channel] = BODIES
    hidden = 0
    for _ in range(3):
        for channel in ("targets", "teammates"):
            wanted = expected(world, channel)
            assert seen(world, channel) == wanted
            hidden += int(team.relations[channel].graph.degree.sum()) - sum(map(len, wanted))
        world.run(2)
    assert hidden > 0


@pytest.mark.parametrize("delay", [0, 2])
@pytest.mark.parametrize("arena", ARENAS, ids=str)
def test_every_path_gives_the_same(arena: Any, delay: int) -> None:
    seed = fresh_seed()
    assert_one_answer(lambda: crowd(arena, seed, delay=delay))
    assert_one_answer(lambda: crowd(arena, seed, contact="slide", delay=delay))


@pytest.mark.short
def test_it_holds_the_eclipse_at_the_moment_of_sensing() -> None:
    world = World(Box(10.0, 10.0), rng=1)
    eye = world.add(Robot, 1, policy="stationary", position=[(-2.0, 0.0)], sensing_range=5.0, radius=0.5)
    moon = world.add(Target, 1, policy="stationary", position=[(0.0, 0.0)], radius=0.3)
    sun = world.add(Target, 1, policy="stationary", position=[(2.0, 0.0)], radius=0.5)
    world.senses(eye, sun, sensor=Sensor(occluded="bodies", delay=1))
    world.senses(eye, sun, as_="light", sensor=BODIES)
    world.run(2)
    assert seen(world, "targets") == seen(world, "light") == [set()]
    moon[0].position = (0.0, 0.301)
    assert (seen(world, "targets"), seen(world, "light")) == ([set()], [{sun[0].unique_id}])
    world.run(1)
    assert seen(world, "targets") == [{sun[0].unique_id}]
    moon[0].position = (0.0, 0.299)
    assert seen(world, "light") == [set()]
    moon[0].active = False
    assert seen(world, "light") == [{sun[0].unique_id}]
    moon[0].active = True
    assert seen(world, "light") == [set()]
    moon[0].remove()
    assert seen(world, "light") == [{sun[0].unique_id}]


@pytest.mark.short
def test_a_reused_world_gives_the_bits_of_a_new_one() -> None:
    parameters = {"radius": 2.0, "robot_radius": 0.3, "target_radius": 0.3, "sensor": BODIES, "robots": 12}
    worlds, seeds = ReusedWorlds(), [fresh_seed(), fresh_seed()]
    worlds.expect([(parameters, seed) for seed in seeds])
    for seed in seeds:
        reused, new = worlds.begin(CMOMMT, parameters, seed), CMOMMT(**parameters, rng=seed)
        for world in (reused, new):
            world.run(30)
        assert np.array_equal(reused.robots.position, new.robots.position)
        assert reused.recording.history.equals(new.recording.history)
        plain = CMOMMT(**{**parameters, "sensor": Sensor()}, rng=seed)
        plain.run(30)
        assert not plain.recording.history.equals(new.recording.history)
    worlds.close()


@pytest.mark.short
def test_points_hide_nobody() -> None:
    plain, other = CMOMMT(rng=1), CMOMMT(sensor=BODIES, rng=1)
    for model in (plain, other):
        model.run(40)
    assert plain.recording.history.equals(other.recording.history)


def seen_in_order(arena: Any, order: list[int]) -> set[tuple[Any, Any]]:
    """Return the places of each robot and of each that it senses, if robots are added in this order."""
    rng = np.random.default_rng(5)
    place, radius = rng.uniform(-2, 2, (24, 2)), rng.uniform(0.1, 0.3, 24)
    world = World(arena, rng=1)
    team = world.add(Robot, 24, policy="stationary", position=place[order], radius=radius[order], awareness_range=2.4)
    team.sensors["teammates"] = BODIES
    at = dict(zip(team.identity.tolist(), map(tuple, team.position.tolist()), strict=True))
    rows = zip(at.values(), seen(world, "teammates"), strict=True)
    return {(mine, at[other]) for mine, row in rows for other in row}


@pytest.mark.parametrize("arena", [Box(5.0, 5.0), Torus(5.0, 5.0)], ids=str)
def test_the_order_of_agents_has_no_effect(arena: Any) -> None:
    wanted = seen_in_order(arena, list(range(24)))
    assert len(wanted) > 24
    for first in range(1, 24):
        assert seen_in_order(arena, np.roll(range(24), first).tolist()) == wanted


@pytest.mark.short
def test_what_it_refuses() -> None:
    with pytest.raises(ValueError, match=r"occluded='body'.*bodies"):
        Sensor(occluded="body")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="occluded=2"):
        Sensor(occluded=2)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"detect.*radius.*occluded=True"):
        BODIES.detect([[0.0, 0.0]], None, [[1.0, 0.0]], 1.0)
    check_sensor(BODIES)
    assert not BODIES.is_perfect
