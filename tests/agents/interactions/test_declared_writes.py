"""What an interaction declares that it writes is checked and undone; what it does not declare, it cannot write."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from interactions import Capture, CaptureInTurn, fingerprint, hunt

from teamsight import Disc, Interaction, Robot, Target, World, check_interaction
from teamsight.core.kernel import kernel
from teamsight.world import InteractionState
from teamsight.world.interaction import WRITABLE


@kernel
def _position(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.floats[0, 0] += 1.0
    bodies.robots.position[0, 0] *= math.nan if state.floats[0, 0] >= parameters[0] else 0.5


@kernel
def _heading(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.floats[0, 0] += 1.0
    bodies.robots.heading[0, 0] *= 3.0 if state.floats[0, 0] >= parameters[0] else -1.0


@kernel
def _speed(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.floats[0, 0] += 1.0
    bodies.robots.speed[0] *= -1.0 if state.floats[0, 0] >= parameters[0] else 0.9


@kernel
def _reward(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.floats[0, 0] += 1.0
    bodies.robots.reward[0] += math.inf if state.floats[0, 0] >= parameters[0] else 1.5


@kernel
def _ended(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.floats[0, 0] += 1.0
    bodies.robots.ended[0] = state.floats[0, 0] < parameters[0]


@kernel
def _before(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    bodies.robots.before[0, 0] = 0.0


@kernel
def _score(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    state.floats[0, 0] += 1.0
    scores[0] += math.inf if state.floats[0, 0] >= parameters[0] else 1.0


@dataclass(frozen=True)
class Late(Interaction):
    """Writes one thing in each step, and something wrong from step `first` on."""

    roles = ("robots",)
    first: float = 1e9

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((1, 1)), np.zeros((0, 0), np.int64))


KERNELS: dict[str, Any] = {
    "position": _position, "heading": _heading, "speed": _speed, "reward": _reward, "ended": _ended, "": _score,
}  # fmt: skip


def late(name: str, *writes: str, in_turn: bool = False) -> type[Late]:
    """Return a class whose kernel writes what has this name, by default declared."""
    return declaring(Late, *writes, kernel=(KERNELS | {"before": _before})[name], scores=() if name else ("score",), in_turn=in_turn)


def declaring(base: Any, *writes: str, **more: Any) -> Any:
    # By its name it draws the same random numbers.
    names = {"__module__": base.__module__, "__qualname__": base.__qualname__}
    return type(base.__name__, (base,), {"writes": writes, **names, **more})


def world_of(interaction: Interaction) -> World:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 4, policy="random-walk", speed=0.1)
    world.senses(robots, world.add(Target, 3, policy="random-walk"))
    world.interact(interaction, robots=robots)
    return world


@pytest.mark.parametrize("in_turn", [False, True])
@pytest.mark.parametrize("name", KERNELS)
def test_it_does_what_it_does_if_all_is_declared(name: str, in_turn: bool) -> None:
    one = world_of(late(name, *[name] * bool(name), in_turn=in_turn)())
    other = world_of(late(name, *WRITABLE, in_turn=in_turn)())
    for world in (one, other):
        world.run(7)
        world.step()
        world.groups[0].add(1, speed=0.1)
        world.run(5)
        before = world.groups[0].position.copy()
        world.run(1)
        assert np.array_equal(world.groups[0].bodies.moved, world.groups[0].position - before)
    assert fingerprint(one) == fingerprint(other)


@pytest.mark.parametrize("base", [Capture, CaptureInTurn])
def test_a_capture_does_not_turn_the_bodies(base: Any) -> None:
    one, other = (hunt(declaring(base, *writes)()) for writes in (("position", "speed", "reward", "ended"), WRITABLE))
    for world in (one, other):
        world.run(60)
    assert one.recording.history["captures"].sum() > 0
    assert fingerprint(one) == fingerprint(other)


@pytest.mark.parametrize(
    ("name", "error"),
    [
        ("position", "outside Disc"), ("heading", "unit vectors"), ("speed", "at least 0"), ("reward", "finite"),
        ("", "'score' is inf"),
    ],
)  # fmt: skip
def test_what_is_declared_is_checked_and_undone(name: str, error: str) -> None:
    kind = late(name, *[name] * bool(name))
    world, reference = world_of(kind(first=10.0)), world_of(kind(first=10.0))
    reference.run(9)
    for _ in range(2):
        with pytest.raises(ValueError, match=f"Late: .*{error}"):
            world.run(20)
        assert world.tick == 9
        assert fingerprint(world) == fingerprint(reference)


@pytest.mark.parametrize("name", [*WRITABLE, "before"])
def test_what_is_not_declared_cannot_be_written(name: str) -> None:
    interaction = late(name, *(other for other in WRITABLE if other != name))()
    world = world_of(interaction)
    before = fingerprint(world)
    for call in (lambda: world.run(1), lambda: check_interaction(interaction)):
        with pytest.raises((TypeError, ValueError), match="read-only"):
            call()
    assert fingerprint(world) == before


@pytest.mark.parametrize(
    ("writes", "error", "message"),
    [
        ("reward", TypeError, r"Late.writes='reward': must be a tuple of names, such as \('reward',\)"),
        (("moved",), ValueError, r"Late.writes='moved': .*position"),
    ],
)  # fmt: skip
def test_wrong_declarations_are_refused(writes: Any, error: type[Exception], message: str) -> None:
    kind = declaring(Late, kernel=_reward)
    kind.writes = writes
    with pytest.raises(error, match=message):
        world_of(kind())
