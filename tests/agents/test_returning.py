"""A state is restored whoever has come and left since, in the same world and in new ones."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Arrivals, Constant, Disc, Robot, World

changes = st.lists(st.tuples(st.sampled_from(["add", "remove", "run", "save", "restore"]), st.integers(0, 5)), max_size=14)


def seen(world: CMOMMT) -> tuple[Any, ...]:
    """Return who is where, and what each row says of itself."""
    group = world.robots
    assert [agent.row for agent in group] == list(range(len(group)))
    assert group.bodies.identity.tolist() == [agent.unique_id for agent in group]
    assert {*world.agents} == {agent for each in world.groups for agent in each}
    assert len({agent.unique_id for agent in world.agents}) == len(world.agents)
    return (
        group.bodies.member.tolist(), group.bodies.identity.tolist(), group.position.tobytes(), world.tick,
        group.battery.tolist(), group.members_so_far,
    )  # fmt: skip


def made(seed: int) -> CMOMMT:
    world = CMOMMT(robots=3, targets=2, rng=seed)
    world.robots.add_column("battery", 1.0)
    return world


@pytest.mark.short
@settings(deadline=None, max_examples=25)
@given(changes)
def test_any_state_can_be_restored_in_any_order(plan: list[tuple[str, int]]) -> None:
    world = made(1)
    saved: list[tuple[bytes, Any, Any]] = []
    for number, (kind, value) in enumerate([*plan, ("save", 0), ("restore", 0)]):
        if kind == "add":
            world.robots.add(1 + value % 2, battery=float(number))
        elif kind == "remove" and len(world.robots) > 1:
            world.robots[value % len(world.robots)].remove()
        elif kind == "run":
            world.run(value)
        elif kind == "save":
            before = pickle.dumps(world.state())
            now = seen(world)
            world.run(3)
            world.robots.add(1)
            saved.append((before, now, seen(world)))
        elif kind == "restore" and saved:
            before, now, later = saved[value % len(saved)]
            for one in (world, made(2)):
                one.restore(pickle.loads(before))
                assert seen(one) == now
                one.run(3)
                one.robots.add(1)
                assert seen(one) == later


class Scout(Robot):
    def __init__(self, model: World) -> None:
        super().__init__(model)
        self.nickname = ""


def test_agents_with_an_init_come_back_only_if_somebody_keeps_them() -> None:
    world = World(Disc(3.0), rng=1)
    scouts = world.add(Scout, 3, policy="random-walk")
    scouts[1].nickname = "kept"
    saved = world.state()
    kept = scouts[1]
    kept.remove()
    world.restore(saved)
    assert scouts[1] is kept
    assert (kept.row, kept.nickname) == (1, "kept")
    scouts[2].remove()
    with pytest.raises(ValueError, match=r"of which 1 are not here; agents whose class has an __init__ cannot be made again: keep"):
        world.restore(saved)
    assert len(scouts) == 2


def test_columns_that_are_younger_than_a_state_have_values_for_those_that_come_back() -> None:
    world = CMOMMT(robots=3, rng=1)
    saved = world.state()
    world.robots[0].remove()
    world.robots.add_column("fuel", 2.0)
    world.robots.add_column("rank", [5, 6])
    world.restore(saved)
    assert world.robots.fuel.tolist() == [2.0, 2.0, 2.0]
    assert np.array_equal(world.robots.rank, [0, 5, 6])


def with_arrivals() -> CMOMMT:
    world = CMOMMT(robots=2, targets=2, rng=1)
    world.attach(Arrivals(Constant(5)), world.targets)
    return world


@pytest.mark.short
def test_a_state_brings_back_its_identities_where_agents_came_in_another_order() -> None:
    first, other = with_arrivals(), with_arrivals()
    first.run(2)
    first.robots.add(1)
    first.run(10)
    saved = first.state()
    other.run(12)
    # The same members, with other identities.
    other.robots.add(1)
    other.restore(saved)
    found = []
    for world in (first, other):
        world.run(10)
        ids = [agent.unique_id for group in world.groups for agent in group]
        assert ids == [int(one) for group in world.groups for one in group.bodies.identity]
        assert len(set(ids)) == len(ids)
        found.append((ids, world.events.to_json()))
    assert found[0] == found[1]
