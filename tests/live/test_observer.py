"""What the live page shows of a world is what a recording of it holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Box, Robot, Target, Torus, World
from teamsight.agents.components.failures import Failures
from teamsight.agents.recording.frames import FrameRecorder
from teamsight.agents.sensing.sensor import Sensor
from teamsight.live.worlds import Observer
from teamsight.view.packing import from_raw, raw
from teamsight.view.scene import OBSERVED, TURN, Frame


def failing() -> World:
    world = World(Torus(6, 5), seed=4)
    robots = world.add(Robot, 7, policy="a-cmommt", awareness="pairwise")
    targets = world.add(Target, 6, policy="random-walk")
    world.senses(robots, targets, sensor=Sensor(range_noise=0.1))
    world.attach(Failures(5, 3), robots)
    return world


def growing() -> World:
    world = World(Box(6, 5), seed=4)
    robots = world.add(Robot, 5, policy="random-walk", awareness_range=2.0)
    world.senses(robots, world.add(Target, 3, policy="random-walk"))
    world.clock.at(7, lambda: robots.add(4))
    world.clock.at(12, lambda: robots[0].remove())
    return world


WORLDS = {"cmommt": lambda: CMOMMT(6, 5, seed=3), "failing": failing, "growing": growing}


@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.parametrize("every", [1, 3])
def test_frames_are_those_of_a_recording(name: str, every: int) -> None:
    recorded, watched = WORLDS[name](), WORLDS[name]()
    replay, observer = recorded.record(), Observer(watched, every)
    for _ in range(18 // every + 1):
        assert_same(observer.frame(), replay.frames[-1])
        watched.run(every)
        recorded.run(every)
    replay.stop()
    assert observer.present.slots == replay.scene.slots
    assert observer.present.every == every


def assert_same(one: Frame, other: Frame) -> None:
    assert one.time == other.time
    for name in ("series", "x", "y", "heading", "flags"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=f"{name} at {one.time}")
    for mine, theirs in zip(one.links, other.links, strict=True):
        np.testing.assert_array_equal(mine.source, theirs.source)
        np.testing.assert_array_equal(mine.target, theirs.target)


@pytest.mark.parametrize("name", WORLDS)
def test_an_outline_shows_where_the_bodies_of_the_first_frame_are(name: str) -> None:
    world = WORLDS[name]()
    recorder = FrameRecorder(world._data, world._engine, "World")
    scene, outline = recorder.outline()
    assert not recorder.is_recording
    observer = Observer(WORLDS[name](), 1)
    first = observer.frame()
    for column in ("x", "y"):
        np.testing.assert_array_equal(getattr(outline, column), getattr(first, column))
    # Recorded headings are vectors of 16 bits, whose angles differ by rounding.
    turned = (outline.heading.astype(int) - first.heading + TURN // 2) % TURN - TURN // 2
    assert abs(turned).max() <= 1
    assert (outline.flags | OBSERVED).tolist() == (first.flags | OBSERVED).tolist()
    assert np.isnan(outline.series).all()
    assert (scene.slots, scene.links) == (observer.present.slots, ())
    assert [group.name for group in scene.groups] == [group.name for group in observer.present.groups]
    assert from_raw(raw(outline, scene), scene).x.tolist() == first.x.tolist()


class Bounded(Observer):
    """An observer whose frames hold few links."""

    most_links = 4


def noisy() -> World:
    world = World(Box(6, 5), seed=4)
    robots = world.add(Robot, 5, policy="random-walk", awareness_range=2.0, sensing_range=3.0)
    world.senses(robots, world.add(Target, 7, policy="random-walk"), sensor=Sensor(range_noise=0.1))
    return world


@pytest.mark.parametrize("make", [failing, growing, noisy])
def test_frames_hold_so_many_links_and_say_how_many_there_are(make: Any) -> None:
    world, twin = make(), make()
    observer, plain = Bounded(world, 1), Observer(twin, 1)
    omitted = 0
    for _ in range(30):
        one, other = observer.frame(), plain.frame()
        # Bodies and series are the same, those of lists without links too.
        for name in ("series", "x", "y", "heading", "flags"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        for found, links in zip(one.links, other.links, strict=True):
            is_too_many = len(links) > Bounded.most_links
            assert found.omitted == (len(links) if is_too_many else 0)
            for name in ("source", "target", "dx", "dy"):
                held = getattr(links, name)
                expected = held if held is None or not is_too_many else held[:0]
                np.testing.assert_array_equal(getattr(found, name), expected, err_msg=name)
            omitted += is_too_many
        world.run(1)
        twin.run(1)
    assert omitted > 0


def test_a_page_of_thousands_of_robots_holds_few_bytes() -> None:
    # Everybody senses everybody: 159,600 links of each list, of four bytes each.
    world = CMOMMT(400, 400, awareness_range=100.0, sensing_range=100.0, radius=5.0, policy="stationary", seed=1)
    observer = Observer(world, 1)
    frame = observer.frame()
    assert [one.omitted for one in frame.links] == [400 * 399, 400 * 400]
    assert len(raw(frame, observer.present)) < 10_000
    assert len(observer._chunks[-1].stream) < 2e6


def test_the_scene_is_the_same_object_until_it_changes() -> None:
    world = CMOMMT(6, 5, seed=3)
    observer = Observer(world, 1)
    observer.frame()
    before = observer.present
    for _ in range(5):
        world.run(3)
        observer.frame()
        assert observer.present is before
    changes: Any = {"awareness_range": 2.0, "awareness": "ring", "policy": "centroid"}
    for name, value in changes.items():
        setattr(world, name, value)
        observer.frame()
        assert observer.present is not before
        before = observer.present


def test_looking_changes_nothing() -> None:
    looked, plain = (CMOMMT(6, 5, seed=3) for _ in range(2))
    observer = Observer(looked, 1)
    for _ in range(10):
        observer.frame()
        looked.run(2)
    plain.run(20)
    np.testing.assert_array_equal(looked.robots.position, plain.robots.position)
    np.testing.assert_array_equal(looked.recording.history, plain.recording.history)
