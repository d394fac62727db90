"""Bodies with a radius in worlds: on every path the same, placed apart, counted, and refused where they do not fit."""

from __future__ import annotations

import math
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from interactions import CaptureInTurn, hunt

from teamsight import (
    CMOMMT,
    Arrivals,
    Box,
    Bumps,
    Circle,
    Contact,
    Disc,
    Interaction,
    Robot,
    Target,
    Torus,
    World,
    check_contact,
    run_many,
)
from teamsight.core.kernel import kernel
from teamsight.policies import Action, Percept, Policy
from teamsight.view.scene import Scene
from teamsight.world.contact import Pass, Slide, Stop


def crowd(contact: Any = "slide", *, seed: int = 1, arena: Any = None, robots: int = 15, **options: Any) -> World:
    """Return a world of robots and of targets of two sizes."""
    world = World(arena or Box(6.0, 5.0), contact=contact, rng=seed)
    team = world.add(Robot, robots, policy="random-walk", radius=0.2, speed=0.15, **options)
    prey = world.add(Target, 10, policy="random-walk", radius=[0.1, 0.3] * 5, speed=0.1)
    world.senses(team, prey)
    return world


def gap(world: World) -> float:
    """Return the least distance between the surfaces of two active bodies that have a radius."""
    bodies = [group.bodies for group in world.groups]
    rows = np.concatenate([one.active & (one.radius > 0) for one in bodies])
    position, radius = (np.concatenate([one[name] for one in bodies])[rows] for name in ("position", "radius"))
    ways = world.arena.displacement(position[:, None], position)
    apart = np.hypot(ways[..., 0], ways[..., 1]) - radius[:, None] - radius
    np.fill_diagonal(apart, math.inf)
    return float(apart.min())


def seen(world: World) -> list[Any]:
    """Return all that contacts may change."""
    names = ("position", "heading", "moved", "blocked", "bumps")
    columns = [group.bodies[name].tolist() for group in world.groups for name in names]
    return [*columns, world.recording.history.to_numpy().tolist(), world.tick]


ARENAS = [Box(6.0, 5.0), Disc(3.0), Torus(6.0, 5.0), Box(6.0, 5.0).with_obstacles(Circle((0, 0), 0.8))]


@pytest.mark.short
@pytest.mark.parametrize("arena", ARENAS, ids=str)
@pytest.mark.parametrize("contact", ["stop", "slide"])
def test_all_paths_agree_and_nobody_overlaps(contact: str, arena: Any) -> None:
    world = crowd(contact, arena=arena)
    assert gap(world) >= 0
    world.run(60)
    assert gap(world) >= -1e-9
    assert world.groups[0].bumps.sum() > 0
    whole = seen(world)
    stepped = crowd(contact, arena=arena)
    for _ in range(20):
        stepped.step()
    state = pickle.loads(pickle.dumps(stepped.state()))
    stepped.run(40)
    assert seen(stepped) == whole
    other = crowd(contact, arena=arena, seed=9)
    other.run(3)
    other.restore(state)
    other.run(40)
    assert seen(other) == whole
    other.reset(1)
    other.run(60)
    assert seen(other) == whole


@pytest.mark.short
def test_without_contacts_a_radius_changes_nothing() -> None:
    plain, wide = CMOMMT(rng=1), CMOMMT(robot_radius=0.3, target_radius=0.2, rng=1)
    for model in (plain, wide):
        model.run(50)
    assert np.array_equal(plain.robots.position, wide.robots.position)
    assert "bumps" not in wide.recording.history


@pytest.mark.short
def test_points_move_as_before_among_bodies() -> None:
    # Targets are points: robots that slide around each other have no effect on them.
    free, solid = CMOMMT(target_policy="random-walk", rng=3), CMOMMT(robot_radius=0.2, contact="slide", rng=3)
    for model in (free, solid):
        model.run(80)
    assert np.array_equal(free.targets.position, solid.targets.position)
    assert not np.array_equal(free.robots.position, solid.robots.position)


@pytest.mark.short
def test_reused_worlds_and_batches_agree_with_new_ones() -> None:
    settings = {"robots": 8, "targets": 6, "robot_radius": 0.15, "target_radius": 0.1, "contact": "slide"}
    table = run_many([settings | {"radius": radius} for radius in (2.0, 3.0)], replicates=3, steps=40, rng=1)
    for row in table.itertuples():
        model = CMOMMT(**settings, radius=row.radius, rng=int(row.seed))
        model.run(40)
        assert model.observed_fraction == row.observed_fraction


@pytest.mark.short
def test_bumps_are_a_column_a_score_and_an_event() -> None:
    world = crowd("stop")
    world.attach(Bumps(), world.groups[0])
    world.run(100)
    robots, targets = world.groups
    log = world.events.query("what == 'bumped'")
    assert len(log) == robots.bumps.sum() > 0
    assert log.agent.value_counts().to_dict() == {one.unique_id: one.bumps for one in robots if one.bumps}
    assert world.recording.history.bumps.sum() == robots.bumps.sum() + targets.bumps.sum()
    # The log is part of a state, and goes on after it.
    state, before = world.state(), len(log)
    world.run(30)
    after = seen(world), len(world.events)
    world.restore(state)
    assert len(world.events) == before
    world.run(30)
    assert (seen(world), len(world.events)) == after
    world.reset()
    assert robots.bumps.sum() == 0
    with pytest.raises(AttributeError, match="counted"):
        robots.bumps = 3  # type: ignore[misc]


@pytest.mark.short
def test_groups_that_move_in_turn_meet_each_other() -> None:
    def made() -> World:
        return hunt(CaptureInTurn(), contact="slide", radius=0.2, prey_radius=0.3, hunters=8)

    world, stepped = made(), made()
    world.run(40)
    for _ in range(40):
        stepped.step()
    assert seen(world) == seen(stepped)
    assert {"captures", "bumps"} <= set(world.recording.history)


@pytest.mark.short
def test_one_that_fails_is_in_nobodys_way() -> None:
    world = World(Box(20.0, 20.0), contact="stop", rng=1)
    robots = world.add(
        Robot, 2, policy=lambda percept, rng: (0.0, 0.5), radius=0.5, speed=0.5, position=[(-5, 0), (0, 0)],
        heading=(1.0, 0.0),
    )  # fmt: skip
    robots[1].active = False
    world.run(20)
    assert robots[0].position[0] == pytest.approx(5.0)
    # It comes back where another may be by now; then both can leave.
    robots[0].position = (5.0, 3.0)
    robots[1].active = True
    world.run(3)
    assert gap(world) > 0


@pytest.mark.short
def test_agents_who_come_do_not_overlap_those_that_are_there() -> None:
    world = crowd()
    world.run(20)
    world.groups[0].add(5)
    world.groups[1].add(3, radius=0.05)
    assert gap(world) >= -1e-9
    world.run(20)
    assert gap(world) >= -1e-9
    world.groups[0][3].remove()
    world.run(20)
    assert len(world.groups[0]) == 19
    world.reset()
    assert gap(world) >= 0


@pytest.mark.short
def test_more_pairs_than_expected_get_room() -> None:
    # All can meet all within one step.
    world = World(Box(30.0, 30.0), contact="slide", rng=1)
    robots = world.add(Robot, 60, policy="random-walk", radius=0.3, speed=30.0)
    world.run(5)
    assert gap(world) >= -1e-9
    assert robots.bumps.sum() > 0


@pytest.mark.short
def test_starts_are_the_same_whether_added_or_reset() -> None:
    world = crowd()
    begun = [group.position.copy() for group in world.groups]
    world.run(5)
    world.reset()
    assert all(np.array_equal(group.position, one) for group, one in zip(world.groups, begun, strict=True))


@pytest.mark.short
@pytest.mark.parametrize("placement", ["uniform", "spread", "cells"])
def test_all_rules_of_placement_keep_bodies_apart(placement: Any) -> None:
    for seed in range(5):
        world = World(Box(8.0, 8.0), contact="slide", rng=seed)
        world.add(Robot, 30, policy="random-walk", radius=0.4, placement=placement)
        assert gap(world) >= 0
        assert np.abs(world.groups[0].position).max() <= 3.6 + 1e-9


def _positions(*places: tuple[float, float], radius: Any = 0.5) -> Callable[[], object]:
    return lambda: World(Box(10.0, 10.0), contact="slide", rng=1).add(
        Robot, len(places), policy="random-walk", radius=radius, position=list(places)
    )


def _bodies(count: int, radius: float, arena: Any = None, **options: Any) -> Callable[[], object]:
    return lambda: World(arena or Box(10.0, 10.0), contact="slide", rng=1).add(
        Robot, count, policy="random-walk", radius=radius, **options
    )


WRONG: dict[str, tuple[Callable[[], object], tuple[str, ...]]] = {
    "negative": (_bodies(2, -0.1), ("radius=-0.1", "at least 0")),
    "not a number": (_bodies(2, math.nan), ("radius=nan", "finite")),
    "beyond the arena": (_bodies(2, 7.0), ("radius=7", "at most 5")),
    "no place so far from walls": (_bodies(2, 3.6, Disc(3.5)), ("radius=3.6", "at most 3.5")),
    "more than the area": (_bodies(50, 0.9), ("50 bodies", "0.9", "at most 35 fit")),
    "more than fit at random": (_bodies(90, 0.5), ("90 bodies", "fit when they are placed at random")),
    "overlap": (_positions((0, 0), (0.9, 0)), ("agent 1", "0.9 from agent 0", "sum of their radii is 1")),
    "in a wall": (_positions((4.8, 0)), ("agent 0", "0.2 from a wall", "radius is 0.5")),
    "too fast for a torus": (_bodies(2, 0.2, Torus(10, 10), speed=3.0), ("3.2", "at most 2.5")),
    "unknown name": (lambda: World(Box(1, 1), contact="slid"), ("slid", "slide")),  # type: ignore[arg-type]
}


@pytest.mark.short
@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_is_refused_with_its_limit(name: str) -> None:
    make, parts = WRONG[name]
    with pytest.raises(ValueError, match=r"\d|slid") as error:
        make()
    for part in parts:
        assert part in str(error.value)


@pytest.mark.short
def test_what_would_overlap_later_is_refused_and_changes_nothing() -> None:
    world = crowd(arena=Torus(6.0, 5.0))
    robots, targets = world.groups
    before = robots.position.copy()
    for place in (robots[1].position + 0.1, targets[0].position):
        with pytest.raises(ValueError, match="sum of their radii"):
            robots[0].position = place
    with pytest.raises(ValueError, match="at most 1.25"):
        robots.speed = 2.0
    with pytest.raises(ValueError, match="at most 1.25"):
        robots[0].speed = 2.0
    with pytest.raises(AttributeError, match="when a group is added"):
        robots.radius = 0.1  # type: ignore[misc]
    with pytest.raises(ValueError, match="too many"):
        robots.add(200)
    assert np.array_equal(robots.position, before)
    robots[0].position = robots[0].position
    state = world.state()
    with pytest.raises(ValueError, match=r"contact=Stop\(\)"):
        crowd("stop", arena=Torus(6.0, 5.0)).restore(state)


@kernel
def _wild(
    way_x: float, way_y: float, heading_x: float, heading_y: float, normal_x: float, normal_y: float, parameters: Any
) -> tuple[float, float, float, float]:
    return parameters[0] * way_x, way_y, parameters[1] * heading_x, parameters[1] * heading_y


class Wild(Contact):
    """Changes ways and headings by two factors."""

    meet = _wild

    def __init__(self, way: float, heading: float) -> None:
        self.factors = way, heading

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.factors


@pytest.mark.short
def test_a_contact_of_ones_own_is_checked_and_cannot_make_bodies_overlap() -> None:
    for contact in (Pass(), Stop(), Slide(), Wild(-1.0, 1.0)):
        check_contact(contact)
    with pytest.raises(ValueError, match="longer way"):
        check_contact(Wild(50.0, 1.0))
    with pytest.raises(ValueError, match="no unit vector"):
        check_contact(Wild(1.0, 2.0))
    world = crowd(Wild(50.0, 1.0))
    world.run(30)
    assert gap(world) >= -1e-9
    world = crowd(Wild(math.nan, 1.0), robots=60)
    before = world.groups[0].position.copy()
    with pytest.raises(ValueError, match=r"Wild.*check_contact"):
        world.run(100)
    assert world.tick < 100
    if world.tick == 0:
        assert np.array_equal(world.groups[0].position, before)
    with pytest.raises(TypeError, match="is a class"):
        World(Box(1, 1), contact=Slide)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="has no 'meet'"):
        World(Box(1, 1), contact=Contact())


@pytest.mark.short
def test_recordings_hold_radii_and_pictures_show_them(tmp_path: Path) -> None:
    world, points = crowd(), CMOMMT(rng=1)
    scene = world.record(tmp_path / "bodies.png", steps=3).scene
    assert [slot.radius for slot in scene.slots] == [*world.groups[0].radius, *world.groups[1].radius]
    written = scene.as_json()
    assert Scene.from_json(written) == scene
    # A point has none, so recordings of points are as before.
    assert not any("radius" in slot for slot in points.record(steps=1).scene.as_json()["slots"])
    assert (tmp_path / "bodies.png").stat().st_size > 0
    picture = world._repr_html_()
    assert picture is not None
    assert "fill-opacity=\"0.35\"" in picture
    assert "fill-opacity=\"0.35\"" not in str(points._repr_html_())


@kernel
def _push(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots = bodies.robots
    for i in range(robots.position.shape[0]):
        robots.speed[i] = 4.0
        if robots.position[i, 0] < 4.0:
            robots.position[i, 0] = 4.95
            robots.position[i, 1] = 0.3 * i - 1.0


class Push(Interaction):
    """Puts bodies into the wall on the right, on top of each other, and makes them fast."""

    roles = ("robots",)
    kernel = _push


@pytest.mark.short
@pytest.mark.parametrize(
    "arena", [Box(10.0, 10.0), Disc(5.2), Torus(10.0, 10.0).with_obstacles(Circle((5.0, 0.0), 0.04))], ids=str
)
def test_what_an_interaction_puts_into_a_wall_stays_in_the_arena(arena: Any) -> None:
    world = World(arena, contact="slide", rng=1)
    robots = world.add(Robot, 6, policy="random-walk", radius=0.3, speed=0.2)
    world.interact(Push(), robots=robots)
    for _ in range(100):
        world.step()
        assert np.asarray(arena.contains(robots.position)).all()


@kernel
def _hurry(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    for i in range(bodies.robots.speed.shape[0]):
        bodies.robots.speed[i] = 30.0


class Hurry(Interaction):
    """Makes bodies faster than the torus allows."""

    roles = ("robots",)
    writes = ("speed",)
    kernel = _hurry


@pytest.mark.short
def test_on_a_torus_the_steps_of_bodies_are_cut() -> None:
    world = World(Torus(10.0, 10.0), contact="slide", rng=1)
    robots = world.add(Robot, 30, policy=lambda percept, rng: (1.0, 30.0), radius=0.5, speed=0.2)
    world.interact(Hurry(), robots=robots)
    for _ in range(30):
        world.step()
        assert gap(world) >= -1e-9
        assert np.hypot(*robots.bodies.moved.T).max() <= 2.0 + 1e-9


def begun(world: World) -> list[Any]:
    return [group.bodies[name].tolist() for group in world.groups for name in ("position", "heading")]


@pytest.mark.short
@pytest.mark.parametrize("seed", range(5))
def test_a_reset_begins_as_a_new_world_whoever_has_come_and_left(seed: int) -> None:
    def made() -> World:
        world = World(Box(4.0, 4.0), contact="slide", rng=seed)
        robots = world.add(Robot, 10, policy="random-walk", radius=0.25, speed=0.1)
        world.add(Target, 5, policy="random-walk", radius=[0.2, 0.0] * 2 + [0.2])
        robots.add(2)
        world.attach(Arrivals(3.0, stay=20.0), robots)
        return world

    world, new = made(), made()
    assert begun(world) == begun(new)
    world.run(200)
    assert world.groups[0].members_so_far > 40
    world.reset()
    assert begun(world) == begun(new)
    for one in (world, new):
        one.run(50)
    assert begun(world) == begun(new)


@pytest.mark.short
def test_those_who_have_left_are_in_nobodys_way_at_a_reset() -> None:
    world = World(Box(4.0, 4.0), contact="slide", rng=1)
    robots = world.add(Robot, 10, policy="random-walk", radius=0.3, speed=0.1)
    for _ in range(60):
        robots[0].remove()
        robots.add(1)
    world.reset()
    assert len(robots) == 10
    assert gap(world) >= 0


@pytest.mark.short
def test_arrivals_that_find_no_room_are_turned_away_and_others_come_later() -> None:
    world = World(Box(10.0, 10.0), contact="stop", rng=1)
    robots = world.add(Robot, 1, policy="random-walk", radius=0.5, speed=0.2, position=(0, 0))
    world.attach(Arrivals(2.0, position=(0, 0)), robots)
    world.run(300)
    assert len(world.events.query("what == 'turned away'")) > 5
    assert len(robots) > 5
    assert gap(world) >= -1e-9
    world.reset()
    assert len(robots) == 1


@pytest.mark.short
def test_points_are_in_nobodys_way_in_a_group_of_points_and_bodies() -> None:
    for seed in range(20):
        world = World(Box(4.0, 4.0), contact="slide", rng=seed)
        world.add(Robot, 20, policy="random-walk", radius=[0.0, 0.2] * 10)
        world.add(Target, 20, policy="random-walk", radius=0.2)
        before = begun(world)
        world.reset()
        assert begun(world) == before


@pytest.mark.short
def test_a_state_of_bodies_of_another_size_is_refused() -> None:
    state = crowd("slide").state()
    other = World(Box(6.0, 5.0), contact="slide", rng=1)
    robots = other.add(Robot, 15, policy="random-walk", speed=0.15)
    prey = other.add(Target, 10, policy="random-walk", speed=0.1)
    other.senses(robots, prey)
    with pytest.raises(ValueError, match=r"robots have another radius than here, 0\.2 and not 0"):
        other.restore(state)


@pytest.mark.short
def test_the_number_that_fits_does() -> None:
    for seed in range(5):
        world = World(Box(4.0, 4.0), contact="slide", rng=seed)
        with pytest.raises(ValueError, match=r"(\d+) fit when they are placed at random") as error:
            world.add(Robot, 100, policy="random-walk", radius=0.2)
        found = re.search(r"(\d+) fit", str(error.value))
        assert found is not None
        fit = int(found[1])
        assert 40 < fit < 100
        world.add(Robot, fit, policy="random-walk", radius=0.2)
    with pytest.raises(ValueError, match="at most 1 fit"):
        World(Disc(5.0), contact="slide", rng=1).add(Robot, 2, policy="random-walk", radius=4.9)


@pytest.mark.short
def test_bodies_that_touch_can_be_given() -> None:
    places = [(0.1 * column - 0.45, 0.1 * row - 0.45) for row in range(10) for column in range(10)]
    world = World(Box(2.0, 2.0), contact="slide", rng=1)
    world.add(Robot, 100, policy="random-walk", radius=0.05, speed=0.02, position=places)
    world.run(50)
    assert gap(world) >= -1e-9


class Early(Robot):
    """Says where it is before it is an agent."""

    def __init__(self, model: World, place: tuple[float, float]) -> None:
        self.position = place  # type: ignore[assignment]
        super().__init__(model)


@pytest.mark.short
def test_an_agent_may_place_itself_before_it_is_made() -> None:
    world = World(Box(6.0, 5.0), contact="slide", rng=1)
    robots = world.add(Early, 2, policy="random-walk", radius=0.2, place=[(-2.0, 0.0), (2.0, 0.0)])
    assert robots.position.tolist() == [[-2.0, 0.0], [2.0, 0.0]]


@kernel
def raises_at_once(
    way_x: float, way_y: float, heading_x: float, heading_y: float, normal_x: float, normal_y: float, parameters: Any
) -> Any:
    if way_x * way_x + way_y * way_y >= 0.0:
        raise ValueError
    return 0.0, 0.0, heading_x, heading_y


class Raises(Contact):
    meet = raises_at_once


@pytest.mark.short
def test_a_contact_that_raises_stops_the_run_before_the_step(capfd: pytest.CaptureFixture[str]) -> None:
    world = crowd(Raises())
    with pytest.raises(ValueError, match="Raises: a kernel raised an exception at tick"):
        world.run(60)
    before = seen(world)
    with pytest.raises(ValueError, match="Raises: a kernel raised an exception at tick"):
        world.run(60)
    assert seen(world) == before


@pytest.mark.short
def test_a_contact_without_fields_is_the_same_in_another_world() -> None:
    kind = type("Bounce", (Contact,), {"meet": Slide.meet})
    world, other = crowd(kind()), crowd(kind(), seed=2)
    world.run(10)
    other.restore(pickle.loads(pickle.dumps(world.state())))
    for one in (world, other):
        one.run(20)
    assert seen(world) == seen(other)


def test_bumps_are_a_column_that_policies_read() -> None:
    class Reads(Policy):
        columns = ("bumps", "blocked")

        def decide(self, percept: Percept, state: Any, noise: Any) -> tuple[Action, Any]:
            read.append((percept.columns.bumps[percept.identity].sum(), percept.columns.blocked[percept.identity].sum()))
            return Action(np.zeros((len(percept.heading), 2)), percept.speed), state

    read: list[Any] = []
    world = World(Box(4.0, 4.0), contact="stop", rng=1)
    robots = world.add(Robot, 20, policy=Reads(), radius=0.2, speed=0.1)
    world.run(30)
    assert read[-1][0] > 10
    world.step()
    assert read[-1] == (robots.bumps.sum() - world.recording.history.bumps.iloc[-1], read[-1][1])


@pytest.mark.short
def test_points_have_no_bumps_where_bodies_meet() -> None:
    bumps = []
    for radius in (0.0, 0.2):
        world = World(Box(4.0, 4.0), contact="stop", rng=1)
        world.add(Robot, 20, policy="random-walk", radius=radius, speed=0.1)
        for _ in range(2):
            world.run(10)
            world.step()
        bumps.append(world.recording.history["bumps"].sum())
        state = world.state()
        world.restore(state)
        world.run(5)
        assert len(world.recording.history["bumps"]) == 27
    assert bumps[0] == 0 < bumps[1]
    world = World(Box(4.0, 4.0), contact="stop", rng=1)
    world.add(Robot, 5, policy="random-walk", name="points")
    world.run(3)
    world.add(Robot, 5, policy="random-walk", name="bodies", radius=0.2)
    world.run(3)
    assert world.recording.history["bumps"][:3].tolist() == [0, 0, 0]
    assert "bumps" not in World(Box(4.0, 4.0), rng=1).recording.history
