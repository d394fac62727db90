"""Reused worlds: a run in a built world gives the same bits as one in a new world."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mesa
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Box, Robot, Sensor, World
from teamsight.agents.awareness import RingAwareness
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.policies import ACmommt, Evolved, RandomWalk, SheppardLazyQ
from teamsight.world import placement as starts
from teamsight.world.noise import Stream, key_of, stream_number, uniforms

KINDS: list[dict[str, Any]] = [
    {"policy": "a-cmommt", "awareness": "pairwise"},
    {"policy": "a-cmommt", "awareness": "shared", "target_policy": "evasive", "policy_options": {"idle": "wander"}},
    {"policy": "a-cmommt", "awareness": "ring", "delta": 8, "uniform_target_speed": True},
    {"policy": "a-cmommt", "awareness": "none", "preset": "touzet2000"},
    {"policy": "centroid", "awareness": "none", "target_policy": "stationary"},
    {"policy": "random-walk", "awareness": "ring"},
    {"policy": "random-walk", "robots": 100, "targets": 70},
    {"policy": "stationary", "robots": 3, "awareness": "none"},
    {"policy": "evolved", "awareness": "ring"},
    {"policy": "lazy-collective", "awareness": "none"},
    {"policy": "lazy-cooperative", "awareness": "ring"},
    {"policy": Evolved(), "awareness": "pairwise"},
    {"policy": "a-cmommt", "awareness": "pairwise", "sensor": None},
    {"policy": "a-cmommt", "awareness": "pairwise", "sensor": Sensor(field_of_view=2.0, range_noise=0.1, delay=2)},
    {"policy": "centroid", "awareness": "none", "sensor": Sensor(missed=0.2, false_positives=0.1)},
    {"policy": SheppardLazyQ(inputs=32, capacity=30), "awareness": RingAwareness(16)},
    {"policy": "a-cmommt", "awareness": "pairwise", "arena_shape": "square"},
    {"policy": "a-cmommt", "awareness": "ring", "arena_shape": "torus", "radius": 3.0},
]  # fmt: skip

NUMBERS = st.fixed_dictionaries(
    {},
    optional={
        "radius": st.floats(0.8, 6.0),
        "sensing_range": st.floats(0.1, 2.0),
        "awareness_range": st.floats(0.1, 2.0),
        "robot_speed": st.sampled_from([0, 0.05, 0.3]),
        "target_speed": st.sampled_from([0.0, 0.1]),
    },
)


def left_behind(world: CMOMMT) -> tuple[Any, ...]:
    groups = [
        (group.position.tobytes(), group.heading.tobytes(), group.identity.tobytes(), group.speed.tobytes())
        for group in world.groups
    ]
    collected = {name: np.array(values).tobytes() for name, values in world.datacollector.model_vars.items()}
    return (
        groups, world.observed_fraction, world.max_neighbours, world.mean_degree, world.tick, world.steps,
        world.clock.now, world.seed_used, world.settings, world.radius, str(world.arena), world.random.random(),
        world.rng.random(), world.recording.history.to_csv(), collected, len(world.agents),
    )  # fmt: skip


def same(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    return repr(one) == repr(other)


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_a_reused_world_gives_the_bits_of_a_new_one(data: st.DataObject) -> None:
    kind = data.draw(st.sampled_from(KINDS))
    worlds = ReusedWorlds()
    seen = set()
    seeds = data.draw(st.lists(st.integers(0, 2**53), min_size=2, max_size=4))
    numbers: list[dict[str, Any]] = [{}]
    for _ in seeds:
        numbers.append(numbers[-1] if data.draw(st.booleans()) else data.draw(NUMBERS))
        if kind.get("arena_shape") == "torus":
            # A range is at most half of the side, which is 1.77 radii long.
            numbers[-1] = {**numbers[-1], "radius": max(numbers[-1].get("radius", 3.0), 2.5)}
    runs = [(kind | some, seed) for some, seed in zip(numbers[1:], seeds, strict=True)]
    worlds.expect(runs[data.draw(st.integers(0, 1)) :])
    for parameters, seed in runs:
        world = worlds.begin(CMOMMT, parameters, seed)
        new = CMOMMT(**parameters, rng=seed)
        steps = data.draw(st.integers(0, 40))
        for each in (world, new):
            each.run(steps)
            each.step()
            each.run(3)
        assert isinstance(world, CMOMMT)
        assert same(left_behind(world), left_behind(new))
        seen.add(id(world))
        new.close()
    worlds.close()
    assert len(seen) == 1


CHANGES: dict[str, Any] = {
    "an agent is removed": lambda world: world.targets[0].remove(),
    "an agent arrives": lambda world: world.robots.add(),
    "an agent arrives and another leaves": lambda world: (world.targets.add(), world.targets[0].remove()),
    "a policy is set": lambda world: setattr(world, "policy", "centroid"),
    "a degree is set": lambda world: setattr(world, "awareness", "none"),
    "positions are recorded": lambda world: world.recording.record_positions(),
    "a column is added": lambda world: world.robots.add_column("battery"),
    "a recorder is added": lambda world: world.recording.callbacks.append(lambda model: None),
    "a group is added": lambda world: world.add(Robot, 2, policy="centroid"),
    "a group senses": lambda world: world.senses(world.targets, world.robots),
    "a group senses in a channel": lambda world: world.senses(world.targets, world.robots, as_="hunters"),
    "a sensor is set": lambda world: setattr(world, "sensor", Sensor(missed=0.5)),
    "a sensor of teammates is set": lambda world: world.robots.sensors.update(teammates=Sensor(field_of_view=1.0)),
    "an attribute is set": lambda world: setattr(world, "mark", 1),
    "an agent gets an attribute": lambda world: setattr(world.robots[0], "mark", 1),
    "an agent of mesa is made": lambda world: mesa.Agent(world),
    "the step is replaced": lambda world: setattr(world, "step", lambda: None),
    "a setting is written": lambda world: world.settings.update(target_speed=0.5),
}


@pytest.mark.filterwarnings("ignore:run")
@pytest.mark.parametrize("change", CHANGES)
def test_a_world_to_which_something_was_done_is_not_used_again(change: str) -> None:
    worlds = ReusedWorlds()
    world = worlds.begin(CMOMMT, {}, 1)
    CHANGES[change](world)
    world.run(2)
    again = worlds.begin(CMOMMT, {}, 2)
    assert again is not world
    again.run(10)
    new = CMOMMT(rng=2)
    new.run(10)
    assert isinstance(again, CMOMMT)
    assert same(left_behind(again), left_behind(new))


@pytest.mark.parametrize("change", [
    lambda world: setattr(world, "robot_speed", 0.7), lambda world: setattr(world.robots[0], "speed", 0.0),
    lambda world: setattr(world, "awareness_range", 2.0), lambda world: setattr(world.robots[1], "turn_limit", 0.1),
    lambda world: setattr(world.targets[1], "position", (0.0, 0.0)), lambda world: setattr(world, "running", False),
    lambda world: world.clock.at(3, lambda: pytest.fail("events do not outlive a run")), lambda world: world.step(),
    lambda world: (world.run(2), world.restore(world.state())), lambda world: (world.run(2), world.reset(9)),
])  # fmt: skip


def test_what_a_run_changes_is_undone(change: Any) -> None:
    worlds = ReusedWorlds()
    world = worlds.begin(CMOMMT, {}, 1)
    change(world)
    world.run(1)
    again = worlds.begin(CMOMMT, {}, 2)
    assert again is world
    again.run(10)
    new = CMOMMT(rng=2)
    new.run(10)
    assert isinstance(again, CMOMMT)
    assert same(left_behind(again), left_behind(new))


def walk(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
    return float(rng.random()), 0.1


class Own(CMOMMT):
    pass


@pytest.mark.filterwarnings("ignore:run")
@pytest.mark.parametrize(("model", "parameters"), [
    (CMOMMT, {"policy": walk}), (Own, {}), (lambda rng: CMOMMT(rng=rng), {}),
    (CMOMMT, {"policy_options": {"do1": np.float32(0.1)}}),
], ids=["Python policy", "subclass", "function", "option of another type"])  # fmt: skip


def test_what_is_not_known_to_be_safe_is_built(model: Any, parameters: dict[str, Any]) -> None:
    worlds = ReusedWorlds()
    first = worlds.begin(model, parameters, 1)
    second = worlds.begin(model, parameters, 2)
    assert first is not second
    second.run(3)
    new = model(**parameters, rng=2)
    new.run(3)
    assert second.observed_fraction == new.observed_fraction


@pytest.mark.parametrize("wrong", [
    {"radius": -1}, {"radius": True}, {"sensing_range": "1"}, {"robot_speed": 1e9}, {"awareness_range": 1e-12},
    {"target_speed": -0.1}, {"robots": 0}, {"policy_options": {"idle": "sleep"}}, {"colour": "red"},
])  # fmt: skip


def test_wrong_parameters_raise_what_the_model_raises(wrong: dict[str, Any]) -> None:
    worlds = ReusedWorlds()
    worlds.begin(CMOMMT, {}, 1)
    with pytest.raises((TypeError, ValueError)) as expected:
        CMOMMT(**wrong, rng=2)
    with pytest.raises(expected.type) as raised:
        worlds.begin(CMOMMT, wrong, 2)
    assert str(raised.value) == str(expected.value)
    again = worlds.begin(CMOMMT, {}, 2)
    again.run(5)
    new = CMOMMT(rng=2)
    new.run(5)
    assert again.observed_fraction == new.observed_fraction


def test_options_that_their_owner_changes_are_noticed() -> None:
    worlds, options = ReusedWorlds(), {"idle": "wander"}
    first = worlds.begin(CMOMMT, {"policy_options": options}, 1)
    options["idle"] = "stay"
    second = worlds.begin(CMOMMT, {"policy_options": options}, 1)
    assert first is not second
    assert isinstance(second, CMOMMT)
    assert second.policy == ACmommt(idle="stay")


def test_a_world_rests_unless_something_was_added_which_closing_it_completes(tmp_path: Path) -> None:
    worlds, parameters = ReusedWorlds(), {"robots": 3, "targets": 2}
    first = worlds.begin(CMOMMT, parameters, 0)
    first.run(2)
    worlds.rest()
    second = worlds.begin(CMOMMT, parameters, 1)
    assert second is first
    second.record(tmp_path / "page.html")
    second.run(2)
    worlds.rest()
    assert (tmp_path / "page.html").exists()
    assert worlds.begin(CMOMMT, parameters, 2) is not first


def test_starts_of_many_runs_are_those_of_each() -> None:
    groups = [starts.Founders(0, 13, "uniform", 1.0), starts.Founders(1, 4, "uniform", 1.0)]
    arena = Box(3.0, 2.0)
    keys = np.array([key_of(seed) for seed in range(40)])
    found = starts.starts(arena, groups, keys)
    for run, key in enumerate(keys):
        first = 0
        for group in groups:
            numbers = uniforms(key, stream_number(Stream.PLACEMENT, group.number), 0, np.arange(group.size), 3)
            rows = slice(first, first + group.size)
            first += group.size
            assert found.position[run, rows].tobytes() == arena.place(numbers[0], numbers[1]).tobytes()
            angle = 2 * np.pi * numbers[2]
            heading = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            assert found.heading[run, rows].tobytes() == heading.tobytes()


def test_a_world_of_a_users_own_policy_reads_its_constants_again() -> None:
    class Mine(RandomWalk):
        pass

    policy = Mine(0.0)
    world = World(Box(4, 4), rng=1)
    world.add(Robot, 3, policy=policy, awareness="none")
    world.run(3)
    object.__setattr__(policy, "turn_probability", 0.5)
    world.reset(2)
    world.run(20)
    new = World(Box(4, 4), rng=2)
    new.add(Robot, 3, policy=Mine(0.5), awareness="none")
    new.run(20)
    assert np.array_equal(world.groups[0].position, new.groups[0].position)


@pytest.mark.parametrize("shape", ["square", "torus"])
def test_a_reused_world_knows_the_size_of_its_square(shape: str) -> None:
    worlds = ReusedWorlds()
    for seed, radius in enumerate([3.0, 4.0, 2.5]):
        parameters = {"policy": "centroid", "awareness": "ring", "arena_shape": shape, "radius": radius}
        world, new = worlds.begin(CMOMMT, parameters, seed), CMOMMT(**parameters, rng=seed)
        for each in (world, new):
            each.run(40)
        assert isinstance(world, CMOMMT)
        assert same(left_behind(world), left_behind(new))
    worlds.close()
