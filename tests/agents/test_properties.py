"""A property of agents is declared in one line; then all that changes, saves or begins agents knows it."""

from __future__ import annotations

import pickle
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from teamsight import CMOMMT, Arrivals, Constant, Departures, Disc, Robot, World
from teamsight.agents import group as groups
from teamsight.agents.engine.binding import Sizes
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.core.kernel import Entry, Record
from teamsight.core.table import Field
from teamsight.world.motion import BODIES

Floats = np.ndarray[Any, np.dtype[np.float64]]


class Painted(NamedTuple):
    paint: Annotated[Floats, "n"]
    total: Annotated[Floats, 1]


PAINTED = Record(Painted)
painted_at = PAINTED.at


def _add_up(address: int) -> int:
    here = painted_at(address)
    here.total[0] = 0.0
    for i in range(here.paint.shape[0]):
        here.total[0] += here.paint[i]
    return 0


ADD_UP = Entry(_add_up)


class Fragile(Robot):
    """A robot whose ``__init__`` paints others, and may fail then."""

    def __init__(self, model: Any, fails: bool = False) -> None:
        super().__init__(model)
        if fails:
            self.group.bodies.paint[:] = -1.0
            raise RuntimeError("out of paint")


@pytest.fixture(autouse=True)
def _declared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Declare two properties: one that a reset takes back to that with which an agent began, and one that it fills."""
    more = Field("paint", fill=2.0, reset="first"), Field("mark", np.int64, fill=7, reset="fill")
    monkeypatch.setattr(groups, "BODIES", (*BODIES, *more))


def painted(seed: int = 1) -> CMOMMT:
    world = CMOMMT(robots=4, targets=3, rng=seed)
    world.robots.bodies.paint[:] = [10, 11, 12, 13]
    world.robots.bodies.mark[:] = [1, 2, 3, 4]
    return world


def shown(world: World) -> tuple[list[float], list[int]]:
    bodies = world.groups[0].bodies
    return bodies.paint.tolist(), bodies.mark.tolist()


def test_agents_who_come_have_the_fill_and_those_who_leave_take_theirs_along() -> None:
    world = painted()
    world.robots.add(2)
    world.robots[1].remove()
    world.run(3)
    assert shown(world) == ([10, 12, 13, 2, 2], [1, 3, 4, 7, 7])


def test_agents_who_arrive_and_depart() -> None:
    world = painted()
    world.attach(Arrivals(Constant(4), position=(0, 0)), world.robots)
    world.attach(Departures(Constant(10)), world.robots)
    world.run(9)
    assert shown(world) == ([10, 11, 12, 13, 2, 2], [1, 2, 3, 4, 7, 7])
    world.run(3)
    assert shown(world) == ([2, 2], [7, 7])


def test_states_hold_it_and_bring_agents_back_with_it() -> None:
    world = painted()
    world.run(2)
    saved = pickle.dumps(world.state())
    world.robots[0].remove()
    world.robots.add(1)
    world.robots.bodies.paint[:] = 0
    for one in (world, CMOMMT(robots=4, targets=3, rng=5)):
        one.restore(pickle.loads(saved))
        assert shown(one) == ([10, 11, 12, 13], [1, 2, 3, 4])
        one.run(2)
        assert shown(one) == ([10, 11, 12, 13], [1, 2, 3, 4])


def test_a_reset_and_a_reused_world_begin_with_it() -> None:
    world = painted()
    world.robots.members.paint[:] = [5, 6, 7, 8]
    world.run(2)
    world.robots[2].remove()
    world.reset()
    assert shown(world) == ([5, 6, 8], [7, 7, 7])
    worlds, parameters = ReusedWorlds(), {"robots": 4, "targets": 3}
    first = worlds.begin(CMOMMT, parameters, 1)
    first.groups[0].bodies.paint[:], first.groups[0].bodies.mark[:] = 9, 9
    first.run(2)
    assert worlds.begin(CMOMMT, parameters, 2) is first
    assert shown(first) == ([2] * 4, [7] * 4)


def test_what_an_operation_that_fails_has_written_is_undone() -> None:
    world = World(Disc(5.0), rng=1)
    world.add(Fragile, 3, policy="random-walk")
    world.groups[0].bodies.paint[:] = [1, 2, 3]
    with pytest.raises(RuntimeError, match="out of paint"):
        world.groups[0].add(1, fails=True)
    assert shown(world) == ([1, 2, 3], [7, 7, 7])
    world.groups[0].add(1)
    assert shown(world) == ([1, 2, 3, 2], [7, 7, 7, 7])


def test_kernels_read_it_and_their_records_follow_those_who_come() -> None:
    world = painted()
    robots = world.robots
    robots.add(1)
    robots[-1].remove()
    total = np.zeros(1)
    packed = PAINTED.pack(Painted(robots.bodies.paint, total))
    sizes = Sizes([robots], [np.zeros(1, np.int64)])
    sizes.add_rows(packed, robots)
    place = robots.bodies.whole("paint").ctypes.data
    for change, expected in ((lambda: robots.add(2), 50.0), (robots[0].remove, 40.0)):
        change()
        sizes.follow(robots)
        ADD_UP(packed)
        assert total[0] == expected
    assert robots.bodies.whole("paint").ctypes.data == place
