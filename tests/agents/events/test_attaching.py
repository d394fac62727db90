"""Attaching and detaching sources: what is refused changes nothing."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Batteries, EventSource, Failures, SensorDropouts, Times
from teamsight.world.noise import Stream, key_of, key_within, uniforms


class Counting(EventSource):
    """Notes who comes and goes, and counts ticks."""

    def __init__(self, interval: float = 2.0) -> None:
        self.interval = interval

    def begin(self) -> None:
        self.notes: list[Any] = []
        self.plan(self.now + self.interval, "count")

    def count(self) -> None:
        self.notes.append(self.now)
        self.plan(self.now + self.interval, "count")

    def joined(self, agent: Any, member: int) -> None:
        self.notes.append(("joined", member))
        assert self.agent(member) is agent
        assert self.member(agent) == member

    def left(self, agent: Any, member: int) -> None:
        self.notes.append(("left", member))
        assert self.agent(member) is None


class Broken(EventSource):
    def begin(self) -> None:
        self.plan(1, "go")
        raise OSError("no such weather station")

    def go(self) -> None:
        pytest.fail("was not attached")


def test_a_source_learns_who_comes_and_goes_by_member() -> None:
    world = CMOMMT(robots=4, rng=1)
    source, other = world.attach(Counting(), world.robots), world.attach(Counting(), world.targets)
    world.run(3)
    first = world.robots[1]
    first.remove()
    world.robots.add(2)
    world.robots[1].remove()
    world.run(2)
    assert source.notes == [2.0, ("left", 1), ("joined", 4), ("joined", 5), ("left", 2), 4.0]
    assert other.notes == [2.0, 4.0]
    assert source.members == [0, 3, 4, 5]
    assert [source.row(member) for member in range(7)] == [0, -1, -1, 1, 2, 3, -1]


def test_a_source_that_cannot_begin_is_not_attached() -> None:
    world = CMOMMT(rng=1)
    with pytest.raises(OSError, match="no such weather station"):
        world.attach(Broken(), world.robots)
    assert world.sources == ()
    world.run(3)
    assert world.attach(Counting(), world.robots).number == 1


@pytest.mark.short
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda w, s: w.attach(s, w.robots), r"attach\(Counting\(interval=2.0\)\): is attached to a world already; attach the source"),
        (lambda w, s: CMOMMT(rng=2).attach(s, w.robots), r"is attached to a world already"),
        (lambda w, s: w.attach(Counting, w.robots), r"attach\(Counting\): is a class; attach an object of it, as in attach\(Counting\(…\), robots\)"),
        (lambda w, s: w.attach("failures", w.robots), r"attach\('failures'\): must be an event source"),
        (lambda w, s: w.attach(Counting()), r"attach\(Counting\(interval=2.0\)\): needs a group; give it, as in attach\(Counting\(…\), robots\)"),
        (lambda w, s: w.attach(Counting(), CMOMMT(rng=2).robots), r"must be a group that was added to this world"),
        (lambda w, s: w.attach(Counting(), w.robots[0]), r"give a group, not a list or an agent"),
        (lambda w, s: [w.detach(s), w.detach(s)], r"detach\(Counting\(interval=2.0\)\): is not attached to this world; detach what attach\(\) returned, once"),
        (lambda w, s: w.detach(Counting()), r"is not attached to this world"),
        (lambda w, s: CMOMMT(rng=2).detach(s), r"is not attached to this world"),
        (lambda w, s: s.plan(-1, "count"), r"time=-1: has passed; it must be at least the present time, 0"),
        (lambda w, s: s.plan(float("inf"), "count"), r"time=inf: must be a finite number"),
        (lambda w, s: s.plan("3", "count"), r"time='3': must be a number"),
        (lambda w, s: s.plan(5, lambda: 3), r"plan\(…, <function .*must be the name of a method of Counting.*clock.at"),
        (lambda w, s: s.plan(5, 7), r"plan\(…, 7\): must be the name of a method"),
        (lambda w, s: s.plan(3, "cuont"), r"plan\(…, 'cuont'\): Counting has no method of this name"),
        (lambda w, s: s.plan(3, "count", w.robots[0]), r"must be numbers, texts, None or tuples of these.*name an agent by its member"),
        (lambda w, s: Counting().plan(3, "count"), r"belongs to no world; world.attach returns a copy that does"),
        (lambda w, s: Counting().members, r"has no group; attach it to one"),
        (lambda w, s: pickle.dumps(s), r"belongs to a world and cannot be copied or pickled"),
        (lambda w, s: copy.deepcopy(s), r"belongs to a world and cannot be copied or pickled"),
    ],
)
def test_wrong_uses_are_refused(call: Any, message: str) -> None:
    world = CMOMMT(rng=1)
    source = world.attach(Counting(), world.robots)
    pending = len(world.clock.pending)
    with pytest.raises((TypeError, ValueError, RuntimeError), match=message):
        call(world, source)
    assert len(world.clock.pending) == pending or world.sources == ()


def test_numbers_depend_on_seed_source_member_and_index_alone() -> None:
    world = CMOMMT(robots=4, rng=1)
    one, two = (world.attach(Counting(), world.robots) for _ in range(2))
    places = [(member, index) for member in (0, 3, 63, 64, 1000) for index in (0, 1, 2, 3, 4, 17)]
    drawn = [one.random(*place) for place in places]
    expected = [
        uniforms(key_within(key_of(1), "Counting 0 0"), Stream.EVENTS, index, np.array([member]), 1)[0, 0]
        for member, index in places
    ]
    assert drawn == expected
    assert drawn == [one.random(*place) for place in places]
    assert len({*drawn, *(two.random(*place) for place in places)}) == 2 * len(places)
    world.reset(2)
    assert not set(drawn) & {one.random(*place) for place in places}
    world.reset(1)
    assert drawn == [one.random(*place) for place in places]


@pytest.mark.short
def test_what_else_is_attached_does_not_change_the_numbers_of_a_source() -> None:
    def drawn(world: CMOMMT, *before: EventSource) -> list[tuple[float, int]]:
        for one in before:
            world.attach(one, world.robots)
        world.attach(Failures(100, 30), world.robots)
        world.attach(Failures(80, 30), world.targets)
        world.run(200)
        # Mesa's schedules let the events of the last tick happen at its end.
        log = world.events[world.events["time"] < 199]
        return list(zip(*(log[log["source"] == "Failures"][name] for name in ("time", "agent")), strict=True))

    expected = drawn(CMOMMT(robots=5, rng=1))
    assert len(expected) > 5
    measured = CMOMMT(robots=5, rng=1)
    measured.log_contacts(measured.robots)
    measured.schedule_recurring(lambda: None, 50)
    assert drawn(measured) == expected
    assert drawn(CMOMMT(robots=5, rng=1), SensorDropouts(50, 5), Batteries(1e6), Counting()) == expected
    # A second source of the same kind has numbers of its own; one that could not begin takes none.
    world = CMOMMT(robots=5, rng=1)
    world.run(1)
    with pytest.raises(ValueError, match="has passed"):
        world.attach(Failures(Times([0.5]), 1), world.robots)
    one, two = (world.attach(Failures(100, 30), world.robots) for _ in range(2))
    assert (one.nth, two.nth) == (0, 1)
    world.detach(one)
    three = world.attach(Failures(100, 30), world.robots)
    assert len({source.random(0, 0) for source in (one, two, three)}) == 3


def test_a_detached_source_does_nothing_more() -> None:
    world = CMOMMT(rng=1)
    source = world.attach(Counting(), world.robots)
    world.run(5)
    world.detach(source)
    world.robots.add(1)
    world.run(10)
    world.reset()
    assert source.notes == [2.0, 4.0]


def test_cancelling_takes_one_call_back() -> None:
    world = CMOMMT(rng=1)
    source = world.attach(Counting(), world.robots)
    (planned,) = source.pending("count")
    assert source.pending("other") == []
    source.cancel(planned)
    source.cancel(planned)
    source.cancel(None)
    assert source.pending() == []
    world.run(5)
    assert source.notes == []
