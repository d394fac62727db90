"""Recorded frames show what a loop in Python reads of the agents, whatever comes, goes and fails."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from arenas import Cylinder
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import (
    CMOMMT,
    Arrivals,
    Box,
    Circle,
    Departures,
    Disc,
    Failures,
    Polygon,
    Robot,
    Sensor,
    SensorDropouts,
    Target,
    Torus,
    UnreliableAwareness,
    World,
)
from teamsight.view.scene import ACTIVE, BLOCKED, MOST_OFFSET, MOST_PART, OBSERVED, PRESENT, TURN, Frame, Scene

ARENAS = {
    "disc": lambda: Disc(2.5),
    "box": lambda: Box(5.0, 3.0),
    "torus": lambda: Torus(5.0, 4.0),
    "obstacles": lambda: Box(5.0, 4.0).with_obstacles(Circle((0.5, 0.3), 0.6)),
    "of a user": lambda: Cylinder(5.0, 3.0),
    "polygon": lambda: Polygon([(-2, -2), (2, -2), (2, 0), (0, 0), (0, 2), (-2, 2)]),
}
SENSORS = {
    "perfect": None,
    "missed": Sensor(missed=0.3),
    "narrow": Sensor(field_of_view=2.0),
    "noisy": Sensor(range_noise=0.1, bearing_noise=0.2, false_positives=0.2),
    "late": Sensor(delay=2),
}
CHANGES = ("none", "remove", "add", "crowd", "off", "on", "move", "turn", "range", "sensor", "policy", "break", "senses")


def ahead(percept: Any, rng: Any) -> tuple[float, float]:
    return float(rng.uniform(-1, 1)), 0.2


class Twin:
    """Reads a world before each step, after the events of its tick, and once more at the end."""

    def __init__(self, world: World) -> None:
        self.world, self.read = world, dict[int, dict[str, Any]]()
        world.recording.before_steps.append(lambda _: self.look())
        self.look()

    def look(self) -> None:
        world = self.world
        bodies = {}
        links: dict[str, dict[tuple[int, int], Any]] = {}
        for group in world.groups:
            for agent in group:
                bodies[agent.unique_id] = (
                    group.number, agent.position.copy(), agent.heading.copy(), agent.active, agent.is_observed,
                    bool(group.bodies.blocked[agent.row]),
                )  # fmt: skip
            for name in group.channels:
                shown = group.neighbours(name)
                rows = np.repeat(np.arange(len(group)), np.diff(shown.start))
                found = links.setdefault(name, {})
                for row, identity, offset in zip(rows, shown.identity.tolist(), shown.offset.copy(), strict=True):
                    found[group[int(row)].unique_id, identity] = offset
        degrees = [len(agent.neighbours) for group in world.groups if group.team is not None for agent in group]
        series = (world.observed, world.mean_degree, max(degrees, default=0))
        self.read[world.tick] = {"bodies": bodies, "links": links, "series": series}


def assert_shows(frame: Frame, scene: Scene, read: dict[str, Any], low: Any, size: Any) -> None:
    identity = [slot.id for slot in scene.slots]
    present = {identity[slot] for slot in np.flatnonzero(frame.flags & PRESENT)}
    assert present == set(read["bodies"])
    for slot in np.flatnonzero(frame.flags & PRESENT):
        group, position, heading, active, observed, blocked = read["bodies"][identity[slot]]
        assert scene.slots[slot].group == group
        part = np.floor((position - low) * (MOST_PART / size) + 0.5)
        assert (frame.x[slot], frame.y[slot]) == tuple(part)
        turn = np.arctan2(heading[1], heading[0]) * TURN / (2 * np.pi)
        assert abs((turn - frame.heading[slot] + TURN / 2) % TURN - TURN / 2) <= 1.0
        assert bool(frame.flags[slot] & ACTIVE) == active
        assert bool(frame.flags[slot] & OBSERVED) == observed
        assert bool(frame.flags[slot] & BLOCKED) == blocked
    np.testing.assert_array_equal(frame.series, np.array(read["series"], np.float32))
    for about, links in zip(scene.links, frame.links, strict=True):
        assert (np.diff(links.source.astype(int)) >= 0).all()
        wanted = read["links"].get(about.channel, {})
        ends = [(identity[one], identity[other]) for one, other in zip(links.source, links.target, strict=True)]
        assert sorted(ends) == sorted(wanted), about.channel
        assert about.measured == (links.dx is not None)
        if about.measured:
            # Where a scale has changed, or positions had to do, offsets are rounded twice.
            unit = about.scale / MOST_OFFSET
            slack = 1.01 * unit + 1.5 * float(np.max(size)) / MOST_PART
            for end, dx, dy in zip(ends, links.dx, links.dy, strict=True):
                limit = np.clip(wanted[end], -about.scale, about.scale)
                assert np.abs(np.array([dx, dy]) * unit - limit).max() <= slack


def check(world: World, replay: Any, twin: Twin, every: int = 1) -> None:
    twin.look()
    low, high = world.arena.bounds
    frames, scene = replay.frames, replay.scene
    begun = min(twin.read)
    wanted = [tick for tick in sorted(twin.read) if tick == begun or tick % every == 0]
    assert [frame.time for frame in frames] == wanted
    assert len(replay) == len(frames)
    for frame in frames:
        assert_shows(frame, scene, twin.read[int(frame.time)], low, high - low)


@st.composite
def plans(draw: Any) -> dict[str, Any]:
    return {
        "arena": draw(st.sampled_from(sorted(ARENAS))),
        "robots": draw(st.integers(1, 12)),
        "targets": draw(st.integers(1, 9)),
        "second": draw(st.booleans()),
        "sensor": draw(st.sampled_from(sorted(SENSORS))),
        "teammates": draw(st.sampled_from(("perfect", "perfect", "noisy", "narrow"))),
        "python": draw(st.booleans()),
        "cycle": draw(st.sampled_from((1.0, 2.5))),
        "event": draw(st.sampled_from(("none", "failures", "arrivals", "dropouts"))),
        "every": draw(st.sampled_from((1, 1, 3))),
        "changes": draw(st.lists(st.tuples(st.integers(0, 4), st.sampled_from(CHANGES), st.integers(0, 99)), max_size=6)),
    }


def built(plan: dict[str, Any]) -> World:
    world = World(ARENAS[plan["arena"]](), rng=3)
    count = plan["robots"]
    robots = world.add(
        Robot, count, policy=ahead if plan["python"] else "random-walk", speed=0.3, cycle=plan["cycle"],
        sensing_range=np.linspace(0.5, 1.2, count), awareness_range=np.linspace(0.4, 1.5, count), awareness="pairwise",
    )  # fmt: skip
    targets = world.add(Target, plan["targets"], policy="random-walk", speed=0.2)
    world.senses(robots, targets, sensor=SENSORS[plan["sensor"]])
    if plan["second"]:
        others = world.add(Robot, 3, policy="stationary", name="others")
        world.senses(others, targets)
        world.senses(others, robots, as_="friends")
    if plan["teammates"] != "perfect":
        robots.sensors["teammates"] = SENSORS[plan["teammates"]]
    if plan["event"] == "failures":
        world.attach(Failures(4, 3), robots)
    elif plan["event"] == "dropouts":
        world.attach(SensorDropouts(4, 3), robots)
    elif plan["event"] == "arrivals":
        world.attach(Arrivals(3), targets)
        world.attach(Departures(5), targets)
    return world


def change(world: World, what: str, pick: int) -> None:
    robots, targets = world.groups[:2]
    group = (robots, targets)[pick % 2]
    if not len(group):
        return
    agent = group[pick % len(group)]
    if what == "remove" and len(group) > 1:
        agent.remove()
    elif what in ("add", "crowd"):
        more = {"sensing_range": 1.0, "awareness_range": 1.0} if group is robots else {}
        group.add(40 if what == "crowd" else 1, **more)
    elif what in ("off", "on"):
        agent.active = what == "on"
    elif what == "move":
        agent.position = (-1.0, -0.5 - pick / 200)
    elif what == "turn":
        agent.heading = (np.cos(pick), np.sin(pick))
    elif what == "range":
        world.adjust(robots, sensing_range=0.5 + pick / 100)
    elif what == "sensor":
        robots.sensors["targets"] = list(SENSORS.values())[1 + pick % 4]
    elif what == "policy":
        world.adjust(robots, policy="stationary")
    elif what == "break":
        robots[pick % len(robots)].break_sensor("targets")
    elif what == "senses":
        world.senses(targets, robots, as_="hunters")


@settings(max_examples=20, deadline=None)
@given(plan=plans())
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_frames_show_what_a_loop_reads(plan: dict[str, Any]) -> None:
    world = built(plan)
    replay, twin = world.record(every=plan["every"]), Twin(world)
    for steps, what, pick in [*plan["changes"], (4, "none", 0)]:
        for _ in range(steps):
            world.run(1)
        change(world, what, pick)
    check(world, replay, twin, plan["every"])
    world.close()


@pytest.mark.short
@pytest.mark.parametrize("arena", sorted(ARENAS))
def test_one_call_records_the_frames_of_single_steps(arena: str) -> None:
    replays = []
    for parts in ([40], [1] * 40, [13, 0, 27]):
        world = World(ARENAS[arena](), rng=5)
        robots = world.add(Robot, 9, policy="random-walk", speed=0.3)
        world.senses(robots, world.add(Target, 7, policy="random-walk"), sensor=Sensor(range_noise=0.1))
        world.attach(Failures(9, 4), robots)
        world.attach(UnreliableAwareness(delay=2), robots)
        replay = world.record()
        for steps in parts:
            world.run(steps)
        replays.append(replay.stop())
        world.close()
    first = replays[0]
    assert len(first) == 41
    for other in replays[1:]:
        assert other.scene == first.scene
        for one, two in zip(first.frames, other.frames, strict=True):
            for name in ("series", "x", "y", "heading", "flags"):
                np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
            for mine, theirs in zip(one.links, two.links, strict=True):
                np.testing.assert_array_equal(mine.source, theirs.source)
                np.testing.assert_array_equal(mine.target, theirs.target)


@pytest.mark.short
@pytest.mark.parametrize("fails", [False, True])
def test_frames_show_which_bodies_are_blocked(fails: bool) -> None:
    world = World(Box(4.0, 3.0), contact="stop", rng=2)
    robots = world.add(Robot, 10, policy="random-walk", speed=0.2, radius=0.2)
    world.senses(robots, world.add(Target, 3, policy="random-walk", speed=0.2, radius=[0.0, 0.1, 0.3]))
    if fails:
        world.attach(Failures(4, 3), robots)
    replay, twin = world.record(), Twin(world)
    for _ in range(30):
        world.run(1)
    check(world, replay, twin)
    blocked = [(frame.flags & BLOCKED).any() for frame in replay.frames]
    assert not blocked[0]
    assert any(blocked)
    assert not all((frame.flags & BLOCKED).all() for frame in replay.frames)


def test_many_bodies_have_indices_of_two_bytes() -> None:
    world = World(Box(12, 12), rng=1)
    robots = world.add(Robot, 300, policy="random-walk", awareness_range=12.0)
    world.senses(robots, world.add(Target, 290, policy="random-walk"), sensor=Sensor(missed=0.1, range_noise=0.2))
    replay, twin = world.record(), Twin(world)
    for _ in range(3):
        world.run(1)
    check(world, replay, twin)
    assert replay.frames[-1].series[2] > 255
    world.close()


def test_recording_changes_no_result_and_fills_several_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    from teamsight.agents.recording import frames

    monkeypatch.setattr(frames, "_FIRST", 4_000)
    plain, recorded = (CMOMMT(rng=4, robots=10, targets=8, radius=3.0) for _ in range(2))
    replay = recorded.record()
    twin = Twin(recorded)
    for model in (plain, recorded):
        model.run(300)
    np.testing.assert_array_equal(plain.robots.position, recorded.robots.position)
    assert plain.observed_fraction == recorded.observed_fraction
    history = recorded.recording.history
    series = np.array([frame.series for frame in replay.frames])[1:]
    np.testing.assert_array_equal(series, history[["observed", "mean_neighbours", "max_neighbours"]].to_numpy(np.float32))
    assert len(replay._recorder._chunks) > 3
    assert [frame.time for frame in replay.frames] == list(range(301))
    twin.look()
    low, high = recorded.arena.bounds
    assert_shows(replay.frames[-1], replay.scene, twin.read[300], low, high - low)


def test_all_agents_may_leave_and_others_come() -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 3, policy="random-walk")
    targets = world.add(Target, 2, policy="random-walk")
    world.senses(robots, targets)
    replay, twin = world.record(), Twin(world)
    for group in (targets, robots):
        world.step()
        for agent in list(group):
            agent.remove()
    world.step()
    targets.add(2)
    world.step()
    check(world, replay, twin)
    assert [int((frame.flags & PRESENT).sum()) for frame in replay.stop().frames] == [5, 3, 0, 2, 2]
    world.close()


def test_memory_that_is_used_again_holds_nothing_of_earlier_recordings() -> None:
    first = CMOMMT(rng=4, robots=10, targets=8, radius=3.0).record(steps=50)
    kept = [frame.x.copy() for frame in first.frames]
    CMOMMT(rng=5, robots=7, targets=9, radius=2.0).record(steps=80)
    for frame, x in zip(first.frames, kept, strict=True):
        np.testing.assert_array_equal(frame.x, x)
    again = CMOMMT(rng=4, robots=10, targets=8, radius=3.0).record(steps=50)
    for one, other in zip(first.frames, again.frames, strict=True):
        np.testing.assert_array_equal(one.links[1].target, other.links[1].target)
        np.testing.assert_array_equal(one.heading, other.heading)
