"""Pictures and films show what the page shows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teamsight import CMOMMT, Body, Box, Robot, Sensor, Target, Torus, World
from teamsight.view.drawing import Drawing, _lines_of_links, shapes_of
from teamsight.view.scene import BLOCKED


@pytest.mark.parametrize("angle", [math.radians(90), math.radians(300), 2 * math.pi])
def test_sensing_ranges_are_as_wide_as_the_field_of_view(angle: float) -> None:
    world = World(Box(4.0, 4.0), rng=1)
    robots = world.add(Robot, 1, policy="stationary", sensing_range=1.5)
    targets = world.add(Target, 1, policy="stationary")
    robots[0].position, robots[0].heading, targets[0].position = (0.0, 0.0), (0.0, 1.0), (1.9, -1.9)
    world.senses(robots, targets, sensor=Sensor(field_of_view=angle))
    drawing = Drawing(world.record(steps=0).tracks, 400)
    picture = drawing.show(0)
    axes = drawing.figure.axes[0]
    for bearing in np.arange(0.0, 360.0, 10.0) + 3.0:
        way = math.radians(90.0 + bearing)
        column, row = axes.transData.transform((math.cos(way), math.sin(way)))
        is_tinted = bool((picture[len(picture) - 1 - int(row), int(column)] != 255).any())
        assert is_tinted == (abs((bearing + 180.0) % 360.0 - 180.0) < math.degrees(angle) / 2), bearing


def test_two_runs_show_the_same_tick() -> None:
    often, seldom = (CMOMMT(robots=2, targets=2, radius=2.0, rng=1).record(steps=12, every=every) for every in (1, 4))
    drawing = Drawing([*often.tracks, *seldom.tracks], 400)
    for number, ticks in ((0, (0, 0)), (3, (3, 0)), (4, (4, 4)), (12, (12, 12))):
        drawing.show(number)
        found = [axes.get_title().splitlines()[1].split(" · ")[0] for axes in drawing.figure.axes[:2]]
        assert found == [f"tick {tick}" for tick in ticks]


def test_a_finer_picture_is_the_same_picture() -> None:
    tracks = CMOMMT(robots=3, targets=3, radius=2.0, rng=1).record(steps=2).tracks
    one, two = (Drawing(tracks, 300, scale).show(2).astype(float) for scale in (1, 2))
    assert two.shape == (2 * one.shape[0], 2 * one.shape[1], 3)
    averaged = two.reshape(one.shape[0], 2, one.shape[1], 2, 3).mean(axis=(1, 3))
    # Letters and edges fall on other parts of pixels.
    assert np.abs(averaged - one).mean() < 3.0
    assert np.abs(averaged[:, ::-1] - one).mean() > 3.0


def test_a_link_across_the_seam_leaves_and_arrives() -> None:
    world = World(Torus(4.0, 4.0), rng=1)
    robots = world.add(Robot, 2, policy="stationary", awareness_range=[0.5, 1.5])
    robots[0].position, robots[1].position = (-1.5, 0.0), (1.5, 0.0)
    replay = world.record(steps=0)
    frame, scene = replay.frames[0], replay.scene
    found = np.array(_lines_of_links(scene, frame, frame.positions(scene.bounds)))
    np.testing.assert_allclose(found[:, :, 0], [[1.5, 2.5], [-2.5, -1.5]], atol=1e-3)


def test_bodies_have_their_true_size_also_across_the_seam() -> None:
    world = World(Torus(4.0, 4.0), rng=1)
    robots = world.add(Robot, 2, policy="stationary", sensing_range=0.01, awareness_range=0.01, radius=[0.5, 0.02])
    robots[0].position, robots[1].position, robots[1].heading = (1.8, 0.0), (0.0, 1.0), (1.0, 0.0)
    drawing = Drawing(world.record(steps=0).tracks, 400)
    picture, axes = drawing.show(0), drawing.figure.axes[0]

    def is_white(x: float, y: float) -> bool:
        column, row = axes.transData.transform((x, y))
        return bool((picture[len(picture) - 1 - int(row), int(column)] == 255).all())

    # 0.47 and 0.55 from its centre, on both sides of the seam.
    assert [is_white(x, 0.0) for x in (1.33, -1.73, 1.25, -1.65)] == [False, False, True, True]
    # A marker is about as small as the body.
    assert not is_white(0.0, 1.0)
    assert [is_white(x, y) for x, y in ((-0.038, 1.0), (0.0, 0.962), (0.0, 1.038))] == [True, True, True]
    # Nothing is drawn beyond the seam but the nose.
    assert is_white(2.06, 0.3)
    assert is_white(2.06, -0.3)


@pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")
def test_bodies_that_are_blocked_have_a_ring() -> None:
    world = World(Box(4.0, 4.0), contact="stop", rng=1)
    places, ways = [(-0.22, 0.0), (0.22, 0.0), (1.5, 1.5)], [(1.0, 0.0), (-1.0, 0.0), (1.0, 0.0)]
    look = {"policy": lambda percept, rng: (0.0, 0.1), "radius": 0.2, "sensing_range": 0.01, "awareness_range": 0.01}
    world.add(Robot, 3, position=places, heading=ways, speed=0.1, **look)
    replay = world.record(steps=1)
    assert [bool(one) for one in replay.frames[1].flags & BLOCKED] == [True, True, False]
    drawing = Drawing(replay.tracks, 400)
    before, after = ((drawing.show(number).astype(int) - [0xC2, 0x18, 0x5B]) for number in (0, 1))
    assert not (abs(before).max(axis=2) < 12).any()
    assert (abs(after).max(axis=2) < 12).sum() > 100


def test_groups_have_the_shapes_of_the_page() -> None:
    world = World(Box(6.0, 6.0), rng=1)
    robots = world.add(Robot, 1, policy="stationary")
    world.senses(robots, world.add(Target, 1, policy="stationary"))
    for name in ("walls", "beacons"):
        world.add(Body, 1, policy="stationary", name=name)
    for group, place in zip(world.groups, ((-2.0, -2.0), (-1.2, -2.0), (-2.0, 2.0), (2.0, 2.0)), strict=True):
        group[0].position = place
    replay = world.record(steps=0)
    assert shapes_of(replay.scene) == ["disc", "disc", "square", "diamond"]
    drawing = Drawing(replay.tracks, 600)
    picture, axes = drawing.show(0), drawing.figure.axes[0]
    shares = {}
    for group in world.groups[1:]:
        column, row = (round(value) for value in axes.transData.transform(group[0].position))
        ink = (picture[len(picture) - 1 - row - 9 : len(picture) - row + 8, column - 8 : column + 9] < 225).any(axis=2)
        high, wide = (np.flatnonzero(ink.any(axis=axis)) for axis in (1, 0))
        box = ink[high[0] : high[-1] + 1, wide[0] : wide[-1] + 1]
        shares[group.name] = box.mean()
    # Of the box around it, a square fills all, a circle π/4 and a diamond half, and their edges a little more.
    assert shares["walls"] > 0.94, shares
    assert 0.72 < shares["targets"] < 0.94, shares
    assert shares["beacons"] < 0.72, shares
