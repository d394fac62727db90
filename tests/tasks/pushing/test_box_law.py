"""The law of the box: when it moves, and that nothing overlaps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Box, Robot, World, check_interaction
from teamsight.policies.handmade.random_walk import RandomWalk
from teamsight.tasks.pushing import Box as Load
from teamsight.tasks.pushing import BoxPushing, Pushing
from teamsight.world.check import call_of
from teamsight.world.interaction import Interacting, InteractionState, bodies_type, interacting_record
from tests.interactions import fingerprint
from tests.naive.pushing import pushed

KINDS = (("robots", ()), ("box", ()))


def called(law: Pushing, place: Any, before: Any, heading: Any, box: Any, active: Any = None) -> Interacting:
    """Return what the compiled kernel makes of robots that have moved, and a box."""

    def bodies(role: str, place: np.ndarray, before: np.ndarray, heading: np.ndarray, active: Any) -> Any:
        size = len(place)
        return bodies_type(role, ())(
            position=place.copy(), heading=heading, before=before, moved=place - before, speed=np.full(size, 0.5),
            active=np.ones(size, np.bool_) if active is None else active, reward=np.zeros(size),
            ended=np.zeros(size, np.bool_), identity=np.arange(size),
        )  # fmt: skip

    place, before, heading = (np.array(one, float).reshape(-1, 2) for one in (place, before, heading))
    load = np.array([box], float)
    given = {
        "robots": bodies("robots", place, before, heading, active),
        "box": bodies("box", load, load.copy(), np.array([[1.0, 0.0]]), None),
    }
    noise, state = {role: np.zeros((0, 8)) for role, _ in KINDS}, InteractionState(np.zeros((0, 0)), np.zeros((0, 0), np.int64))
    call = call_of(law, KINDS, given, state, noise, -1)
    law.entry(KINDS)(interacting_record(KINDS).pack(call))
    return call


def at_the_rim(law: Pushing, angles: Any, turns: Any) -> Interacting:
    """Return what happens when robots at these angles of the rim head into the box, turned by `turns` from it."""
    angles, headings = np.array(angles), np.array(angles) + np.pi + np.array(turns)
    rim = (law.box_radius + law.robot_radius) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    heading = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    return called(law, rim + 0.3 * heading, rim, heading, (0.0, 0.0))


@settings(max_examples=50, deadline=None)
@given(data=st.data(), count=st.integers(0, 5), threshold=st.floats(1.01, 1.99))
def test_the_box_moves_if_and_only_if_the_pushes_exceed_the_threshold(data: Any, count: int, threshold: float) -> None:
    law = Pushing(threshold=threshold)
    # Robots on one side, so far apart that a push to the side does not make them meet.
    slots = data.draw(st.permutations(range(10)))[:count]
    angles = np.array([0.62 * slot for slot in sorted(slots)])
    turns = np.array(data.draw(st.lists(st.floats(-0.1, 0.1), min_size=count, max_size=count)))
    found = at_the_rim(law, angles, turns)
    heading = np.stack([np.cos(angles + np.pi + turns), np.sin(angles + np.pi + turns)], axis=1)
    force = float(np.hypot(*heading.sum(axis=0)))
    if abs(force - threshold) < 1e-9:
        return
    expected = law.box_speed * max(force - threshold, 0.0)
    moved = found.bodies.box.position[0]
    assert np.hypot(*moved) == pytest.approx(expected, abs=1e-12)
    assert (expected > 0) == bool(moved.any())
    assert found.scores.tolist() == pytest.approx([expected, count, 0 if expected else count])
    assert found.bodies.robots.reward == pytest.approx(np.full(count, expected))
    if expected:
        assert moved / np.hypot(*moved) == pytest.approx(heading.sum(axis=0) / force)


@settings(max_examples=40, deadline=None)
@given(angle=st.floats(0, 6.28), turn=st.floats(-1.2, 1.2), threshold=st.floats(1.000001, 1.99))
def test_one_robot_never_moves_it(angle: float, turn: float, threshold: float) -> None:
    found = at_the_rim(Pushing(threshold=threshold), [angle], [turn])
    assert not found.bodies.box.position.any()
    assert found.scores.tolist() == [0.0, 1.0, 1.0]


def test_who_does_not_push() -> None:
    law = Pushing()
    rim = np.array([[2.5, 0.0], [2.5 * np.cos(0.5), 2.5 * np.sin(0.5)], [2.5 * np.cos(0.5), -2.5 * np.sin(0.5)]])
    inward = np.tile([-1.0, 0.0], (3, 1))
    wants = rim + 0.1 * inward
    assert called(law, wants, rim, inward, (0.0, 0.0)).scores.tolist() == pytest.approx([0.3, 3, 0])
    # One that stays where it is, one that heads away, one that is not in contact, one that is inactive.
    assert called(law, [rim[0], *wants[1:]], rim, inward, (0.0, 0.0)).scores.tolist() == pytest.approx([0.1, 2, 0])
    away = inward * [[-1.0], [1.0], [1.0]]
    assert called(law, [rim[0] * 1.01, *wants[1:]], rim, away, (0.0, 0.0)).scores[1] == 2
    far = np.array([[3.1, 0.0], *rim[1:]])
    assert called(law, far + 0.1 * inward, far, inward, (0.0, 0.0)).scores[1] == 2
    active = np.array([False, True, True])
    assert called(law, wants, rim, inward, (0.0, 0.0), active).scores[1] == 2


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 9), crowd=st.sampled_from([2.0, 4.0, 8.0]))
def test_it_does_what_the_slow_twin_does(seed: int, count: int, crowd: float) -> None:
    rng, law = np.random.default_rng(seed), Pushing(side=16.0)
    box = rng.uniform(-7, 7, 2)
    before = np.clip(rng.uniform(-crowd, crowd, (count, 2)) + box, -8, 8)
    for _ in range(4):
        towards = np.arctan2(*(box - before).T[::-1]) + rng.normal(0, 0.5, count)
        heading = np.stack([np.cos(towards), np.sin(towards)], axis=1)
        wanted = np.clip(before + rng.uniform(0, 0.8, (count, 1)) * heading, -8, 8)
        found, expected = called(law, wanted, before, heading, box), pushed(law, wanted, before, heading, box)
        assert found.bodies.robots.position == pytest.approx(expected.robots, abs=1e-7)
        assert found.bodies.box.position[0] == pytest.approx(expected.box, abs=1e-9)
        still = expected.pushes.sum() if expected.moved == 0 else 0
        assert found.scores.tolist() == pytest.approx([expected.moved, expected.pushes.sum(), still], abs=1e-9)
        assert found.bodies.robots.reward == pytest.approx(expected.moved * expected.pushes, abs=1e-9)
        before, box = found.bodies.robots.position.copy(), found.bodies.box.position[0].copy()


def closest(place: np.ndarray) -> float:
    gaps = np.hypot(*(place[:, None] - place[None, :]).T)
    return float(gaps[~np.eye(len(place), dtype=bool)].min(initial=np.inf))


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6), robots=st.integers(1, 25), policy=st.sampled_from(["fixed-priority", "random-walk"]),
    speed=st.sampled_from([0.1, 0.5, 3.0]),
)  # fmt: skip


def test_nothing_overlaps_and_all_stay_inside(seed: int, robots: int, policy: str, speed: float) -> None:
    side = 20.0
    world = BoxPushing(robots, side, policy=policy, speed=speed, rng=seed)
    for _ in range(60):
        world.step()
        place, box = world.robots.bodies.position, world.box.bodies.position[0]
        # Robots that were placed on each other, or on the box, are apart from the first step on.
        assert closest(place) >= 1.0 - 1e-8
        assert np.hypot(*(place - box).T).min() >= 2.5 - 1e-8
        assert np.abs(place).max() <= side / 2
        assert np.abs(box).max() + 2.5 <= side / 2


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_who_finds_no_place_is_nowhere_and_all_before_are_apart(seed: int) -> None:
    # More robots than the densest packing has: nobody can find a place for the last.
    law, count = Pushing(side=7.0), 80
    before = np.random.default_rng(seed).uniform(-3.5, 3.5, (count, 2))
    heading = np.tile([1.0, 0.0], (count, 1))
    place = called(law, before, before, heading, (0.0, 0.0)).bodies.robots.position
    expected = pushed(law, before, before, heading, np.zeros(2)).robots
    lost = int(np.argmax(np.isnan(place).any(axis=1)))
    assert np.isnan(place[lost]).all()
    assert lost == int(np.argmax(np.isnan(expected).any(axis=1)))
    assert place[:lost] == pytest.approx(expected[:lost], abs=1e-7)
    assert closest(place[:lost]) >= 1.0 - 1e-8


@pytest.mark.parametrize("steps", [1, 5])
def test_a_world_without_room_is_refused(steps: int) -> None:
    world: Any = World(Box(7, 7), rng=1)
    robots, box = world.add(Robot, 80, policy="random-walk"), world.add(Load, 1, policy="stationary", name="box")
    world.senses(robots, box)
    world.interact(Pushing(7.0), robots=robots, box=box)
    with pytest.raises(ValueError, match=r"Pushing: its kernel left <Robot .*\(nan, nan\)"):
        world.run(steps) if steps > 1 else world.step()


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 999), robots=st.integers(1, 12), parts=st.lists(st.integers(1, 60), min_size=1, max_size=4),
    policy=st.sampled_from(["fixed-priority", "random-walk"]),
)  # fmt: skip


def test_both_paths_give_one_result(seed: int, robots: int, parts: list[int], policy: str) -> None:
    worlds = [BoxPushing(robots, 20.0, policy=policy, rng=seed) for _ in range(2)]
    for number, steps in enumerate(parts):
        worlds[0].run(steps)
        if number % 2:
            worlds[1].run(steps)
        else:
            for _ in range(steps):
                worlds[1].step()
    assert fingerprint(worlds[0]) == fingerprint(worlds[1])


@pytest.mark.parametrize("rise", [0.0, 0.4])
def test_a_box_at_the_wall_stops_and_slides_along_it(rise: float) -> None:
    way = np.array([1.0, rise]) / np.hypot(1.0, rise)
    across = np.array([-way[1], way[0]])
    world: Any = World(Box(20, 20), rng=1)
    behind = np.array([-2.4 * way, -2.2 * way + 1.2 * across, -2.2 * way - 1.2 * across])
    robots = world.add(
        Robot, 3, policy=RandomWalk(turn_probability=0.0), speed=0.5, heading=way, position=behind + [4.0, 0.0]
    )
    box = world.add(Load, 1, policy="stationary", speed=0.0, position=(4.0, 0.0), name="box")
    world.senses(robots, box)
    world.interact(Pushing(20.0), robots=robots, box=box)
    places = []
    for _ in range(20):
        world.step()
        places.append(box.bodies.position[0].copy())
    place, history = np.array(places), world.recording.history
    # Straight on until the rim is at the wall, and then along it, if the push is not square to it.
    assert place[:, 0].max() == pytest.approx(7.5, abs=1e-6)
    is_free = place[:, 0] < 7.5 - 1e-6
    assert place[is_free] - [4.0, 0.0] == pytest.approx(np.outer(place[is_free, 0] - 4.0, way / way[0]), abs=1e-9)
    assert 5 < is_free.sum() < 18
    along = np.diff(place[:, 1])[is_free.sum()]
    assert (along > 1e-3) if rise else (abs(along) < 1e-9)
    if rise == 0:
        assert history["box_moved"].sum() == pytest.approx(3.5)
        assert history["stagnating"].iloc[is_free.sum() + 1] == 3


def test_it_keeps_its_contract() -> None:
    check_interaction(Pushing(side=40.0), Box(40, 40))
    check_interaction(Pushing(side=9.0, contact=0.5), Box(9, 9))


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"threshold": 2.0}, ValueError, r"threshold=2: must be below 2.*two robots"),
        ({"side": 6.0}, ValueError, r"side=6: must be above 6.*larger side or a smaller box_radius"),
    ],
)


def test_bad_constants_are_named(options: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        Pushing(**options)
