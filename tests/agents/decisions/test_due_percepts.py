"""What the robots that are due perceive: the rows of what the whole group would perceive at that moment."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teamsight import CMOMMT, Cycle, Robot, Target, World
from teamsight.agents.awareness.registry import awareness_named
from teamsight.core.kernel import inlined
from teamsight.core.neighbour_list import NeighbourList
from teamsight.policies import CompiledPolicy, Policy, check_policy
from teamsight.policies.interface import Action, Percept
from teamsight.policies.percept_of_one import percept_of_rows

DEGREES = ("none", "ring", "nearest", "pairwise", "shared")


def copied(value: Any) -> Any:
    """Return a copy of a percept or a part of one."""
    return type(value)(*map(copied, value)) if isinstance(value, tuple) else value.copy()


def flat(value: Any) -> list[list[float]]:
    """Return all arrays of a percept."""
    return [array for part in value for array in flat(part)] if isinstance(value, tuple) else [value.ravel().tolist()]


class Recorder(Policy):
    """Keeps the percepts of its decisions, and walks at random."""

    draws = 1

    def __init__(self, inputs: int) -> None:
        self.inputs = inputs
        self.percepts: list[Percept] = []

    def decide(self, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
        self.percepts.append(copied(percept))
        angle = 2 * np.pi * noise[0]
        return Action(np.stack([np.cos(angle), np.sin(angle)], axis=-1), percept.speed), None


@pytest.mark.parametrize("awareness", DEGREES)
@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**32), robots=st.integers(2, 25), radius=st.floats(1.1, 4))
def test_robots_that_are_due_perceive_what_they_would_in_the_whole_group(
    awareness: str, seed: int, robots: int, radius: float
) -> None:
    inputs = sum(awareness_named(awareness).width(robots))
    own = [Recorder(inputs), Recorder(inputs)]
    cycle = Cycle(np.resize([1.0, 2.5, 4.0], robots), phase="random", jitter=0.5)
    world = CMOMMT(robots=robots, targets=9, radius=radius, policy=own[0], awareness=awareness, cycle=cycle, rng=seed)
    group = world.robots
    for row in range(0, robots, 3):
        group[row].policy = own[1]
    group[robots - 1].active = False
    for tick in range(7):
        assert isinstance(group[0].percept.time, float)
        whole = copied(group.percept)
        for policy in own:
            policy.percepts.clear()
        world.step()
        assert group.timetable is not None
        for index, policy in enumerate(own):
            rows = np.flatnonzero((group.decided_at == tick) & (group.timetable.policy == index))
            assert robots - 1 not in rows
            expected = percept_of_rows(whole, rows)
            assert [flat(one) for one in policy.percepts] == ([flat(expected)] if len(rows) else [])


@settings(max_examples=20, deadline=None)
@given(data=st.data(), degree=st.lists(st.integers(0, 4), min_size=1, max_size=8))
def test_rows_of_a_neighbour_list_are_those_taken_one_by_one(data: Any, degree: list[int]) -> None:
    start = np.append(0, np.cumsum(degree))
    k = int(start[-1])
    seen = NeighbourList(start, np.arange(k), np.arange(2.0 * k).reshape(k, 2), np.arange(k) + 0.5)
    empty = np.zeros(0)
    nothing = NeighbourList(np.zeros(len(degree) + 1, np.int64), np.zeros(0, np.int64), np.zeros((0, 2)), empty)
    column = np.arange(len(degree)).astype(float)
    percept = Percept(
        np.stack([column, column], axis=-1), np.stack([column, -column], axis=-1), column, column + 1, column + 2,
        seen, nothing, nothing, np.zeros((len(degree), 0), np.float32),
    )  # fmt: skip
    rows = np.array(sorted(data.draw(st.sets(st.integers(0, len(degree) - 1)))), np.int64)
    found = percept_of_rows(percept, rows)
    assert found.speed.tolist() == rows.tolist()
    assert len(found.targets.start) == len(rows) + 1
    for place, row in enumerate(rows):
        mine, theirs = (slice(*one) for one in (found.targets.start[place : place + 2], start[row : row + 2]))
        for new, old in zip(found.targets[1:], seen[1:], strict=True):
            assert (new[mine] == old[theirs]).all()


@inlined
def _turn_at(percept: Any, arrays: Any, noise: Any, action: Any) -> None:
    for i in range(percept.heading.shape[0]):
        late = percept.time[0] >= arrays.parameters[0]
        action.heading[i, 0] = 0.0 if late else 1.0
        action.heading[i, 1] = 1.0 if late else 0.0
        action.distance[i] = percept.speed[i]


class TurnAt(CompiledPolicy):
    """Goes to the right, and from a tick on upwards."""

    kernel = _turn_at

    @property
    def parameters(self) -> tuple[float, ...]:
        return (6.0,)


def test_kernels_and_functions_read_the_time() -> None:
    check_policy(TurnAt())
    world = CMOMMT(robots=3, policy=TurnAt(), rng=1, cycle=Cycle([1, 4, 5]))
    times: list[float] = []

    def rule(percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        times.append(percept.time)
        return 0.0, 0.0

    world.run(6)
    assert (world.robots.action.heading == (1, 0)).all()
    world.run(2)
    assert world.robots.action.heading.tolist() == [[0, 1], [1, 0], [1, 0]]
    world.run(3)
    assert (world.robots.action.heading == (0, 1)).all()
    world.targets.policy = rule
    world.run(2)
    assert times == [11.0] * 15 + [12.0] * 15


def test_channels_and_the_order_of_policies_are_kept() -> None:
    found: dict[str, list[int]] = {"a": [], "b": []}

    class Watcher(Recorder):
        channels = ("beacons",)

        def decide(self, percept: Percept, state: Any, noise: npt.NDArray[np.float64]) -> tuple[Action, Any]:
            found["a"] += percept.channels.beacons.degree.tolist()
            return super().decide(percept, state, noise)

    world = World(CMOMMT(rng=1)._data.arena, rng=1)
    robots = world.add(Robot, 3, policy="random-walk", position=[(0, 0), (1, 0), (3, 0)], cycle=Cycle([1, 2, 3]))
    beacons = world.add(Target, 2, policy="stationary", position=[(0.5, 0), (1.5, 0)])
    world.senses(robots, beacons, as_="beacons")
    robots[1].policy = Watcher(0)
    with pytest.raises(ValueError, match=r"reads the channel 'flares', in which 'robots' senses nothing"):
        robots[2].policy = type("Other", (Watcher,), {"channels": ("flares",)})(0)
    world.step()
    assert found["a"] == [2]
