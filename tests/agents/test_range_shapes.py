"""Square ranges: neighbours, counts, percepts, pictures and every way of running follow the Chebyshev distance."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Box, Disc, Robot, Sensor, Target, Torus, World, run_many
from teamsight.agents.awareness import NearestAwareness
from teamsight.agents.recording.explore import explore
from teamsight.policies import RandomWalk
from teamsight.policies.interface import Action, Policy
from teamsight.view.scene import Scene

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

ARENAS = {"disc": Disc(3.0), "torus": Torus(6.0, 5.0), "box": Box(5.0, 6.0)}


def herd(arena: Any, seed: int, shape: Any = "square", size: int = 8) -> World:
    world = World(arena, rng=seed)
    robots = world.add(
        Robot, size, policy="a-cmommt", awareness=NearestAwareness(2), sensing_range=0.9, awareness_range=1.3,
        range_shape=shape, speed=0.2,
    )  # fmt: skip
    targets = world.add(Target, 6, policy=RandomWalk(0.2), speed=0.15)
    world.senses(robots, targets, sensor=Sensor(field_of_view=4.0, range_noise=0.05, false_positives=0.1))
    world.recording.record_positions()
    return world


def chebyshev(world: World, one: Any, other: Any) -> float:
    return float(np.abs(world.arena.displacement(one.position, other.position)).max())


@pytest.mark.parametrize("arena", ARENAS)
def test_every_count_follows_the_square(arena: str) -> None:
    world = World(ARENAS[arena], rng=fresh_seed())
    robots = world.add(Robot, 8, policy="random-walk", awareness_range=1.3, sensing_range=0.7, range_shape="square")
    targets = world.add(Target, 5, policy="random-walk")
    world.senses(robots, targets)
    means, most, observed = [], 0, []
    for _ in range(40):
        world.step()
        near = [[o for o in robots if o is not r and chebyshev(world, r, o) <= 1.3] for r in robots]
        assert [robot.neighbours for robot in robots] == near
        means.append(sum(map(len, near)) / 8)
        most = max(most, *map(len, near))
        observed.append(np.mean([any(chebyshev(world, r, t) <= 0.7 for r in robots) for t in targets]))
    history = world.recording.history
    assert history["mean_neighbours"].tolist()[-40:] == pytest.approx(means)
    assert history["observed"].tolist()[-40:] == pytest.approx(observed)
    assert world.max_neighbours >= most


@pytest.mark.parametrize("arena", ARENAS)
def test_all_paths_and_restarts_give_the_same_bits(arena: str) -> None:
    seed = fresh_seed()
    run, stepped = herd(ARENAS[arena], seed), herd(ARENAS[arena], seed)
    run.run(30)
    state = run.state()
    run.run(30)
    for _ in range(60):
        stepped.step()
    ends = [group.position.tobytes() for group in run.groups]
    assert [group.position.tobytes() for group in stepped.groups] == ends
    assert run.recording.history.equals(stepped.recording.history)
    run.restore(state)
    run.run(30)
    assert [group.position.tobytes() for group in run.groups] == ends
    run.reset(seed)
    run.run(60)
    assert [group.position.tobytes() for group in run.groups] == ends
    disc = herd(ARENAS[arena], seed, "disc")
    disc.run(60)
    assert disc.groups[0].position.tobytes() != ends[0]


class AlongAnAxis(Policy):
    """Moves to one of the four next cells."""

    draws = 1

    def start(self, size: int) -> None:
        pass

    def decide(self, percept: Any, memory: None, noise: Any) -> Any:
        ways = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
        size = len(percept.heading)
        return Action(ways[(4 * noise[0][:size]).astype(int)], np.ones(size)), memory


def test_moves_on_a_lattice_stay_exact() -> None:
    world = World(Torus(20.0, 20.0), rng=3)
    cells = np.random.default_rng(1).integers(0, 20, (12, 2)) - 9.5
    robots = world.add(
        Robot, 12, policy=AlongAnAxis(), awareness="nearest", position=cells, heading=(1, 0), speed=1.0,
        sensing_range=3.0, awareness_range=3.0, range_shape="square",
    )  # fmt: skip
    for _ in range(50):
        world.step()
        assert np.array_equal(robots.position + 0.5, np.rint(robots.position + 0.5))
        seen = robots.percept.teammates
        assert np.array_equal(seen.offset, np.rint(seen.offset))
        for robot in robots:
            near = [o for o in robots if o is not robot and chebyshev(world, robot, o) <= 3.0]
            assert robot.neighbours == near


def test_those_who_come_later_have_the_shape_of_their_group() -> None:
    world = herd(Box(4.0, 4.0), 5)
    robots = world.groups[0]
    robots.add(2, position=[(0.0, 0.0), (1.2, 1.2)])
    world.run(0)
    first, second = robots[-2:]
    assert second in first.neighbours
    robots[0].remove()
    world.run(20)
    for robot in robots:
        assert robot.neighbours == [o for o in robots if o is not robot and chebyshev(world, robot, o) <= 1.3]


def test_runs_in_reused_worlds_are_those_of_new_ones() -> None:
    settings: dict[str, Any] = {"robots": 6, "radius": [1.5, 3.0], "range_shape": ["disc", "square"]}
    table = run_many(settings, steps=50, replicates=2, rng=1)
    for row in table.itertuples():
        model = CMOMMT(robots=6, radius=row.radius, range_shape=row.range_shape, rng=int(row.seed))
        model.run(50)
        assert model.observed_fraction == row.observed_fraction
    # A square contains its disc.
    means = table.groupby("range_shape")["observed_fraction"].mean()
    assert means["square"] > means["disc"]


def test_the_shape_is_that_of_the_group_and_stays() -> None:
    world = World(Disc(2.0), rng=1)
    with pytest.raises(ValueError, match="range_shape='sqare': unknown; did you mean 'square'"):
        world.add(Robot, 2, policy="random-walk", range_shape="sqare")  # type: ignore[arg-type]
    assert not world.groups
    robots = world.add(Robot, 2, policy="random-walk", range_shape="square")
    assert (robots.range_shape, world.add(Target, 1, policy="random-walk").range_shape) == ("square", "disc")
    with pytest.raises(AttributeError, match=r"range_shape='disc': cannot be set; give the shape when a group is added"):
        robots.range_shape = "disc"  # type: ignore[misc]
    with pytest.raises(AttributeError, match="range_shape='square': .*build another model"):
        CMOMMT(rng=1).range_shape = "square"
    with pytest.raises(ValueError, match="range=2.1: on a torus a range must be at most half"):
        World(Torus(4.0, 4.0), rng=1).add(Robot, 1, policy="random-walk", awareness_range=2.1, range_shape="square")


def test_recordings_know_the_shape_and_draw_it() -> None:
    from teamsight.view.drawing import Drawing

    world = World(Box(4.0, 4.0), rng=1)
    robots = world.add(
        Robot, 1, policy="stationary", sensing_range=1.0, range_shape="square", position=(0, 0), heading=(0, 1)
    )
    targets = world.add(Target, 1, policy="stationary", position=(1.9, -1.9))
    world.senses(robots, targets)
    replay = world.record(steps=0)
    assert [group.range_shape for group in replay.scene.groups] == ["square", "disc"]
    older = replay.scene.as_json()
    for group in older["groups"]:
        del group["range_shape"]
    assert [group.range_shape for group in Scene.from_json(older).groups] == ["disc", "disc"]
    drawing = Drawing(replay.tracks, 400)
    picture, axes = drawing.show(0), drawing.figure.axes[0]

    def is_tinted(x: float, y: float) -> bool:
        column, row = axes.transData.transform((x, y))
        return bool((picture[len(picture) - 1 - int(row), int(column)] != 255).any())

    assert all(is_tinted(x, y) for x in (-0.95, 0.95) for y in (-0.95, 0.95))
    assert not any(is_tinted(*place) for place in ((-1.06, 0.3), (1.06, 0.3), (0.3, -1.06), (1.06, 1.06)))


@pytest.mark.parametrize("angle", [0.3, 2.0, 4.0])
def test_the_part_of_a_square_in_view(angle: float) -> None:
    from matplotlib.path import Path

    from teamsight.view.drawing import square_outline

    rng = np.random.default_rng(3)
    for heading in rng.uniform(-7, 7, 20):
        outline = Path(square_outline(2.0, heading, angle))
        places = rng.uniform(-2.5, 2.5, (200, 2))
        turns = np.abs((np.arctan2(places[:, 1], places[:, 0]) - heading + np.pi) % (2 * np.pi) - np.pi)
        inside = (np.abs(places).max(axis=1) <= 2.0) & (turns <= angle / 2)
        assert np.array_equal(outline.contains_points(places), inside)


def test_explorations_say_that_ranges_are_squares() -> None:
    square, disc = (explore(CMOMMT(robots=4, radius=1.5, awareness="ring", range_shape=one, rng=1), 10) for one in ("square", "disc"))
    assert square.settings["range_shape"] == "square"
    assert "range_shape" not in disc.settings
