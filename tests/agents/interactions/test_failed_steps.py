"""A step that fails changes nothing: neither what robots have learned, nor what they show, nor what is recorded."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from interactions import fingerprint, hunt

from teamsight import Cycle, Interaction, Sensor, World
from teamsight.core.kernel import kernel
from teamsight.policies import PreyQ
from teamsight.tasks.foraging import Forage
from teamsight.tasks.pursuit import Pursuit
from teamsight.world import InteractionState

FAILS_AT = 30


@kernel
def _trip(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.ints[0, 0] += 1
    if state.ints[0, 0] > parameters[0]:
        bodies.robots.position[0, 0] = 1e9


@dataclass(frozen=True)
class Trip(Interaction):
    """Moves a robot out of the arena, in the step after so many."""

    roles = ("robots",)
    after: float = 1e9
    kernel = _trip

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.zeros((1, 1), np.int64))


class Remembering:
    """A policy in Python for one robot that keeps account of what it sees."""

    def __init__(self) -> None:
        self.seen = 0

    def __call__(self, percept: Any, rng: np.random.Generator) -> tuple[float, float]:
        return float(rng.normal()), 0.1


def _online() -> World:
    return Pursuit(3, 1, 7, depth=2, policy=PreyQ(depth=2), rng=3)


def _recorded() -> World:
    world = hunt(awareness="ring")
    world.recording.record_transitions(world.groups[0])
    world.recording.record_positions(5)
    return world


WORLDS = {
    "schemas": lambda: Forage(5, rng=2, side=32.0),
    "online learner": _online,
    "recorded": _recorded,
    "cycles": lambda: hunt(cycle=Cycle(3, phase=[0, 1, 2, 0, 1, 2], jitter=0.5, delay=2)),
    "delayed sensor": lambda: hunt(sensing_delay=2),
    "in Python": lambda: hunt(policy=Remembering()),
}


def _build(name: str, after: float = 1e9) -> Any:
    world: Any = hunt() if name == "delayed sensor" else WORLDS[name]()
    if name == "delayed sensor":
        world.groups[0].sensors["targets"] = Sensor(delay=2)
    world.interact(Trip(after), robots=_robots_of(world))
    return world


def _robots_of(world: Any) -> Any:
    return next(one for one in world.groups if one.name in ("robots", "hunters"))


def _mend(world: Any) -> None:
    """Take away what makes steps fail, as if the kernel had been mended."""
    world._data.interactions[-1].parameters[:] = 1e9


def _all(world: Any) -> list[bytes]:
    """Return all that changes in a run, as bytes."""
    found = fingerprint(world)
    for group in world.groups:
        table = () if group.timetable is None else vars(group.timetable)
        for part in (group.states, group.action, table, [vars(one) for one in group.readings.values()]):
            found += [array.tobytes() for array in _arrays(part)]
    if world._engine.transitions.groups:
        kept = world.recording.transitions(world._engine.transitions.groups[0])
        found += [array.tobytes() for array in _arrays(tuple(kept))]
        found.append(world.recording.trajectory.select_dtypes("number").to_numpy().tobytes())
    return found


def _arrays(value: Any) -> list[Any]:
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, dict):
        return [one for key in sorted(value, key=str) for one in _arrays(value[key])]
    if isinstance(value, (list, tuple)):
        return [one for part in value for one in _arrays(part)]
    if hasattr(value, "__dict__"):
        return _arrays(vars(value))
    return []


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", WORLDS)
@pytest.mark.parametrize("path", ["run", "step"])
def test_a_run_goes_on_as_if_no_step_had_failed(name: str, path: str) -> None:
    world, fine = _build(name, FAILS_AT), _build(name)
    fine.run(FAILS_AT)
    with pytest.raises(ValueError, match="outside"):
        for _ in range(FAILS_AT + 1):
            world.run(FAILS_AT + 1) if path == "run" else world.step()
    assert world.tick == FAILS_AT
    with pytest.raises(ValueError, match="outside"):
        world.step()
    _mend(world)
    world.run(40)
    fine.run(40)
    assert _all(world) == _all(fine)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", [name for name in WORLDS if name != "recorded"])
def test_a_state_saved_after_a_failed_step_goes_on_alike(name: str) -> None:
    world, fine, other = _build(name, FAILS_AT), _build(name), _build(name, FAILS_AT)
    fine.run(FAILS_AT + 40)
    with pytest.raises(ValueError, match="outside"):
        world.run(FAILS_AT + 1)
    saved = pickle.loads(pickle.dumps(world.state()))
    other.restore(saved)
    _mend(other)
    other.run(40)
    assert _all(other) == _all(fine)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("change", ["leaves", "comes"])
@pytest.mark.parametrize("name", [name for name in WORLDS if name != "cycles"])
def test_nothing_is_learned_twice_if_an_agent_comes_or_leaves_after_a_failed_step(name: str, change: str) -> None:
    world, fine = _build(name, FAILS_AT), _build(name)
    fine.run(FAILS_AT)
    with pytest.raises(ValueError, match="outside"):
        world.run(FAILS_AT + 1)
    _mend(world)
    for one in (world, fine):
        group = _robots_of(one)
        if change == "leaves":
            group[-1].remove()
        else:
            group.add(1, speed=0.1)
        one.run(1)
    # The others have learned what they had decided to learn.
    kept = len(_robots_of(fine)) - (change == "comes")
    for a, b in zip(_arrays(_robots_of(world).states), _arrays(_robots_of(fine).states), strict=True):
        assert a[:kept].tobytes() == b[:kept].tobytes()


@pytest.mark.parametrize("steps", [1, 2])
def test_nothing_is_learned_twice_if_one_robot_gets_a_policy_after_a_failed_step(steps: int) -> None:
    world, fine = _build("online learner", FAILS_AT), _build("online learner")
    fine.run(FAILS_AT)
    with pytest.raises(ValueError, match="outside"):
        world.run(FAILS_AT + 1)
    _mend(world)
    for one in (world, fine):
        one.hunters[0].policy = "lattice-walk"
        one.run(steps)
    assert world.hunters.policy_state.floats[1:].tobytes() == fine.hunters.policy_state.floats[1:].tobytes()


def _leave_out_one(world: Any) -> None:
    world.hunters[0].active = False


def _slow_all(world: Any) -> None:
    world.hunters.cycle = Cycle(2)


def _slow_one(world: Any) -> None:
    world.hunters[0].cycle = Cycle(2)


@pytest.mark.parametrize("change", [_leave_out_one, _slow_all, _slow_one])
@pytest.mark.parametrize("steps", [2, 20])
def test_nothing_is_rewarded_twice_if_robots_get_a_timetable_after_a_failed_step(change: Any, steps: int) -> None:
    world, fine = _build("online learner", FAILS_AT), _build("online learner")
    fine.run(FAILS_AT)
    with pytest.raises(ValueError, match="outside"):
        world.run(FAILS_AT + 1)
    _mend(world)
    for one in (world, fine):
        change(one)
        one.run(steps)
    others = slice(1, None)
    assert world.hunters.policy_state.floats[others].tobytes() == fine.hunters.policy_state.floats[others].tobytes()
    assert world.hunters.decided_at[others].tolist() == fine.hunters.decided_at[others].tolist()
    if change is not _leave_out_one:
        assert _all(world) == _all(fine)
