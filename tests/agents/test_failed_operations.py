"""An operation that fails changes nothing: the world goes on as one in which it was never tried."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Disc, Robot, Target, Torus, World
from teamsight.policies import Action, CompiledPolicy, Policy, PolicyState, RandomWalk, Stationary
from teamsight.world.clock import Clock

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


class Broken(Robot):
    """Fails while it is made, after mesa has registered it; the third of them."""

    def __init__(self, model: World) -> None:
        super().__init__(model)
        if self.row == 2:
            raise RuntimeError("no battery")


class Early(Robot):
    """Fails before mesa has registered it."""

    def __init__(self, model: World) -> None:
        if self.row == 1:
            raise KeyboardInterrupt
        super().__init__(model)


class Loaded(Robot):
    """Has a parameter without a default."""

    def __init__(self, model: World, load: float) -> None:
        super().__init__(model)
        self.load = load


class Stubborn(CompiledPolicy):
    """A policy that can begin with so many robots only."""

    kernel = RandomWalk.kernel
    parameters = RandomWalk().parameters
    draws = 1

    def __init__(self, starts: int = 0) -> None:
        self.starts = starts

    def start(self, size: int) -> PolicyState:
        if self.starts == 0:
            raise ValueError("cannot start")
        self.starts -= 1
        return super().start(size)


class Forgetful(Stubborn):
    """Begins with a memory that its kernel cannot read."""

    def start(self, size: int) -> PolicyState:
        return PolicyState(np.zeros((size + 1, 0, 0)), np.zeros((size, 0, 0), np.int64))


class Needy(RandomWalk):
    """Cannot do without what teammates report."""

    needs = ("relayed",)


def make() -> World:
    """Return a world with two groups, some steps on."""
    world = World(Disc(3.0), rng=4)
    robots = world.add(Robot, 5, policy="a-cmommt", awareness="pairwise")
    world.senses(robots, world.add(Target, 6, policy="random-walk", speed=0.05))
    world.run(7)
    return world


def facts(world: World) -> str:
    """Return all that a user can read of a world."""
    groups = [
        (
            g.name, type(g.policy).__name__, repr(g.awareness), g.position.tolist(), g.heading.tolist(),
            g.speed.tolist(), g.turn_limit.tolist(), g.sensing_range.tolist(), g.awareness_range.tolist(),
            g.identity.tolist(), [a.unique_id for a in g], {n: c.tolist() for n, c in g.columns.items()},
        )
        for g in world.groups
    ]  # fmt: skip
    # As a text, in which what is no number equals itself.
    return repr([
        groups, world.tick, world.steps, world.clock.now, world.seed_used, world.running, world.max_neighbours,
        world.observed_fraction, world.recording.history.to_dict(), [len(agent.neighbours) for agent in world.agents if isinstance(agent, Robot)],
        sorted(agent.unique_id for agent in world.agents), {k.__name__: len(v) for k, v in world.agents_by_type.items() if len(v)},
    ])  # fmt: skip


@cache
def stranger() -> Any:
    """A group of another world."""
    return World(Disc(3.0), rng=1).add(Robot, 2, policy=Stationary())


OPERATIONS: dict[str, Callable[[World], Any]] = {
    "add: the class fails": lambda w: w.add(Broken, 5, policy="random-walk"),
    "add: the class fails early": lambda w: w.add(Early, 5, policy="random-walk"),
    "add: no arguments for the class": lambda w: w.add(type("Odd", (Robot,), {"__init__": lambda s: None}), 3, policy="random-walk"),
    "add: the policy cannot start": lambda w: w.add(Robot, 3, policy=Stubborn()),
    "add: no memory that a kernel can read": lambda w: w.add(Robot, 3, policy=Forgetful(9)),
    "add: a place outside": lambda w: w.add(Robot, 1, policy="random-walk", placement=[(9, 9)]),
    "add: a name that is taken": lambda w: w.add(Robot, 1, policy="random-walk", name="robots"),
    "add: too fast": lambda w: w.add(Robot, 1, policy="random-walk", speed=1e155),
    "add: a name that nothing has": lambda w: w.add(Robot, 2, policy="random-walk", batery=1),
    "add: the class needs more": lambda w: w.add(Loaded, 2, policy="random-walk"),
    "add: no policy": lambda w: w.add(Robot, 2),
    "add: no team": lambda w: w.add(Robot, 2, policy="random-walk", team=3),
    "add: no heading": lambda w: w.add(Robot, 2, policy="random-walk", heading=(0, 0)),
    "arrive: a place outside": lambda w: w.groups[0].add(2, position=[(0, 0), (9, 9)]),
    "arrive: too fast": lambda w: w.groups[0].add(2, speed=1e155),
    "arrive: nobody": lambda w: w.groups[0].add(0),
    "arrive: a name that nothing has": lambda w: w.groups[0].add(1, batery=1),
    "arrive: another world's group": lambda w: stranger().add(1, position=(9, 9)),
    "adjust: the policy cannot start": lambda w: w.adjust(w.groups[0], policy=Stubborn(), speed=0.3),
    "adjust: no memory that a kernel can read": lambda w: w.adjust(w.groups[0], policy=Forgetful(9), awareness="none"),
    "adjust: one wrong of three": lambda w: w.adjust(w.groups[0], speed=0.3, sensing_range=2.0, turn_limit=-1),
    "adjust: a policy that needs more": lambda w: w.adjust(w.groups[0], policy=Needy(), awareness="ring"),
    "adjust: another world's group": lambda w: w.adjust(stranger(), speed=0.3),
    "senses: another world's group": lambda w: w.senses(w.groups[0], stranger()),
    "senses: no group": lambda w: w.senses(w.groups[0], "targets"),  # type: ignore[arg-type]
    "restore: another arena": lambda w: w.restore(_state_in(Disc(9.0))),
    "restore: other groups": lambda w: w.restore(stranger().world.state()),
    "restore: no state": lambda w: w.restore({}),  # type: ignore[arg-type]
    "reset: no seed": lambda w: w.reset(-1),
    "at: has passed": lambda w: w.clock.at(3, lambda: None),
    "at: nothing to call": lambda w: w.clock.at(9, None),  # type: ignore[arg-type]
    "at: no number": lambda w: w.clock.at(float("nan"), lambda: None),
    "process: no generator": lambda w: w.clock.process(lambda: None),  # type: ignore[arg-type]
    "place: outside": lambda w: w.place(w.groups[0][0], (9, 9)),
    "speed of one": lambda w: setattr(w.groups[0][0], "speed", -1),
    "range of one": lambda w: setattr(w.groups[0][0], "awareness_range", 0),
    "column: another length": lambda w: w.groups[0].add_column("charge", [1.0, 2.0]),
    "column: a name that agents have": lambda w: w.groups[0].add_column("speed"),
    "collector: its reporter fails": lambda w: setattr(w, "datacollector", _collector_that_fails()),
    "collector: none": lambda w: setattr(w, "datacollector", None),
    "record: another world's group": lambda w: w.recording.record_transitions(stranger()),
    "run: no number": lambda w: w.run(2.5),  # type: ignore[arg-type]
}  # fmt: skip


def _state_in(arena: Any) -> Any:
    world = World(arena, rng=4)
    world.add(Robot, 5, policy="a-cmommt", awareness="pairwise")
    world.add(Target, 6, policy="random-walk", speed=0.05)
    return world.state()


def _collector_that_fails() -> Any:
    import mesa

    return mesa.DataCollector({"share": lambda model: 1 / 0})


@pytest.mark.short
@pytest.mark.parametrize("operation", OPERATIONS.values(), ids=OPERATIONS.keys())
def test_an_operation_that_fails_changes_nothing(operation: Callable[[World], Any]) -> None:
    tried, other = make(), make()
    before = facts(tried)
    for _ in range(2):
        with pytest.raises((ValueError, TypeError, AttributeError, RuntimeError, ZeroDivisionError, KeyboardInterrupt)):
            operation(tried)
        assert facts(tried) == before
    for world in (tried, other):
        world.run(5)
        world.step()
        late = world.add(Robot, 2, policy="random-walk", name="late")
        world.run(5)
        assert len(late) == 2
    assert facts(tried) == facts(other)


@pytest.mark.parametrize("what", ["reset", "remove"])
def test_a_policy_that_cannot_begin_again_leaves_everything_as_it_is(what: str) -> None:
    class Counting(Policy):
        """A NumPy policy whose memory cannot be begun twice."""

        draws = 0
        begun = False

        def start(self, size: int) -> Any:
            if self.begun:
                raise ValueError("only once")
            self.begun = True
            return np.zeros(size)

        def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
            return Action(percept.heading, percept.speed), memory + 1

    world = World(Disc(3.0), rng=4)
    world.add(Target, 2, policy="random-walk")
    robots = world.add(Robot, 3, policy=Counting())
    world.run(3)
    before = facts(world)
    if what == "reset":
        with pytest.raises(ValueError, match="only once"):
            world.reset(9)
        assert facts(world) == before
    else:
        # Those who stay keep what they remember: nothing begins again.
        robots[0].remove()
        assert robots.policy_state.tolist() == [3.0, 3.0]
    world.run(3)
    assert world.tick == 6


def test_robots_of_an_add_that_failed_are_nobodys_neighbours() -> None:
    world = World(Disc(1.0), rng=1)
    robot = world.add(Robot, 1, policy=Stationary(), awareness="pairwise", awareness_range=2.0)[0]
    for _ in range(3):
        with pytest.raises(RuntimeError, match="no battery"):
            world.add(Broken, 3, policy=Stationary(), awareness_range=2.0)
    world.run(2)
    assert robot.neighbours == []
    assert world.max_neighbours == 0
    assert [group.name for group in world.groups] == ["robots"]
    assert world.add(Robot, 1, policy=Stationary())[0].unique_id == 2


def test_what_an_agent_said_of_its_group_while_it_was_made_is_forgotten_with_it() -> None:
    class Eager(Robot):
        def __init__(self, model: World) -> None:
            super().__init__(model)
            model.senses(self.group, model.groups[0])
            model.recording.record_transitions(self.group)
            raise RuntimeError("on second thoughts")

    world = World(Disc(1.0), rng=1)
    world.add(Target, 2, policy=Stationary())
    with pytest.raises(RuntimeError, match="on second thoughts"):
        world.add(Eager, 2, policy=Stationary())
    world.run(3)
    assert len(world.groups) == 1


def test_a_range_that_a_torus_cannot_have_is_refused_for_one_robot_too() -> None:
    world = World(Torus(4.0, 4.0), rng=1)
    robots = world.add(Robot, 3, policy="random-walk")
    with pytest.raises(ValueError, match=r"range=3: on a torus a range must be at most half .*2"):
        robots[1].sensing_range = 3.0
    assert robots.sensing_range.tolist() == [1.0] * 3
    world.run(2)


def test_an_event_that_fails_leaves_those_after_it_to_happen() -> None:
    clock, log = Clock(), []
    clock.at(1.5, lambda: 1 / 0)
    clock.at(1.7, lambda: log.append(clock.now))
    with pytest.raises(ZeroDivisionError):
        clock.advance(2)
    assert clock.now == 2
    clock.advance(2)
    assert log == [1.7]
    assert clock.now == 2


def test_a_reset_that_fails_keeps_the_seed_and_the_collector() -> None:
    class Fussy(CMOMMT):
        pass

    import mesa

    class Own(mesa.DataCollector):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__({"tick": "tick"})

    model = Fussy(rng=3)
    model.datacollector = Own()
    model.run(4)
    before = facts(model)
    with pytest.raises(TypeError):
        model.reset(8)
    assert facts(model) == before


def test_groups_that_a_class_has_added_leave_with_it() -> None:
    class Bringing(Robot):
        def __init__(self, model: World) -> None:
            super().__init__(model)
            if self.row == 0:
                model.add(Target, 2, policy="random-walk", name="nested")
            else:
                raise RuntimeError("no more")

    tried = make()
    before = facts(tried)
    for _ in range(2):
        with pytest.raises(RuntimeError, match="no more"):
            tried.add(Bringing, 2, policy="random-walk")
        assert facts(tried) == before


@pytest.mark.parametrize("deed", ["remove", "adjust", "place", "range", "add", "arrive"])
def test_ctrl_c_in_an_operation_leaves_all_of_it_or_none(deed: str) -> None:
    """Ctrl-C comes at each line of the operation in turn, as a debugger would stop there."""
    before_handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        for line in range(1500):
            world = make()
            robots = world.groups[0]
            robots.add_column("battery", 1.0)
            done = interrupted_at(line, lambda world=world, robots=robots: _do(deed, world, robots))
            sizes = {
                len(robots), len(robots.agents), len(robots.bodies.position), len(robots.sensing_range), len(robots.policy_state.floats),
                len(robots.columns["battery"]), sum(agent.group is robots for agent in world.agents),
                len(robots.perception.situation), robots.action.distance.shape[0],
            }  # fmt: skip
            assert len(sizes) == 1, (line, sizes)
            assert sum(map(len, world.groups)) == len(world.agents)
            # What the compiled loop works on is what can be read.
            before = robots.position.copy()
            world.step()
            assert np.allclose(robots.bodies.moved, robots.position - before, atol=1e-12)
            assert (np.hypot(*robots.bodies.moved.T) <= robots.speed + 1e-12).all()
            if done:
                break
        assert done
    finally:
        signal.signal(signal.SIGINT, before_handler)


def _do(deed: str, world: World, robots: Any) -> None:
    if deed == "remove":
        robots[1].remove()
    elif deed == "adjust":
        world.adjust(robots, policy="centroid", speed=0.2, awareness_range=0.5)
    elif deed == "place":
        robots[1].position = (0.1, 0.2)
    elif deed == "range":
        robots[1].awareness_range = 0.3
    elif deed == "arrive":
        robots.add(2, battery=[0.3, 0.4])
    else:
        world.add(Robot, 2, policy="random-walk", name="late")


def interrupted_at(line: int, deed: Callable[[], Any]) -> bool:
    """Do something and send Ctrl-C when this package comes to its line of this number; return whether it was done before."""
    count = [0]

    def trace(frame: Any, event: str, argument: Any) -> Any:
        if "/agents/" not in frame.f_code.co_filename or "/tests/" in frame.f_code.co_filename:
            return None
        if event == "line":
            count[0] += 1
            if count[0] == line + 1:
                signal.raise_signal(signal.SIGINT)
        return trace

    kept = sys.gettrace()
    try:
        sys.settrace(trace)
        deed()
    except KeyboardInterrupt:
        return False
    finally:
        sys.settrace(kept)
    return count[0] <= line


def test_an_agent_that_could_not_be_made_acts_on_nobody() -> None:
    kept = []

    class Kept(Robot):
        def __init__(self, model: World, fails: bool = False) -> None:
            super().__init__(model)
            kept.append(self)
            if fails:
                raise RuntimeError("no more")

    world = World(Disc(5.0), rng=1)
    robots = world.add(Kept, 2, policy="random-walk")
    with pytest.raises(RuntimeError, match="no more"):
        robots.add(1, fails=True)
    (new,) = robots.add(1)
    assert kept[2].pos is None
    with pytest.raises(ValueError, match="removed already"):
        kept[2].remove()
    assert new in robots.agents
    assert new in world.agents
