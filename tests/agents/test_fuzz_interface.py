"""A fuzzer of the Python interface: whatever is done in whichever order, it works or is refused and changes nothing.

Two worlds are treated alike; one is run, the other stepped. After everything that is done they are equal to the last bit.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from teamsight import CMOMMT, Box, Disc, Robot, Target, Torus, World
from teamsight.agents.awareness import RelayedAwareness, RingAwareness
from teamsight.policies import Action, Policy, RandomWalk, Stationary

REFUSALS = (ValueError, TypeError, AttributeError, KeyError)

NONSENSE: list[Any] = [
    None, True, "", "fast", -1, 0, 1.5, math.nan, math.inf, -math.inf, 1e155, 5e-324, -0.0, 10**400, 2**63, 1j, b"x", [], (),
    {}, [1.0], [[1.0]], [1, "a"], np.nan, np.zeros(0), np.zeros((2, 2, 2)), object(), lambda: None, Robot, World, "a-cmomt",
    np.array(["a", None], object),
]  # fmt: skip


class Rival(Robot):
    """A robot of another team."""

    team: ClassVar[str | None] = "rivals"


class Slow(Robot):
    """A robot that goes half as far as its policy says."""

    def decide(self, percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        turn, distance = super().decide(percept, rng)
        return turn, distance / 2


class Straight(Policy):
    """A NumPy policy that remembers how often it decided."""

    draws = 1

    def start(self, size: int) -> Any:
        return np.zeros(size)

    def decide(self, percept: Any, memory: Any, noise: Any) -> Any:
        return Action(percept.heading, percept.speed * noise[0]), memory + 1


CLASSES = [Robot, Target, Rival, Slow]
POLICIES: list[Any] = [
    "a-cmommt", "centroid", "random-walk", "stationary", "evasive", "evolved", RandomWalk(0.05), Stationary(), Straight(),
    lambda percept, rng: (float(rng.random()), 0.05),
]  # fmt: skip
AWARENESS: list[Any] = ["none", "ring", "nearest", "pairwise", "shared", "relayed", RingAwareness(3), RelayedAwareness(1, 2, 0.3)]
lengths = st.sampled_from([0.05, 0.3, 1.0, 2.0])
nonsense = st.sampled_from(NONSENSE)


def facts(world: World) -> str:
    """Return all that can be read of a world."""
    groups = [
        [
            group.name, group.position.tolist(), group.heading.tolist(), group.speed.tolist(), group.turn_limit.tolist(),
            group.sensing_range.tolist(), group.awareness_range.tolist(), group.identity.tolist(),
            repr(group.awareness), type(group.policy).__name__, {n: c.tolist() for n, c in group.columns.items()},
        ]
        for group in world.groups
    ]  # fmt: skip
    return repr(
        [
            groups, world.tick, world.steps, world.clock.now, world.running, world.observed_fraction, world.max_neighbours,
            world.observed, world.mean_degree, world.recording.history.to_dict(), len(world.agents),
            world.datacollector.get_model_vars_dataframe().to_dict(),
        ]
    )  # fmt: skip


class Interface(RuleBasedStateMachine):
    """Two worlds alike."""

    def both(self, deed: Callable[[World], Any]) -> None:
        """Do something with both worlds; what is refused changes nothing."""
        refused = []
        for world in self.worlds:
            before = facts(world)
            try:
                deed(world)
                refused.append("")
            except REFUSALS as error:
                message = error.args[0] if error.args else ""
                assert message, repr(error)
                assert "\n" not in str(message), message
                assert len(str(message)) < 400, message
                assert facts(world) == before
                refused.append(type(error).__name__)
        assert refused[0] == refused[1]

    @initialize(arena=st.sampled_from([Disc(2.0), Box(4.0, 3.0), Torus(5.0, 4.5), None]), seed=st.integers(0, 99))
    def begin(self, arena: Any, seed: int) -> None:
        if arena is None:
            self.worlds: list[World] = [CMOMMT(robots=3, targets=4, radius=2.0, rng=seed) for _ in range(2)]
        else:
            self.worlds = [World(arena, rng=seed) for _ in range(2)]
        self.saved = pickle.dumps(self.worlds[0].state(pending="drop"))

    @rule(
        kind=st.sampled_from(CLASSES), count=st.integers(1, 4), policy=st.sampled_from(POLICIES),
        awareness=st.sampled_from(AWARENESS), reach=lengths, speed=lengths,
    )  # fmt: skip
    def add(self, kind: Any, count: int, policy: Any, awareness: Any, reach: float, speed: float) -> None:
        if sum(map(len, self.worlds[0].groups)) < 20:
            self.both(
                lambda world: world.add(
                    kind, count, policy=policy, awareness=awareness, sensing_range=reach, awareness_range=reach, speed=speed
                )
            )

    @rule(
        name=st.sampled_from(
            ["agent_class", "count", "policy", "awareness", "sensing_range", "awareness_range", "speed", "turn_limit",
             "placement", "name"]
        ),
        value=nonsense,
    )  # fmt: skip
    def add_nonsense(self, name: str, value: Any) -> None:
        def deed(world: World) -> None:
            given = {"agent_class": Robot, "count": 2, "policy": "random-walk"} | {name: value}
            if name == "name":
                # Any object may be a group's name, if nothing else is wrong; so give what is refused.
                given["speed"] = -1
            elif name == "count" and value is True:
                return
            before = len(world.groups)
            group = world.add(given.pop("agent_class"), given.pop("count"), **given)
            assert len(world.groups) == before + 1
            for agent in list(group):
                agent.remove()

        self.both(deed)

    @rule(data=st.data(), name=st.sampled_from(["speed", "sensing_range", "awareness_range", "turn_limit"]), value=lengths)
    def set_of_group(self, data: st.DataObject, name: str, value: float) -> None:
        if number := self._group(data):
            self.both(lambda world: setattr(world.groups[number - 1], name, value))

    @rule(data=st.data(), policy=st.sampled_from(POLICIES), awareness=st.sampled_from([None, *AWARENESS]))
    def adjust(self, data: st.DataObject, policy: Any, awareness: Any) -> None:
        if number := self._group(data):
            self.both(lambda world: world.adjust(world.groups[number - 1], policy=policy, awareness=awareness))

    @rule(
        data=st.data(),
        name=st.sampled_from(
            ["speed", "sensing_range", "awareness_range", "turn_limit", "policy", "awareness", "position", "heading", "pos",
             "percept", "neighbours", "battery", "active"]
        ),
        value=st.one_of(nonsense, lengths),
    )  # fmt: skip
    def set_of_agent(self, data: st.DataObject, name: str, value: Any) -> None:
        if agent := self._agent(data):
            number, row = agent

            def deed(world: World) -> None:
                robot = world.groups[number][row]
                if name == "battery" and name not in robot.group.columns:
                    return
                setattr(robot, name, value)

            self.both(deed)

    @rule(
        data=st.data(), name=st.sampled_from(["speed", "sensing_range", "policy", "awareness", "turn_limit"]), value=nonsense
    )
    def adjust_nonsense(self, data: st.DataObject, name: str, value: Any) -> None:
        if (number := self._group(data)) and not callable(value):
            self.both(lambda world: world.adjust(world.groups[number - 1], **{name: value}))

    @rule(data=st.data())
    def senses(self, data: st.DataObject) -> None:
        one, other = self._group(data), self._group(data)
        if one and other:
            self.both(lambda world: world.senses(world.groups[one - 1], world.groups[other - 1]))

    @rule(data=st.data())
    def remove(self, data: st.DataObject) -> None:
        if agent := self._agent(data):
            number, row = agent
            self.both(lambda world: world.groups[number][row].remove())

    @rule(data=st.data(), x=st.floats(-3, 3), y=st.floats(-3, 3))
    def place(self, data: st.DataObject, x: float, y: float) -> None:
        if agent := self._agent(data):
            number, row = agent
            self.both(lambda world: setattr(world.groups[number][row], "position", (x, y)))

    @rule(data=st.data(), fill=st.one_of(nonsense, st.sampled_from([0, 0.5, "a"])), name=st.sampled_from(["battery", "speed", "", 3]))
    def column(self, data: st.DataObject, fill: Any, name: Any) -> None:
        if (number := self._group(data)) and not isinstance(fill, type) and not callable(fill) and type(fill) is not object:
            self.both(lambda world: world.groups[number - 1].add_column(name, fill))

    @rule()
    def save(self) -> None:
        states = [pickle.dumps(world.state(pending="drop")) for world in self.worlds]
        self.saved = states[0]

    @rule()
    def restore(self) -> None:
        self.both(lambda world: world.restore(pickle.loads(self.saved)))

    @rule(seed=st.one_of(st.none(), st.integers(0, 9), nonsense))
    def reset(self, seed: Any) -> None:
        if seed is not None or self.worlds[0].seed_used == self.worlds[1].seed_used:
            self.both(lambda world: world.reset(seed))

    @rule(delay=st.sampled_from([0, 0.5, 2, 3.25]), deed=st.sampled_from(["stop", "fail", "speed", "nothing"]))
    def plan(self, delay: float, deed: str) -> None:
        def event(world: World) -> None:
            if deed == "stop":
                world.running = False
            elif deed == "fail":
                raise ValueError("an event")
            elif deed == "speed" and world.groups and len(world.groups[0]):
                world.groups[0][0].speed = 0.01

        self.both(lambda world: world.clock.at(world.clock.now + delay, lambda: event(world)))

    @rule(time=nonsense, action=nonsense)
    def plan_nonsense(self, time: Any, action: Any) -> None:
        self.both(lambda world: world.clock.at(time, None if callable(action) else action))
        self.both(lambda world: world.clock.process(action))

    @rule(steps=st.sampled_from([None, True, "fast", -1, 1.5, math.nan, math.inf, 1j, b"x", [], [1.0], np.zeros(2), object()]))
    def run_nonsense(self, steps: Any) -> None:
        self.both(lambda world: world.run(steps))

    @rule(steps=st.integers(1, 6))
    def advance(self, steps: int) -> None:
        run, stepped = self.worlds
        ends = []
        for advance in (lambda: run.run(steps), lambda: [stepped.step() for _ in range(steps) if stepped.running]):
            try:
                advance()
                ends.append("")
            except ValueError as error:
                ends.append(str(error))
        assert ends[0] == ends[1]
        for world in self.worlds:
            world.running = True

    @invariant()
    def alike(self) -> None:
        if not hasattr(self, "worlds"):
            return
        run, stepped = self.worlds
        # What does not fit together, such as inputs of a learner and a degree of awareness, is said whenever asked.
        try:
            one = facts(run)
        except ValueError as error:
            assert "\n" not in str(error)
            with pytest.raises(ValueError, match=".") as caught:
                facts(stepped)
            assert str(caught.value) == str(error)
            return
        assert one == facts(stepped)
        assert run.tick == run.steps == run.clock.now == len(run.recording.history)
        for group in run.groups:
            assert np.isfinite(group.position).all()
            assert run.arena.contains(group.position).all()
            assert len(group) == len(group.agents) == len(group.bodies)
            assert [agent.row for agent in group] == list(range(len(group)))

    def _group(self, data: st.DataObject) -> int:
        """Return a number from 1, or 0 when there is no group."""
        count = len(self.worlds[0].groups)
        return data.draw(st.integers(1, count)) if count else 0

    def _agent(self, data: st.DataObject) -> tuple[int, int] | None:
        places = [(g, row) for g, group in enumerate(self.worlds[0].groups) for row in range(len(group))]
        return data.draw(st.sampled_from(places)) if places else None

    def teardown(self) -> None:
        for world in getattr(self, "worlds", []):
            world.close()


TestInterface = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")(Interface.TestCase)
TestInterface.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, suppress_health_check=list(HealthCheck)
)
