"""Cycles: which robots decide when, on both paths, against one SimPy process for each robot."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Box, Cycle, Robot, Target, Torus, World
from teamsight.agents.decisions import EVERY_STEP, give_timetable
from teamsight.policies import ACmommt, Policy, RandomWalk
from teamsight.policies.compiled import CompiledPolicy
from teamsight.policies.handmade.target_tracks import USED
from teamsight.policies.interface import Action, Percept
from teamsight.policies.percept_of_one import PerceptOfOne
from tests.agents.engine.test_leaking_arenas import Room

POLICIES = ("a-cmommt", "random-walk", "centroid", "evasive", "stationary", "evolved", "lazy-cooperative")
DEGREES = ("none", "ring", "nearest", "pairwise", "shared")
MIXED = Cycle([1, 2.5, 3, 5, 7, 1], phase=[0, 1, 0.5, 4, 0, 3], jitter=[0.5, 0, 2, 4, 0, 0], delay=[0, 1, 0, 3, 2, 0])


def bits(world: World) -> list[bytes]:
    """Return all that shows how the bodies have moved."""
    arrays = [
        array for group in world.groups
        for array in (group.bodies.position, group.bodies.heading, group.bodies.moved, group.decided_at)
    ]  # fmt: skip
    return [array.tobytes() for array in arrays] + [np.float64(world.observed_fraction).tobytes()]


def on_timetable(world: World) -> World:
    """Make all robots decide at every step by a timetable, which they do not need."""
    for group in world.groups:
        give_timetable(world._data, group, EVERY_STEP.numbers(len(group)))
    world._engine.is_bound = False
    return world


class InPython(Policy):
    """A policy with a kernel, called from Python."""

    def __init__(self, policy: CompiledPolicy) -> None:
        self._policy = policy
        self.draws, self.inputs, self.needs = policy.draws, policy.inputs, policy.needs

    def start(self, size: int) -> Any:
        return self._policy.start(size)

    def decide(self, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
        return self._policy.decide(percept, state, noise)


def model(policy: Any = "a-cmommt", awareness: str = "pairwise", **more: Any) -> CMOMMT:
    return CMOMMT(robots=6, targets=7, radius=2.5, policy=policy, awareness=awareness, rng=more.pop("rng", 3), **more)


@pytest.mark.parametrize("awareness", DEGREES)
@pytest.mark.parametrize("policy", POLICIES)
def test_a_timetable_with_every_step_gives_the_same_bits(policy: str, awareness: str) -> None:
    try:
        plain = model(policy, awareness)
    except ValueError:
        pytest.skip("this policy does not fit this degree")
    forced = on_timetable(model(policy, awareness))
    plain.run(40)
    forced.run(40)
    assert forced.robots.due is not None
    assert plain.robots.timetable is None
    assert bits(plain) == bits(forced)


@pytest.mark.parametrize("awareness", ["none", "ring", "shared"])
def test_any_mix_of_steps_and_runs_gives_the_same_bits_in_kernels_and_in_python(awareness: str) -> None:
    worlds = [model("a-cmommt", awareness, cycle=MIXED) for _ in range(3)]
    rule: Any = worlds[0].robots.policy
    worlds.append(model(InPython(rule), awareness, cycle=MIXED))
    worlds[0].run(30)
    for _ in range(30):
        worlds[1].step()
    for steps in (7, 1, 22):
        worlds[2].run(steps)
    for _ in range(30):
        worlds[3].step()
    assert not worlds[3].robots.is_compiled
    assert len({tuple(bits(world)) for world in worlds}) == 1


def decisions_by_processes(cycle: Cycle, size: int, steps: int, seed: int) -> list[list[tuple[float, int]]]:
    """Return (time, robot) of the sensings before each step, from one SimPy process for each robot."""
    world = World(Box(5, 5), rng=seed)
    world.add(Target, 1, policy="stationary")
    seen: list[tuple[float, int]] = []

    def robot(number: int) -> Any:
        for time in cycle.times(steps + 1, size, seed=seed)[number]:
            yield world.clock.timeout(max(time - world.clock.now, 0.0))
            seen.append((world.clock.now, number))

    for number in range(size):
        world.clock.process(robot(number))
    found = []
    for _ in range(steps):
        world.step()
        found.append(seen.copy())
        seen.clear()
    return found


cycles = st.builds(
    lambda period, phase, jitter, delay: Cycle(period, phase, jitter * period, delay),
    st.floats(1, 12), st.one_of(st.just("random"), st.floats(0, 15)), st.floats(0, 0.99), st.integers(0, 4),
)  # fmt: skip


@settings(max_examples=15, deadline=None)
@given(cycle=cycles, seed=st.integers(0, 2**32))
def test_robots_decide_when_one_process_for_each_would(cycle: Cycle, seed: int) -> None:
    world = World(Box(5, 5), rng=seed)
    robots = world.add(Robot, 5, policy="random-walk", cycle=cycle)
    order = []

    def rule(percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        order.append((float(percept.time), float(percept.heading[0])))
        return 0.0, 0.0

    other = World(Box(5, 5), rng=seed)
    called = other.add(Robot, 5, policy=rule, cycle=cycle)
    for tick, sensed in enumerate(decisions_by_processes(cycle, 5, 20, seed)):
        due = sorted({robot for _, robot in sensed})
        assert all(tick - 1 < time <= tick + 1e-9 for time, _ in sensed)
        headings = [(float(tick), float(robot.heading[0])) for robot in (called[row] for row in due)]
        world.step()
        other.step()
        assert np.flatnonzero(robots.decided_at == tick).tolist() == due
        assert np.flatnonzero(called.decided_at == tick).tolist() == due
        assert order == headings
        order.clear()


def test_a_robot_keeps_its_last_action_and_stays_before_its_first() -> None:
    world = World(Box(50, 50), rng=2)
    robots = world.add(Robot, 4, policy="random-walk", cycle=Cycle(5, phase=2), speed=0.1, position=(0, 0))
    world.run(2)
    assert (robots.position == 0).all()
    world.run(1)
    first = robots.heading.copy()
    assert np.hypot(*robots.bodies.moved.T) == pytest.approx(0.1)
    world.run(4)
    assert (robots.heading == first).all()
    world.run(1)
    assert (robots.heading != first).all()


@pytest.mark.parametrize("delay", [0, 1, 2, 5])
def test_a_robot_that_turns_on_sight_does_so_the_delay_later(delay: int) -> None:
    def rule(percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        return (math.pi / 2 if len(percept.targets.distance) else 0.0), 0.1

    world = World(Box(40, 40), rng=1)
    robot = world.add(
        Robot, 1, policy=rule, position=(-10, 0), heading=(1, 0), sensing_range=1.05, speed=0.1, cycle=Cycle(delay=delay)
    )
    world.senses(robot, world.add(Target, 1, policy="stationary", position=(-8, 0)))
    # It moves from tick `delay` on, and is within 1.05 of the target after 10 steps of 0.1.
    for tick in range(10 + 2 * delay):
        world.step()
        assert robot.heading[0].tolist() == [1, 0], tick
    world.step()
    assert robot.heading[0] == pytest.approx([0, 1])


def test_odometry_is_the_way_since_the_last_decision() -> None:
    ways: dict[float, list[npt.NDArray[np.float64]]] = {}

    class Wanderer(Policy):
        draws = 1

        def decide(self, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
            ways[float(percept.time[0])] = percept.moved.copy()
            angle = 2 * np.pi * noise[0]
            return Action(np.stack([np.cos(angle), np.sin(angle)], axis=-1), percept.speed), None

    world = World(Box(3, 3), rng=4)
    robots = world.add(Robot, 5, policy=Wanderer(), cycle=Cycle(5, phase=1), speed=0.4)
    places = [robots.position.copy()]
    for _ in range(22):
        world.step()
        places.append(robots.position.copy())
    assert sorted(ways) == [1, 6, 11, 16, 21]
    for last, now in ((6, 11), (11, 16), (16, 21)):
        assert ways[now] == pytest.approx(places[now] - places[last])
    assert ways[1] == pytest.approx(places[1] - places[0])


def test_a_lost_target_is_expected_where_it_is() -> None:
    # A robot of A-CMOMMT sees a target twice, at ticks 0 and 5, which then outruns it: offsets are from the robot.
    world = World(Box(90, 90), rng=5)
    robots = world.add(
        Robot, 1, policy=ACmommt(predictive=4.0), cycle=5, position=(20, 30), heading=(1, 0), speed=0.1,
        sensing_range=2.0,
    )  # fmt: skip
    straight = {"turn_probability": 0.0}
    target = world.add(
        Target, 1, policy="random-walk", policy_options=straight, position=(21.6, 30), heading=(1, 0), speed=0.15
    )
    world.senses(robots, target)
    for decision in (10, 15, 20):
        world.run(decision - world.tick)
        offset = target.position[0] - robots.position[0]
        world.run(1)
        assert len(world.groups[0].neighbours("targets").distance) == 0
        slot = target[0].unique_id % 16
        assert robots.policy_state.ints[0, 0, USED] == 1 << slot
        assert robots.policy_state.floats[0, slot, :2] == pytest.approx(offset, abs=1e-9)


def test_noise_does_not_depend_on_who_is_due() -> None:
    worlds = [World(Torus(30, 30), rng=8) for _ in range(2)]
    every = worlds[0].add(Robot, 3, policy="random-walk")
    some = worlds[1].add(Robot, 3, policy="random-walk", cycle=Cycle([1, 3, 4]))
    for tick in range(13):
        for world in worlds:
            world.step()
        due = some.decided_at == tick
        assert (some.heading[due] == every.heading[due]).all()
    assert due.tolist() == [True, True, True]


@pytest.mark.parametrize("steps", [3, 11])
def test_a_state_in_mid_cycle_goes_on_alike(steps: int) -> None:
    one = model(cycle=MIXED)
    one.run(steps)
    saved = one.state()
    one.run(17)
    expected = bits(one)
    one.restore(saved)
    one.run(17)
    assert bits(one) == expected
    other = model(cycle=MIXED)
    other.restore(saved)
    other.run(17)
    assert bits(other) == expected


def test_reset_begins_again_with_the_cycle_of_the_group() -> None:
    one, other = model(cycle=Cycle(4, phase="random", jitter=1, delay=2)), model(rng=9)
    other.cycle = Cycle(4, phase="random", jitter=1, delay=2)
    one.run(20)
    expected = bits(one)
    one.run(5)
    one.robots[2].cycle = 9
    one.run(5)
    one.reset()
    assert one.robots[2].cycle == one.robots[1].cycle
    one.run(20)
    assert bits(one) == expected
    other.run(7)
    other.reset(3)
    other.run(20)
    assert bits(other) == expected


def test_a_cycle_changed_in_mid_run_begins_then() -> None:
    world = World(Box(5, 5), rng=1)
    robots = world.add(Robot, 3, policy="random-walk", cycle=10)
    world.run(4)
    robots.cycle = Cycle(6, phase=1)
    robots[1].cycle = 3
    found = []
    for _ in range(12):
        world.step()
        found.append(robots.decided_at.tolist())
    assert found[0] == [0, 4, 0]
    assert found[1] == [5, 4, 5]
    assert found[3] == [5, 7, 5]
    assert found[-1] == [11, 13, 11]
    assert robots[1].cycle == Cycle(3)
    assert robots.cycle.period == (6, 3, 6)
    robots.cycle = Cycle()
    world.run(2)
    assert robots.decided_at.tolist() == [17, 17, 17]


def test_actions_on_their_way_take_effect_when_they_were_to() -> None:
    world = World(Box(50, 50), rng=2)
    robots = world.add(Robot, 1, policy="random-walk", cycle=Cycle(20, delay=6), position=(0, 0))
    world.run(3)
    robots.cycle = Cycle(50, phase=40, delay=1)
    world.run(3)
    assert (robots.position == 0).all()
    world.run(1)
    assert (robots.position != 0).any()


def test_agents_that_come_and_go_keep_the_cycles_of_the_others() -> None:
    world = World(Box(20, 20), rng=6)
    robots = world.add(Robot, 4, policy="random-walk", cycle=Cycle(6, phase="random", delay=2))
    world.run(3)
    times = robots.decided_at.copy()
    robots.add(2)
    assert robots.decided_at.tolist() == [*times, -1, -1]
    robots[1].remove()
    world.run(30)
    lists = Cycle(6, phase="random").times(33, 4, seed=6)
    expected = [math.ceil(lists[member][-1] - 1e-9) for member in (0, 2, 3)]
    # A sensing in the last fraction of a tick is for the next step.
    assert [at if at < 33 else at - 6 for at in expected] == robots.decided_at[:3].tolist()
    assert (robots.decided_at[3:] >= 33 - 6).all()
    robots[0].cycle = 5
    with pytest.raises(ValueError, match=r"cycle: the agents of 'robots' have different ones.*add\(…, cycle=5\)"):
        robots.add(1)
    robots.add(2, cycle=Cycle([3, 4]))
    assert robots.cycle.period == (5, 6, 6, 6, 6, 3, 4)
    plain = world.add(Target, 2, policy="random-walk")
    plain.add(1, cycle=4)
    world.run(3)
    assert plain.decided_at.tolist() == [35, 35, 33]


def test_inactive_robots_do_not_decide_and_go_on_with_their_timetable() -> None:
    world = World(Box(20, 20), rng=6)
    robots = world.add(Robot, 3, policy="random-walk", cycle=Cycle(4))
    world.run(2)
    robots[1].active = False
    world.run(8)
    assert robots.decided_at.tolist() == [8, 0, 8]
    robots[1].active = True
    world.run(3)
    assert robots.decided_at.tolist() == [12, 12, 12]


def test_a_failed_step_in_python_is_decided_again() -> None:
    fails = [True]

    def rule(percept: PerceptOfOne, rng: np.random.Generator) -> tuple[float, float]:
        if percept.time == 4 and fails[0]:
            raise RuntimeError("no battery")
        return 0.3, 0.1

    world, other = World(Box(20, 20), rng=6), World(Box(20, 20), rng=6)
    robots = world.add(Robot, 3, policy=rule, cycle=Cycle(2, delay=1))
    with pytest.raises(RuntimeError, match="no battery"):
        for _ in range(9):
            world.step()
    assert world.tick == 4
    assert robots.decided_at.tolist() == [2, 2, 2]
    fails[0] = False
    other.add(Robot, 3, policy=rule, cycle=Cycle(2, delay=1))
    for _ in range(9):
        other.step()
    for _ in range(5):
        world.step()
    assert bits(world) == bits(other)


def test_transitions_need_a_decision_at_every_step() -> None:
    one = model("random-walk", cycle=5)
    with pytest.raises(ValueError, match=r"Cycle\(\)"):
        one.recording.record_transitions(one.robots)
    other = model("random-walk")
    other.recording.record_transitions(other.robots)
    with pytest.raises(ValueError, match=r"cycle=5: transitions of 'robots' are recorded"):
        other.robots.cycle = 5
    with pytest.raises(ValueError, match=r"transitions of 'robots' are recorded"):
        other.robots[0].cycle = 5
    assert other.robots.timetable is None


class Scout(Robot):
    """A robot with a period of its own."""

    def __init__(self, model: Any, period: float, rule: str = "") -> None:
        super().__init__(model)
        self.cycle = period
        if rule:
            self.policy = rule


def test_what_init_sets_is_what_agents_begin_with() -> None:
    world = World(Torus(9, 9), rng=2)
    scouts = world.add(Scout, 3, policy="random-walk", period=[2, 3, 4])
    world.run(5)
    scouts.add(1, period=5, cycle=1)
    scouts[0].cycle = 7
    assert scouts.cycle.period == (7, 3, 4, 5)
    world.reset()
    assert scouts.cycle.period == (2, 3, 4, 5)
    world.run(8)
    assert scouts.decided_at.tolist() == [6, 6, 4, 5]
    with pytest.raises(RuntimeError, match=r"policy='centroid': set in Scout\.__init__.*after world\.add"):
        scouts.add(1, period=5, cycle=1, rule="centroid")
    assert len(scouts) == 4
    world.run(1)
    assert scouts.decided_at.tolist() == [8, 6, 8, 5]


@pytest.mark.parametrize("delay", [0, 2])
def test_a_step_that_fails_changes_no_timetable(delay: int) -> None:
    found = []
    for rule in (RandomWalk(), InPython(RandomWalk())):
        world = World(Room(), rng=3)
        robots = world.add(Robot, 3, policy=rule, speed=0.15, cycle=Cycle([2, 3, 5], delay=delay), position=(0, 0))
        ticks = []
        while world.tick < 60:
            try:
                world.step()
            except ValueError as error:
                assert "outside" in str(error) or "left" in str(error)
                ticks.append(world.tick)
                for robot in robots:
                    robot.position = (0, 0)
        found.append((ticks, bits(world)))
    assert found[0][0]
    assert found[0] == found[1]


@pytest.mark.short
def test_a_state_of_a_world_with_another_cycle_is_refused_and_one_with_a_changed_cycle_is_not() -> None:
    first, alike, other = (CMOMMT(robots=4, targets=3, rng=2, cycle=cycle) for cycle in (3, Cycle(3), 4))
    first.run(5)
    with pytest.raises(ValueError, match=r"robots that have .*period=3\.0.*robots have .*period=4\.0.* here"):
        other.restore(first.state())
    with pytest.raises(ValueError, match=r"period=3\.0"):
        CMOMMT(robots=4, targets=3, rng=2).restore(first.state())
    first.robots.cycle = 7
    first.run(5)
    alike.restore(first.state())
    assert alike.robots.cycle == Cycle(7)
    for world in (first, alike):
        world.run(20)
    assert bits(first) == bits(alike)
