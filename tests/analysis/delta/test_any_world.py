"""Analyses on worlds that are not the paper's: several groups, several teams, groups that come and go, nobody."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, ClassVar

import numpy as np
import pytest
from chance import fresh_seed

from teamsight import CMOMMT, Box, Cycle, Disc, EventSource, Robot, Target, World
from teamsight.agents.components import Failures, SensorDropouts, UnreliableAwareness
from teamsight.agents.recording.explore import explore as explore_world
from teamsight.analysis import neighbour_graph
from teamsight.analysis.delta import choose
from teamsight.analysis.delta.degrees import SQUARE_RANGES, CountDegrees, conditions, predict
from teamsight.policies import RandomWalk


class Rival(Robot):
    team: ClassVar[str | None] = "rivals"


def two_groups(seed: int) -> World:
    """Seven robots in two groups, in an arena in which all of them are neighbours."""
    world = World(Disc(0.4), rng=seed)
    prey = world.add(Target, 2, policy=RandomWalk())
    for size in (3, 4):
        world.senses(world.add(Robot, size, policy=RandomWalk()), prey)
    return world


def two_teams(seed: int) -> World:
    world = World(Box(0.5, 0.5), rng=seed)
    for kind, size in ((Robot, 3), (Rival, 5), (Robot, 1)):
        world.add(kind, size, policy=RandomWalk())
    return world


def coming_and_going(seed: int) -> World:
    """Two robots; a group of four is there between ticks 25 and 27, which no look at every tenth of a run meets."""
    world = World(Disc(0.4), rng=seed)
    world.add(Robot, 2, policy=RandomWalk())

    def come() -> None:
        guests = world.add(Robot, 4, policy=RandomWalk(), name="guests")
        world.clock.at(27, lambda: [guest.remove() for guest in list(guests)])

    world.clock.at(25, come)
    return world


def late(seed: int) -> World:
    """Nobody is on a team until tick 5."""
    world = World(Disc(0.4), rng=seed)
    world.clock.at(5, lambda: world.add(Robot, 3, policy=RandomWalk()))
    return world


@pytest.mark.parametrize(
    ("make", "robots", "neighbours"), [(two_groups, 7, 6), (two_teams, 5, 4), (coming_and_going, 6, 5), (late, 3, 2)]
)
def test_delta_counts_all_that_are_on_a_team(make: Callable[[int], World], robots: int, neighbours: int) -> None:
    report = choose.choose_delta(make, runs=4, steps=40, risk=0.6, rng=1)
    assert report.maxima["max_neighbours"].tolist() == [neighbours] * 4
    assert (report.robots, report.delta, report.largest) == (robots, neighbours, neighbours)
    assert len(report.exceedance) == robots
    assert report.ring["samples"].sum() > 0
    assert report.to_markdown()
    assert report.to_png().startswith(b"\x89PNG")


def test_the_closed_form_is_for_one_team_that_stays_as_it_is() -> None:
    report = choose.choose_delta(two_groups, runs=2, steps=10, risk=0.6, rng=1)
    assert report.prediction is not None
    assert len(report.prediction.at_least) == 7
    assert report.notes == ()
    for make in (two_teams, coming_and_going):
        assert choose.choose_delta(make, runs=2, steps=40, risk=0.6, rng=1).prediction is None
    assert "several teams" in choose.choose_delta(two_teams, runs=2, steps=5, risk=0.6).to_markdown()
    assert (
        "N = 6 is the largest number" in choose.choose_delta(coming_and_going, runs=2, steps=40, risk=0.6).to_markdown()
    )


def test_two_groups_are_one_team_of_as_many() -> None:
    one = choose.choose_delta(
        {"robots": 12, "radius": 2.0, "policy": "random-walk"}, runs=60, steps=60, risk=0.2, rng=2
    )

    def split(seed: int) -> World:
        world = World(Disc(2.0), rng=seed)
        for size in (5, 7):
            world.add(Robot, size, policy=RandomWalk())
        return world

    two = choose.choose_delta(split, runs=60, steps=60, risk=0.2, rng=2)
    assert (two.robots, two.awareness_range, two.predicted_delta) == (12, 1.0, one.predicted_delta)
    assert abs(two.delta - one.delta) <= 1


@pytest.mark.parametrize("make", [two_groups, two_teams, coming_and_going])
def test_over_time_agrees_with_the_history(make: Callable[[int], World]) -> None:
    world = make(fresh_seed())
    table = neighbour_graph.over_time(world, 40)
    assert table["time"].tolist() == list(range(41))
    assert table["max_degree"].tolist()[1:] == world.recording.history["max_neighbours"].tolist(), world.seed_used
    assert table["mean_degree"].tolist()[1:] == pytest.approx(world.recording.history["mean_neighbours"]), (
        world.seed_used
    )
    networks = len(world.teammates.sizes)
    assert table["components"].iloc[-1] == networks
    assert table["largest_clique"].iloc[-1] == world.teammates.largest_team


def test_over_time_of_a_world_whose_robots_have_left() -> None:
    world = two_groups(1)
    for group in world.groups[1:]:
        for robot in list(group):
            robot.remove()
    table = neighbour_graph.over_time(world, 2)
    assert table["robots"].tolist() == [0, 0, 0]
    assert table["largest_component"].tolist() == [0, 0, 0]


def test_over_time_ends_when_the_model_stops() -> None:
    world = two_groups(1)
    world.clock.at(3, lambda: setattr(world, "running", False))
    table = neighbour_graph.over_time(world, 10)
    assert table["time"].is_unique
    assert table["time"].iloc[-1] == world.tick < 10


def nobody(seed: int) -> World:
    world = World(Disc(1.0), rng=seed)
    world.add(Target, 3, policy=RandomWalk())
    return world


def test_a_world_without_a_team_is_refused() -> None:
    world = nobody(1)
    with pytest.raises(ValueError, match=r"no group is on a team at tick 0.*add a group of Robot"):
        neighbour_graph.over_time(world, 5)
    assert world.tick == 0
    with pytest.raises(ValueError, match=r"the world of seed \d+: no group is on a team.*add a group of Robot"):
        choose.choose_delta(nobody, runs=3, steps=2)


def test_a_factory_of_something_else_is_refused() -> None:
    with pytest.raises(TypeError, match=r"model\(\d+\) is None: must be a World"):
        choose.choose_delta(lambda seed: None, runs=1)  # type: ignore[arg-type,return-value]


def test_steps_that_a_factory_has_made_do_not_count() -> None:
    def crowd_that_leaves(seed: int) -> World:
        world = two_groups(seed)
        world.run(5)
        for robot in list(world.groups[1]):
            robot.remove()
        return world

    report = choose.choose_delta(crowd_that_leaves, runs=3, steps=5, risk=0.9, rng=1)
    assert report.maxima["max_neighbours"].tolist() == [3, 3, 3]
    assert report.robots == 4


def test_ranges_that_differ() -> None:
    def make(seed: int) -> Any:
        world = World(Disc(1.0), rng=seed)
        world.add(Robot, 3, policy=RandomWalk(), awareness_range=3.0)
        world.add(Robot, 2, policy=RandomWalk(), awareness_range=[0.01, 3.0])
        return world

    report = choose.choose_delta(make, runs=2, steps=10, risk=0.6, rng=1)
    assert (report.awareness_range, report.prediction, report.largest) == (None, None, 4)
    world = make(1)
    table = neighbour_graph.over_time(world, 3)
    # Four robots see all others; the edges of the graph are mutual.
    assert (table["max_degree"] == 4).all()
    assert (table["edges"] <= 10).all()


@pytest.mark.filterwarnings("ignore:.*senses nothing in the channel")
@pytest.mark.parametrize("make", [two_groups, two_teams, coming_and_going])
def test_exploring_keeps_what_each_group_meets(make: Callable[[int], World]) -> None:
    memory = explore_world(make(1), 6)
    assert len(memory) == 6 * len(make(1).groups[-1 if make is coming_and_going else 0 if make is two_teams else 1])
    assert memory.settings["robots"] == make(1).teammates.sizes[0]


def test_cmommt_is_a_world_like_any_other() -> None:
    model = CMOMMT(robots=9, radius=2.0, rng=3)
    assert model.neighbours.identity.tolist() == model.robots.relations["teammates"].graph.identity.tolist()
    assert model.teammates.identity.tolist() == model.robots.identity.tolist()


def mixed_team(seed: int) -> World:
    """A scout that sees far, among robots that see less; and a pair of another team."""
    world = World(Disc(1.5), rng=seed)
    world.add(Robot, 1, policy=RandomWalk(), name="scout", awareness_range=2.5)
    world.add(Robot, 6, policy=RandomWalk(), name="workers", awareness_range=0.6)
    world.add(Rival, 2, policy=RandomWalk(), name="rivals")
    return world


def test_each_group_has_its_delta() -> None:
    report = choose.choose_delta(mixed_team, runs=40, steps=30, risk=0.2, rng=3)
    maxima, groups = report.group_maxima, report.groups
    assert maxima is not None
    assert groups is not None
    for row in maxima[maxima["run"] < 4].itertuples():
        world = mixed_team(row.seed)
        rows = {group.name: group for group in world.groups}
        largest = 0
        for _ in range(30):
            world.run(1)
            graph, before = world.neighbours, 0
            for group in world.groups:
                if group.name == row.group:
                    largest = max(largest, int(graph.degree[before : before + len(group)].max()))
                before += len(group)
        assert (row.max_neighbours, row.team) == (largest, rows[row.group].team)
    by_run = maxima.groupby("run")["max_neighbours"].max()
    assert by_run.tolist() == report.maxima["max_neighbours"].tolist()
    chosen = groups.set_index(["kind", "name"])
    assert chosen.loc[("group", "scout"), "delta"] == report.delta > chosen.loc[("group", "workers"), "delta"]
    assert chosen["robots"].tolist() == [7, 7, 2, 7, 2]
    for kind, name in chosen.index:
        largest = maxima[maxima[kind] == name].groupby("run")["max_neighbours"].max()
        row = chosen.loc[(kind, name)]
        assert (largest > row["delta"]).mean() == row["probability"] <= 0.2
        assert row["delta"] == 0 or (largest > row["delta"] - 1).mean() > 0.2
        assert row["low"] <= row["probability"] <= row["high"]
    assert "δ of each group" in report.to_markdown()
    assert "team rivals" in str(report)


def test_a_group_that_comes_and_goes_is_counted() -> None:
    report = choose.choose_delta(coming_and_going, runs=2, steps=40, risk=0.6, rng=1)
    assert report.groups is not None
    assert dict(zip(report.groups["name"], report.groups["largest"], strict=True)) == {"robots": 5, "guests": 5}
    unsampled = CountDegrees(samples=0)(coming_and_going(1), 40)
    assert {one.group: one.max_neighbours for one in unsampled.groups} == {"robots": 5, "guests": 5}


def test_a_single_group_has_no_table_of_groups() -> None:
    report = choose.choose_delta({"robots": 3, "radius": 1.0}, runs=3, steps=5, risk=0.6)
    assert report.groups is report.group_maxima is None


def test_failed_robots_are_nobodys_neighbours() -> None:
    world = World(Disc(0.4), rng=1)
    robots = world.add(Robot, 6, policy=RandomWalk())
    for robot in (robots[1], robots[4]):
        robot.active = False
    found = CountDegrees(samples=5)(world, 20)
    assert (found.max_neighbours, found.groups[0].max_neighbours, found.largest_team) == (3, 3, 6)
    assert found.bearings is not None
    assert found.bearings.degree.tolist() == [3] * 4 * 5
    for reliable in (CMOMMT(robots=4, radius=1.0, rng=1), world):
        met = conditions(reliable)
        assert (predict({met}, met.robots, 5) is None) == (reliable is world)


def test_the_report_on_robots_that_fail_says_so() -> None:
    report = choose.choose_delta(failing_team, runs=6, steps=20, risk=0.6, rng=1)
    assert report.prediction is None
    assert any("only active robots are neighbours" in note for note in report.notes)
    # In an arena in which all are neighbours, the mean is over those that work.
    assert report.ring["samples"].sum() < 6 * 10 * 8


def failing_team(seed: int) -> World:
    model = CMOMMT(robots=8, radius=0.5, policy="random-walk", rng=seed)
    model.attach(Failures(4.0, 8.0), model.robots)
    return model


def test_neighbours_can_count_at_decisions_only() -> None:
    """Robots that decide every 7 ticks, and fail now and then, counted by a second way: percepts."""
    world, twin = (rare_team(11) for _ in range(2))
    found = CountDegrees(samples=3, perceived=True)(world, 60)
    largest, seen = 0, 0
    for tick in range(60):
        twin.clock.at(tick, lambda: degrees.__setitem__(0, twin.neighbours.degree.tolist()))
        degrees = [[]]
        twin.step()
        for row, decided in enumerate(twin.robots.decided_at.tolist()):
            if decided == tick:
                largest, seen = max(largest, degrees[0][row]), seen + 1
    assert 0 < seen < 60 * 8 / 5
    assert found.max_neighbours == found.groups[0].max_neighbours == largest
    assert np.array_equal(world.robots.position, twin.robots.position)
    settings = {"robots": 8, "radius": 1.0, "policy": "random-walk", "cycle": Cycle(20, phase=5)}
    reports = [choose.choose_delta(settings, runs=20, steps=60, risk=0.2, rng=1, perceived=one) for one in (False, True)]
    more = reports[0].maxima["max_neighbours"] - reports[1].maxima["max_neighbours"]
    assert (more.min(), more.max() > 0) == (0, True)
    assert any("when a robot decides" in note for note in reports[1].notes)


@pytest.mark.parametrize("process", [True, False])
def test_robots_that_come_at_the_last_moment_count(process: bool) -> None:
    """Robots come in events that are planned at the moment of the step: at decisions of every step all count."""

    class Late(EventSource):
        def begin(self) -> None:
            self.plan(10.0, "first")

        def first(self) -> None:
            self.plan(self.now, "second")

        def second(self) -> None:
            self.plan(self.now, "third")

        def third(self) -> None:
            self.group.add(2)

    def arriving(model: CMOMMT) -> Iterator[Any]:
        yield model.clock.timeout(10)
        for _ in range(3):
            yield model.clock.timeout(0)
        model.robots.add(2)

    def late(seed: int) -> World:
        model = CMOMMT(robots=3, radius=0.4, policy="random-walk", cycle=Cycle(1, phase=10.0), rng=seed)
        if process:
            model.clock.process(arriving(model))
        else:
            model.attach(Late(), model.robots)
        return model

    world = late(1)
    found = CountDegrees(samples=2, perceived=True)(world, 11)
    # Robots decide at tick 10 first, when the two have come, and all are neighbours in so small an arena.
    assert (found.max_neighbours, found.largest_team) == (4, 5)
    assert world.recording.before_steps == []


@pytest.mark.filterwarnings("ignore:run.* makes its steps one by one")
@pytest.mark.parametrize("perceived", [False, True])
def test_neighbours_are_those_in_range_of_a_robot_that_can_sense(perceived: bool) -> None:
    """Robots fail, sensors drop out, and those in order miss half: counted by a second way, from positions."""

    def blinking(seed: int) -> CMOMMT:
        model = CMOMMT(robots=8, radius=1.2, policy="random-walk", awareness="pairwise", rng=seed)
        model.attach(Failures(30.0, 10.0), model.robots)
        model.attach(SensorDropouts(20.0, 10.0, "teammates"), model.robots)
        model.attach(UnreliableAwareness(missing=0.5), model.robots)
        return model

    world, twin = blinking(5), blinking(5)
    found = CountDegrees(perceived=perceived)(world, 40)
    seen: list[tuple[int, int]] = []

    def look(model: World) -> None:
        for one in model.groups[0]:
            if one.active and one.sensor_works("teammates"):
                far = [np.hypot(*(other.position - one.position)) for other in model.groups[0] if other.active]
                seen.append((int(np.count_nonzero(np.array(far) <= 1.0)) - 1, len(one.sensed("teammates"))))

    # Percepts are those before a step, and the history has the numbers after it.
    (twin.recording.before_steps if perceived else twin.recording.callbacks).append(look)
    for _ in range(40):
        twin.run(1)
    near, sensed = np.array(seen).T
    assert found.max_neighbours == near.max()
    assert (sensed <= near).all()
    assert (sensed < near).any()
    assert len(seen) < 40 * 8


def test_a_report_defines_neighbours_once() -> None:
    def notes(*components: Any) -> str:
        settings = {"robots": 6, "radius": 1.0, "policy": "random-walk", "awareness": "pairwise"}

        def model(seed: int) -> World:
            world = CMOMMT(**settings, rng=seed)
            for component in components:
                world.attach(component, world.robots)
            return world

        return " ".join(choose.choose_delta(model, runs=4, steps=20, risk=0.9, rng=1).notes)

    # A sensor out of order is not one that misses teammates.
    assert "misses" not in notes(SensorDropouts(5.0, 500.0, "teammates"))
    assert "its sensor for teammates is in order" in notes(SensorDropouts(5.0, 500.0, "teammates"))
    assert "also those that a sensor in order misses" in notes(UnreliableAwareness(missing=0.5))
    both = notes(SensorDropouts(5.0, 500.0, "teammates"), UnreliableAwareness(missing=0.5))
    assert "its sensor for teammates is in order" in both
    assert "also those that a sensor in order misses" in both


def rare_team(seed: int) -> CMOMMT:
    model = CMOMMT(robots=8, radius=1.5, policy="random-walk", cycle=Cycle(7, phase="random", jitter=3), rng=seed)
    model.attach(Failures(20.0, 8.0), model.robots)
    return model


def with_square_ranges(seed: int, shape: Any = "square") -> World:
    world = World(Disc(2.0), rng=seed)
    world.add(Robot, 8, policy=RandomWalk(), range_shape=shape)
    return world


def test_delta_of_square_ranges_is_larger_and_has_no_closed_form() -> None:
    found = {
        shape: choose.choose_delta(partial(with_square_ranges, shape=shape), runs=40, steps=60, risk=0.1, rng=1)
        for shape in ("disc", "square")
    }
    # The same seeds move the robots alike, and a square contains its disc.
    maxima = {shape: report.maxima["max_neighbours"].to_numpy() for shape, report in found.items()}
    assert (maxima["square"] >= maxima["disc"]).all()
    assert (maxima["square"] > maxima["disc"]).any()
    assert found["disc"].prediction is not None
    assert found["square"].prediction is None
    assert [SQUARE_RANGES in report.notes for report in found.values()] == [False, True]
    as_mapping = choose.choose_delta({"robots": 5, "radius": 2.0, "range_shape": "square"}, runs=2, steps=5, rng=1)
    assert SQUARE_RANGES in as_mapping.notes
