"""Drives in worlds: the same bits on every path, blocked by bodies, shown to policies, and refused where wrong."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from teamsight import (
    CMOMMT,
    Box,
    Car,
    Controller,
    DifferentialDrive,
    Disc,
    Drive,
    Robot,
    Torus,
    World,
    check_drive,
    run_many,
)
from teamsight.core.kernel import kernel
from teamsight.policies import Action, Percept, Policy

pytestmark = pytest.mark.short
DRIVES = [DifferentialDrive(0.2, 0.02), Car(0.1, 0.6, 0.1, 0.02)]


def name_of(one: Any) -> str:
    return one if isinstance(one, str) else type(one).__name__


def team(drive: Any, *, seed: int = 1, contact: Any = "pass", arena: Any = None, **options: Any) -> World:
    world = World(arena or Disc(3.0), contact=contact, rng=seed)
    world.add(Robot, 12, **{"policy": "random-walk", "drive": drive, "radius": 0.15, "speed": 0.1} | options)
    return world


def seen(world: World) -> list[Any]:
    """All that a drive may change."""
    bodies = world.groups[0].bodies
    return [bodies[name].tolist() for name in ("position", "heading", "moved", "drive", "bumps")]


@pytest.mark.parametrize("arena", [Disc(3.0), Torus(6.0, 5.0)], ids=str)
@pytest.mark.parametrize("contact", ["pass", "slide"])
@pytest.mark.parametrize("drive", DRIVES, ids=name_of)
def test_all_paths_agree(drive: Drive, contact: str, arena: Any) -> None:
    world = team(drive, contact=contact, arena=arena)
    world.run(60)
    whole = seen(world)
    stepped = team(drive, contact=contact, arena=arena)
    for _ in range(20):
        stepped.step()
    state = pickle.loads(pickle.dumps(stepped.state()))
    stepped.run(40)
    assert seen(stepped) == whole
    other = team(drive, contact=contact, arena=arena, seed=9)
    other.run(3)
    other.restore(state)
    other.run(40)
    assert seen(other) == whole
    other.reset(1)
    assert not any(any(values) for values in other.groups[0].drive_state.values())
    other.run(60)
    assert seen(other) == whole


def test_free_is_what_was_there_before() -> None:
    named, default = team("free"), team("free")
    for world in (named, default):
        world.run(30)
    assert np.array_equal(named.groups[0].position, default.groups[0].position)
    assert named.groups[0].drive_state == {}


def test_those_who_come_begin_at_rest_and_those_who_fail_stop() -> None:
    world = team(DRIVES[0])
    robots = world.groups[0]
    world.run(30)
    assert all(values.any() for values in robots.drive_state.values())
    new = robots.add(70)[0]
    assert new.drive_state == {"left": 0.0, "right": 0.0}
    robots[3].active = False
    world.run(1)
    assert 0 < max(map(abs, new.drive_state.values())) <= 0.02
    assert robots[3].drive_state == {"left": 0.0, "right": 0.0}
    robots[0].remove()
    robots[2].active = True
    world.run(1)
    assert 0 < max(map(abs, robots[2].drive_state.values())) <= 0.02


def test_a_robot_that_is_blocked_loses_its_speed() -> None:
    world = World(Box(20.0, 20.0), contact="stop", rng=1)
    robots = world.add(
        Robot, 2, policy=lambda percept, rng: (0.0, 0.5), radius=0.5, speed=0.5, position=[(-5, 0), (0, 0)],
        heading=(1.0, 0.0), drive=DifferentialDrive(0.2, 0.1),
    )  # fmt: skip
    robots[1].active = False
    world.run(4)
    assert robots[0].drive_state["left"] == pytest.approx(0.4)
    # The other comes back when this one has driven up to where it was.
    world.run(16)
    robots[1].position = robots[0].position + (1.2, 0.0)
    robots[1].active = True
    robots[1].policy = lambda percept, rng: (0.0, 0.0)
    world.run(1)
    assert robots[0].bumps == 1
    world.run(1)
    assert robots[0].drive_state["left"] == pytest.approx(0.1)


def test_reused_worlds_and_batches_agree_with_new_ones() -> None:
    settings = {"robots": 8, "targets": 6, "drive": DRIVES[0]}
    table = run_many([settings | {"radius": radius} for radius in (2.0, 3.0)], replicates=3, steps=40, rng=1)
    for row in table.itertuples():
        model = CMOMMT(**settings, radius=row.radius, rng=int(row.seed))
        model.run(40)
        assert model.observed_fraction == row.observed_fraction
    assert CMOMMT(drive="car").robots.drive == Car()


class Reads(Policy):
    """Follows the speed of its own left wheel."""

    columns = ("left",)

    def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
        n = len(percept.heading)
        return Action(np.zeros((n, 2)), percept.columns.left[percept.identity] + 0.01), state


def test_policies_read_the_numbers_of_a_drive_by_name() -> None:
    world = team(DifferentialDrive(0.1), policy=Reads())
    for step in range(1, 6):
        world.step()
        assert world.groups[0].drive_state["left"] == pytest.approx(0.01 * step)
    clash = team(DifferentialDrive(0.1), policy=Reads())
    clash.groups[0].add_column("left")
    with pytest.raises(ValueError, match="keeps 'left', a column of 'robots'.*rename one"):
        clash.run(1)
    with pytest.raises(ValueError, match="keeps 'speed'"):
        team(type("Own", (Drive,), {"carry": leaps, "state": ("speed",)})(), policy=Reads()).run(1)


@kernel
def leaps(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    state[0] += 1.0
    return (distance if state[0] < 5.0 else 2.0 * distance), 0.0, turn


@dataclass(frozen=True)
class Leaps(Drive):
    """A drive that goes wrong at the fifth step."""

    state = ("count",)
    carry = leaps


@pytest.mark.parametrize("contact", ["pass", "slide"])
def test_a_drive_that_goes_wrong_stops_the_run_before_the_step(contact: str) -> None:
    world = team(Leaps(), contact=contact)
    world.run(4)
    before = seen(world)
    for _ in range(2):
        with pytest.raises(ValueError, match=r"drive=Leaps: carry returned .* check it with check_drive\(\)"):
            world.run(3)
        assert (seen(world), world.tick) == (before, 4)
    world.reset(1)
    world.run(4)
    assert seen(world) == before


def test_mistakes_are_refused() -> None:
    world = team("differential")
    robots = world.groups[0]
    with pytest.raises(AttributeError, match="give the drive when a group is added"):
        robots.drive = Car()
    with pytest.raises(AttributeError, match="its drive writes it"):
        robots.drive_state = {}  # type: ignore[misc]
    with pytest.raises(TypeError, match="does not support item assignment"):
        robots.drive_state["left"] = 1.0  # type: ignore[index]
    with pytest.raises(ValueError, match="assignment destination is read-only"):
        robots.drive_state["left"][0] = 1.0
    with pytest.raises(ValueError, match="drive='bike': unknown"):
        world.add(Robot, 1, policy="random-walk", drive="bike")  # type: ignore[arg-type]
    state = world.state()
    with pytest.raises(ValueError, match="DifferentialDrive"):
        team("car").restore(state)
    with pytest.raises(ValueError, match="DifferentialDrive"):
        team("free").restore(state)


@kernel
def raises_once(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    state[0] += 1.0
    if state[0] > 4.0:
        raise ValueError
    return distance, 0.0, turn


class RaisesOnce(Drive):
    state = ("count",)
    carry = raises_once


@pytest.mark.parametrize("contact", ["pass", "slide"])
def test_a_drive_that_raises_stops_the_run_before_the_step(contact: str, capfd: pytest.CaptureFixture[str]) -> None:
    world = team(RaisesOnce(), contact=contact)
    world.run(4)
    before = seen(world)
    for _ in range(2):
        with pytest.raises(ValueError, match="RaisesOnce: a kernel raised an exception at tick 4"):
            world.run(3)
        assert (seen(world), world.tick) == (before, 4)


def test_a_state_of_a_drive_that_keeps_other_numbers_is_refused() -> None:
    def kind(*state: str) -> Drive:
        made: Drive = type("Own", (Drive,), {"carry": leaps, "state": state})()
        return made

    state = team(kind("one")).state()
    # The same one, made again, as in a notebook.
    same, wider = team(kind("one"), seed=2), team(kind("one", "two", "three"))
    same.restore(state)
    assert np.array_equal(same.groups[0].position, state.groups[0].bodies.position)
    with pytest.raises(ValueError, match="that keeps one and two and three"):
        wider.restore(state)


@kernel
def short(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    return distance, 0.0


@kernel
def written(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    return distance, 0.0, "left"


@kernel
def silent(turn: float, distance: float, speed: float, is_blocked: bool, state: Any, parameters: Any) -> Any:
    state[0] = turn


@pytest.mark.parametrize(
    ("carry", "message"),
    [(short, "2 values are given where 3 are expected"), (written, "str"), (silent, "the kernel returns nothing")],
    ids=["short", "written", "silent"],
)
def test_a_kernel_that_returns_what_no_drive_does_is_named(carry: Any, message: str) -> None:
    drive = type("Mine", (Drive,), {"carry": carry, "state": ("turn",)})()
    wrong = rf"test_drives\.py:\d+: .*{message}.*; carry={carry.__name__}\(turn, .*\) must return \(ahead, left, turn\)"
    for deed in (lambda: team(drive).run(1), lambda: check_drive(drive), lambda: Controller("random-walk", drive=drive)):
        with pytest.raises(TypeError, match=wrong):
            deed()
