"""How worlds, groups, agents, columns and results look in a notebook: complete, escaped, small, and without work."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Box, Circle, Disc, Robot, Sensor, Target, Torus, World
from teamsight.agents.awareness.registry import AWARENESS
from teamsight.agents.engine.engine import Engine
from teamsight.analysis.delta.choose import choose_delta
from teamsight.core.card import COLOURS, legible, luminance
from teamsight.core.kernel import Entry
from teamsight.policies import Action, LazyQ, Policy
from teamsight.policies.interface import turned
from teamsight.policies.memory import LazyMemory
from teamsight.policies.percept_of_one import NeighboursOfOne

NAME = "<script>&'\"</script>"


def parsed(html: str | None) -> ElementTree.Element:
    """Return a card as a tree: it must be well formed, and load nothing."""
    assert html is not None
    root = ElementTree.fromstring(html)
    for node in root.iter():
        assert not node.tag.endswith(("script", "style", "link", "img"))
        assert not any(value.startswith(("http", "url")) for value in node.attrib.values())
    return root


def text_of(html: str | None) -> str:
    return " ".join("".join(parsed(html).itertext()).split())


def paths(html: str | None) -> list[str]:
    """Return what the paths of a picture draw."""
    return [node.attrib["d"] for node in parsed(html).iter() if node.tag.endswith("path")]


@pytest.fixture
def model() -> CMOMMT:
    return CMOMMT(robots=10, targets=20, radius=4.0, rng=1)


def test_a_world_shows_its_groups_and_a_small_picture(model: CMOMMT) -> None:
    model.run(30)
    assert repr(model) == "<CMOMMT: tick 30, seed 1, Disc(radius=4.0), 10 robots, 20 targets>"
    html = model._repr_html_()
    text = text_of(html)
    assert len(html or "") < 20_000
    for part in ("CMOMMT", "Disc(radius=4.0)", "30", "robots", "targets", "ACmommt", f"{model.observed_fraction:.1%}"):
        assert part in text
    observed = sum(target.is_observed for target in model.targets)
    ranges, arrows, *targets, wall = paths(html)
    assert wall
    # Each circle is two arcs. Robots are arrows, as on the pages; then come observed targets and the others.
    assert [path.count("a") // 2 for path in (ranges, *targets)] == [10, observed, 20 - observed]
    assert [path.count(letter) for path in (arrows,) for letter in "MLa"] == [10, 40, 0]
    assert 0 < observed < 20


def test_a_display_neither_compiles_nor_runs(model: CMOMMT, monkeypatch: pytest.MonkeyPatch) -> None:
    before = model.robots.position.copy()
    model._engine.is_bound = False
    monkeypatch.setattr(Entry, "is_missing", lambda entry: True)

    def fail(*arguments: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(Engine, "prepare", fail)
    assert "known after the first step" in text_of(model._repr_html_())
    assert "20 targets" in repr(model)
    np.testing.assert_array_equal(model.robots.position, before)


def test_a_display_changes_no_result() -> None:
    shown, other = (CMOMMT(robots=3, targets=5, radius=2.0, rng=4) for _ in range(2))
    for _ in range(4):
        shown._repr_html_()
        shown.run(5)
        shown._repr_html_()
        shown.step()
    other.run(24)
    np.testing.assert_array_equal(shown.targets.position, other.targets.position)
    assert shown.observed_fraction == other.observed_fraction


def test_names_are_escaped() -> None:
    world = World(Disc(2.0), rng=1)
    robots = world.add(Robot, 2, policy="a-cmommt", name=NAME)
    world.senses(robots, world.add(Target, 2, policy="stationary", name="<b>x</b>"), sensor=Sensor(missed=0.1))
    robots.add_column("battery", np.array(["<i>full</i>", "low"]))
    for shown in (world, robots, robots[0], robots.columns["battery"]):
        html = shown._repr_html_()
        text_of(html)
        assert "<script" not in html
        assert "<i>" not in html
    assert NAME in text_of(world._repr_html_())
    assert "missed=0.1" in text_of(robots._repr_html_())
    assert "<i>full</i>" in text_of(robots[0]._repr_html_())


@pytest.mark.parametrize("arena", [Box(5, 3), Torus(5, 3), Disc(2.0).with_obstacles(Circle((0, 1), 0.5))], ids=str)
def test_all_arenas_have_a_picture(arena: Any) -> None:
    world = World(arena, rng=1)
    world.add(Robot, 3, policy="stationary")
    html = world._repr_html_()
    drawn = paths(html)
    assert len(drawn) == 3 + hasattr(arena, "obstacles")
    assert ("dasharray" in (html or "")) == isinstance(arena, Torus)


def test_many_agents_make_no_long_page() -> None:
    world = World(Box(80, 80), rng=1)
    world.add(Robot, 3000, policy="stationary")
    assert len(world._repr_html_() or "") < 30_000
    assert "3,000" in text_of(world._repr_html_())


def test_an_agent_shows_its_place_and_columns(model: CMOMMT) -> None:
    model.robots.add_column("battery", 0.75)
    text = text_of(model.robots[3]._repr_html_())
    assert "Robot" in text
    assert "0.75" in text
    assert f"{model.robots.position[3, 0]:.3f}" in text


def test_a_percept_is_drawn_with_straight_ahead_at_the_top() -> None:
    percept = CMOMMT(robots=1, targets=2, rng=1).robots[0].percept
    # One target to the left of a robot that goes north, at half of its range; a teammate behind, at the edge of it.
    percept = percept._replace(
        heading=np.array([0.0, 1.0]), sensing_range=1.0, awareness_range=1.0,
        targets=NeighboursOfOne(np.array([7]), np.array([[-0.5, 0.0]]), np.array([0.5])),
        teammates=NeighboursOfOne(np.array([-1]), np.array([[0.0, -1.0]]), np.array([1.0])),
    )  # fmt: skip
    html = percept._repr_html_()
    text = text_of(html)
    assert "heading90°" in text.replace(" ", "")
    assert "targets70.590° left" in text
    assert "teammates–1180°" in text
    circles = [node.attrib for node in parsed(html).iter() if node.tag.endswith("circle")]
    ranges, (target,) = circles[:2], [(float(one["cx"]), float(one["cy"])) for one in circles[2:]]
    middle, reach = float(ranges[0]["cx"]), float(ranges[0]["r"])
    assert target == pytest.approx((middle - reach / 2, middle), abs=0.1)
    # A triangle of equal sides, since nothing says where the teammate goes; and the robot itself.
    triangle, own = shapes(html)
    assert np.mean(triangle, axis=0) == pytest.approx((middle, middle + reach), abs=0.1)
    sides = [math.dist(triangle[k], triangle[k - 1]) for k in range(3)]
    assert sides == pytest.approx([sides[0]] * 3, abs=0.2)
    assert (own[0][0], own[0][1] < middle) == (middle, True)
    assert "▲ teammates, without their headings" in text


def shapes(html: str | None) -> list[list[tuple[float, float]]]:
    """Return the corners of the closed shapes of a picture."""
    closed = [path.strip("Mz").split("L") for path in paths(html) if path.endswith("z")]
    return [[(float(corner.split()[0]), float(corner.split()[1])) for corner in shape] for shape in closed]


@pytest.mark.parametrize(("way", "turn"), [((0.0, 1.0), 0), ((1.0, 0.0), -90), ((-1.0, 0.0), 90), ((0.0, -1.0), 180)])
def test_a_teammate_whose_heading_the_percept_has_points_there(way: tuple[float, float], turn: float) -> None:
    class Reader(Policy):
        columns = ("heading_x", "heading_y")

        def decide(self, percept: Any, state: Any, noise: Any) -> Any:
            return Action(percept.heading, 0 * percept.speed), state

    world = World(Box(3.0, 3.0), rng=1)
    # The robot goes to the left on the page of the arena, which is straight up on that of its percept.
    heading = np.array([(-1.0, 0.0), turned(np.array([-1.0, 0.0]), np.deg2rad(turn))])
    robots = world.add(Robot, 2, policy=Reader(), position=[(0.0, 0.0), (0.0, 0.5)], heading=heading, awareness="pairwise")
    html = robots[0].percept._repr_html_()
    mate, _ = shapes(html)
    point, notch = np.array(mate[0]), np.array(mate[2])
    assert (point - notch) / np.linalg.norm(point - notch) == pytest.approx((way[0], -way[1]), abs=0.05)
    assert "without" not in text_of(html)
    assert text_of(html) != text_of(robots.percept._repr_html_())


@pytest.mark.parametrize("colour", COLOURS)
@pytest.mark.parametrize("ground", [(255, 255, 255), (17, 17, 17), (30, 30, 30)])
def test_what_is_drawn_stands_out_from_light_and_dark_pages(colour: str, ground: tuple[int, int, int]) -> None:
    """Those of a notebook, of JupyterLab's dark theme and of VS Code's, whose colours a card cannot know."""
    drawn = [int(legible(colour)[place : place + 2], 16) for place in (1, 3, 5)]
    low, high = sorted([luminance(drawn), luminance(ground)])
    assert (high + 0.05) / (low + 0.05) >= 3.0


def test_no_card_has_black_or_white_of_its_own(model: CMOMMT) -> None:
    model.run(5)
    for shown in (model, model.robots, model.robots[0], model.robots.percept, model.robots[0].percept):
        html = shown._repr_html_() or ""
        colours = set(re.findall(r"(?<!&)#[0-9a-f]{3,8}\b", html))
        assert colours <= {legible(colour) for colour in COLOURS} | {"#8888", "#888888"}
        assert not re.search(r"\b(black|white)\b", html)


@pytest.mark.parametrize("awareness", AWARENESS)
def test_percepts_of_all_degrees_have_cards(awareness: str) -> None:
    model = CMOMMT(robots=9, targets=6, radius=2.0, awareness=awareness, rng=1)
    group = model.robots.percept
    assert "Percept of 9 robots" in text_of(group._repr_html_())
    one = max((robot.percept for robot in model.robots), key=lambda percept: len(percept.targets.distance))
    text = text_of(one._repr_html_())
    assert text.count("left") + text.count("right") <= sum(map(len, (one.targets[0], one.teammates[0], one.relayed[0])))
    for identity in one.targets.identity.tolist():
        assert f"targets{identity}" in text


def removed(model: CMOMMT) -> Any:
    robot = model.robots[0]
    robot.remove()
    return robot


def closed(model: CMOMMT) -> Any:
    model.close()
    return model


def empty(model: CMOMMT) -> Any:
    for target in list(model.targets):
        target.remove()
    return model.targets


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (removed, "removed"), (closed, "CMOMMT"), (empty, "targets"), (lambda model: World(Disc(1.0)), "Disc"),
        (lambda model: model.robots.add_column("load", np.zeros((10, 2))), "(10, 2)"),
        (lambda model: model.robots.add_column("object", None), "None"),
    ],
)  # fmt: skip
def test_displays_of_unusual_objects_do_not_fail(make: Callable[[CMOMMT], Any], says: str, model: CMOMMT) -> None:
    found = make(model)
    assert says in text_of(found._repr_html_())
    assert repr(found)


def test_a_display_that_fails_leaves_the_repr() -> None:
    class Odd(Disc):
        def contains(self, position: Any) -> Any:
            raise OSError

    assert World.__new__(World)._repr_html_() is None
    assert repr(World.__new__(World)) == "<World, not built>"
    world = World(Odd(1.0))
    assert world._repr_html_() is None
    assert "Odd" in repr(world)


def test_memories_and_learners_show_what_they_learned_from(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(1)
    situation, following = rng.random((2, 50, 4), np.float32)
    memory = LazyMemory.of(situation, rng.random((50, 2), np.float32), following, {"alone": np.zeros(50)}, own=4, settings={"degree": "<none>"})
    learner = LazyQ(memory, reward=lambda memory: np.zeros(len(memory)))

    def fail(self: Any) -> str:
        raise AssertionError

    # It would read the whole table.
    monkeypatch.setattr(LazyMemory, "digest", property(fail))
    assert "50" in text_of(memory._repr_html_())
    assert "<none>" in text_of(memory._repr_html_())
    text = text_of(learner._repr_html_())
    assert "LazyQ" in text
    assert "50 transitions" in text


def test_a_report_on_delta_shows_its_result() -> None:
    report = choose_delta({"robots": 4, "targets": 2, "radius": 2.0}, steps=20, runs=40, risk=0.1, rng=1)
    assert repr(report).startswith(f"<DeltaReport from simulation: δ = {report.delta} for the risk 0.1, 40 runs, 4")
    text = text_of(report._repr_html_())
    assert f"{report.delta} for 0.1" in text
    assert "largest number of neighbours" in text


def test_bodies_are_drawn_in_their_true_size() -> None:
    world = World(Box(13.0, 13.0), rng=1)
    world.add(Robot, 2, policy="stationary", radius=[0.02, 2.0])
    # A unit is 20 pixels; a dot is as small as its body, but can be seen.
    sizes = {float(path.split(" ")[0]) for path in str(world._repr_html_()).split("a") if path[:1].isdigit()}
    assert {0.4, 40.0} <= sizes
    # An arrow from its point, through the notch, to a corner behind: 2.6 times 1.4 of a dot long.
    (arrows,) = [path for path in paths(world._repr_html_()) if path.count("L") == 8]
    corners = [[tuple(map(float, point.split())) for point in arrow.split("L")] for arrow in arrows.split("M")[1:]]
    lengths = [math.dist(point, [(a + b) / 2 for a, b in zip(left, right, strict=True)]) for point, left, _, right, _ in corners]
    assert lengths == pytest.approx([1.0 * 1.4 * 2.6, 3.0 * 1.4 * 2.6], abs=0.2)


def test_an_arrow_points_where_its_robot_goes_and_an_inactive_one_is_a_crossed_circle() -> None:
    world = World(Box(13.0, 13.0), rng=1)
    robots = world.add(Robot, 2, policy="stationary", heading=[(0.0, 1.0), (1.0, 0.0)])
    robots[1].active = False
    *_, arrow, circle, cross, _ = paths(world._repr_html_())
    point, _, notch, _, _ = [tuple(map(float, corner.split())) for corner in arrow[1:].split("L")]
    # Up on the page.
    assert point[1] < notch[1]
    assert point[0] == notch[0]
    assert (arrow.count("M"), circle.count("M"), cross.count("M")) == (1, 1, 2)
