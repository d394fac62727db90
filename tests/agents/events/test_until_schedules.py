"""Random schedules: what compiled waits see is what conditions in Python see, whatever changes the world meanwhile."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import Box, Robot, Sensor, Target, World
from teamsight.agents import AgentLeftError

STEPS = 40
KINDS = ("observed", "lost", "contact", "contact any", "contact_ended", "contact_ended any", "sensed")
CHANGES = ("move", "remove", "off", "on", "add", "break", "repair", "range", "policy")

waits = st.lists(st.tuples(st.integers(0, STEPS), st.sampled_from(KINDS), st.integers(0, 9)), min_size=1, max_size=6)
changes = st.lists(st.tuples(st.integers(0, 2 * STEPS), st.sampled_from(CHANGES), st.integers(0, 9)), max_size=8)


def built(sensor: Sensor | None) -> World:
    world = World(Box(3, 3), rng=3)
    robots = world.add(Robot, 3, policy="random-walk", speed=0.3)
    targets = world.add(Target, 3, policy="random-walk", speed=0.2)
    world.senses(robots, targets, sensor=sensor)
    return world


def change(world: World, what: str, pick: int) -> None:
    robots, targets = world.groups
    group = (robots, targets)[pick % 2]
    agent = group[pick % len(group)] if len(group) else None
    if what == "add":
        group.add(1)
    elif what == "range":
        world.adjust(robots, awareness_range=0.3 + pick / 10)
    elif what == "policy":
        world.adjust(robots, policy="stationary" if pick % 2 else "random-walk")
    elif agent is None:
        return
    elif what == "move":
        agent.position = (pick / 5 - 1, 0)
    elif what == "remove":
        agent.remove()
    elif what in ("off", "on"):
        agent.active = what == "on"
    elif group is robots and what == "break":
        agent.break_sensor("targets")
    elif group is robots:
        agent.repair_sensor("targets")


def compiled(world: World, kind: str, robot: Any, other: Any, target: Any) -> Any:
    until, name = world.until, kind.split()[0]
    if kind in ("observed", "lost"):
        return getattr(until, kind)(target)
    if kind == "sensed":
        return until.contact(robot, target, "targets")
    return getattr(until, name)(robot, None if "any" in kind else other)


def in_python(world: World, kind: str, robot: Any, other: Any, target: Any) -> Any:
    def gone(*agents: Any) -> bool:
        return any(agent._row < 0 for agent in agents)

    tests: dict[str, Callable[[], Any]] = {
        "observed": lambda: "left" if gone(target) else target.is_observed,
        "lost": lambda: gone(target) or not target.is_observed,
        "contact": lambda: "left" if gone(robot, other) else other in robot.neighbours,
        "contact any": lambda: "left" if gone(robot) else bool(robot.neighbours),
        "contact_ended": lambda: gone(robot, other) or other not in robot.neighbours,
        "contact_ended any": lambda: gone(robot) or not robot.neighbours,
        "sensed": lambda: "left" if gone(robot, target) else target in robot.sensed("targets"),
    }
    return world.until(tests[kind])


def history(
    sensor: Sensor | None, plan: list[Any], script: list[Any], wait: Callable[..., Any], advance: Callable[[World], None]
) -> list[Any]:
    """Return when each wait ended, and whether because an agent had left."""
    world, log = built(sensor), []
    robots, targets = (list(group) for group in world.groups)

    def follow(number: int, time: int, kind: str, pick: int) -> Generator[Any, Any, None]:
        yield world.clock.timeout(time)
        agents = robots[pick % 3], robots[(pick + 1) % 3], targets[pick % 3]
        try:
            value = yield wait(world, kind, *agents)
        except AgentLeftError:
            value = "left"
        log.append((number, world.tick, value == "left"))

    for time, what, pick in script:
        world.clock.at(time / 2, lambda what=what, pick=pick: change(world, what, pick))
    for number, given_wait in enumerate(plan):
        world.clock.process(follow(number, *given_wait))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        advance(world)
    assert world.tick == STEPS
    return sorted(log)


def parts(world: World) -> None:
    world.run(11)
    world.step()
    world.run(STEPS - 12)


@settings(max_examples=25, deadline=None)
@given(missed=st.sampled_from([0.0, 0.2]), plan=waits, script=changes)
def test_compiled_waits_end_when_conditions_in_python_do(missed: float, plan: list[Any], script: list[Any]) -> None:
    sensor = Sensor(missed=missed) if missed else None
    expected = history(sensor, plan, script, in_python, lambda world: world.run(STEPS))
    assert history(sensor, plan, script, compiled, lambda world: world.run(STEPS)) == expected
    assert history(sensor, plan, script, compiled, parts) == expected
