"""Constants of interactions that are changed in a run: the same in all paths, and back again by reset and restore."""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest
from interactions import Capture, fingerprint, hunt

from teamsight import Interaction, Robot, Torus, World
from teamsight.agents.reused_worlds import ReusedWorlds
from teamsight.core.kernel import kernel
from teamsight.tasks.pursuit import Pursuit
from teamsight.world import InteractionState

pytestmark = pytest.mark.short

FIRST, THEN = Capture(reach=0.2), Capture(reach=0.6)


def test_interact_returns_its_object() -> None:
    world = hunt(FIRST)
    late = world.add(Robot, 2, policy="random-walk", name="late")
    second = Renamed(0.3)
    assert world.interact(second, hunters=late, prey=world.groups[1]) is second
    assert world.interactions == (FIRST, second)


class Renamed(Capture):
    """Beside `Capture` in one world: columns and scores have one keeper."""

    scores = ("seconds",)
    columns = (("prey", "taken", 0),)


def test_a_changed_constant_takes_effect_from_the_next_step_on_in_both_paths() -> None:
    at_once, one_by_one, planned, unchanged = (hunt(FIRST) for _ in range(4))
    planned.clock.at(40, partial(planned.adjust, FIRST, reach=0.6))
    planned.run(100)
    for world in (at_once, one_by_one):
        world.run(40)
        world.adjust(FIRST, reach=0.6)
    at_once.run(60)
    for _ in range(60):
        one_by_one.step()
    unchanged.run(100)
    assert at_once.interactions == (THEN,)
    assert fingerprint(at_once) == fingerprint(one_by_one) == fingerprint(planned)
    captures, others = (one.recording.history["captures"].to_numpy() for one in (at_once, unchanged))
    assert captures[:40].tolist() == others[:40].tolist()
    assert captures[40] > others[40], "the next step has it"


def test_a_constant_changed_before_the_first_step_is_as_if_it_had_been_declared() -> None:
    world, declared = hunt(FIRST), hunt(THEN)
    world.adjust(FIRST, reach=9.0)
    # The object that was given, and the present one.
    world.adjust(FIRST, reach=0.3, side=5.0)
    world.adjust(world.interactions[0], reach=0.6)
    world.adjust(FIRST, side=6.0)
    world.adjust(FIRST)
    for one in (world, declared):
        one.run(60)
    assert fingerprint(world) == fingerprint(declared)


def test_restore_and_reset_go_back() -> None:
    world = hunt(FIRST)
    world.run(20)
    early = world.state()
    world.adjust(FIRST, reach=0.6)
    world.run(20)
    late = pickle.loads(pickle.dumps(world.state()))
    world.run(30)
    end = fingerprint(world)
    # Here, and in a world in which nothing was changed.
    for other in (world, hunt(FIRST)):
        other.restore(late)
        assert other.interactions == (THEN,)
        other.run(30)
        assert fingerprint(other) == end
    world.restore(early)
    assert world.interactions == (FIRST,)
    plain = hunt(FIRST)
    plain.run(50)
    world.run(30)
    assert fingerprint(world) == fingerprint(plain)
    world.restore(late)
    world.reset()
    assert world.interactions == (FIRST,)
    plain.reset()
    for one in (world, plain):
        one.run(30)
    assert fingerprint(world) == fingerprint(plain)
    # A world that was declared otherwise is another one, as before.
    with pytest.raises(ValueError, match=r"restore.*interactions Capture of hunters and prey \(0.2, 6.0\)"):
        hunt(THEN).restore(late)


def test_a_reused_world_begins_with_what_was_declared() -> None:
    worlds, found = ReusedWorlds(), []
    for _ in range(2):
        world = worlds.begin(Pursuit, {"hunters": 2, "prey": 2}, 1)
        world.adjust(world.interactions[0], cost=0.5)
        world.run(5)
        found.append((id(world), world.interactions, world._data.interactions[0].parameters.tolist(), fingerprint(world)))
        world.adjust(world.interactions[0], cost=0.7)
    assert found[0] == found[1]
    assert world.interactions[0].cost == 0.7  # type: ignore[attr-defined]


@dataclass(frozen=True)
class Counted(Capture):
    """Fields that are more than constants."""

    draws: int = 2
    begun: int = 0

    @property
    def parameters(self) -> tuple[float, ...]:
        return (self.reach, self.side)

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((0, 0)), np.full((1, 1), self.begun))


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"raech": 1.0}, TypeError, "raech=1.0: unknown; did you mean 'reach'.*Counted has reach, side, draws, begun"),
        ({"speed": 1.0}, TypeError, "speed=1.0: unknown; .*Counted has reach"),
        ({"reach": "far"}, TypeError, "Counted.parameters=.*: must be finite numbers"),
        ({"reach": float("nan")}, ValueError, "must be finite numbers"),
        ({"draws": 3}, ValueError, "Counted.draws: cannot change in a run; build another world"),
        ({"side": 5.0, "begun": 4}, ValueError, r"Counted.start: .* cannot change; build another world"),
    ],
)  # fmt: skip
def test_what_cannot_be_changed_is_refused_and_changes_nothing(
    changes: dict[str, Any], error: type[Exception], words: str
) -> None:
    rule = Counted()
    world = hunt(rule)
    world.adjust(rule, reach=0.6)
    with pytest.raises(error, match=words):
        world.adjust(rule, side=3.0, **changes) if "side" not in changes else world.adjust(rule, **changes)
    assert world.interactions == (Counted(reach=0.6),)
    assert world._data.interactions[0].parameters.tolist() == [0.6, 6.0]


def test_what_is_not_in_the_world_is_refused() -> None:
    world, grid = hunt(FIRST), Pursuit(rng=1)
    for wrong in ({"rule": "pair"}, {"width": 3}, {"torus": True}, {"cost": "dear"}):
        with pytest.raises((TypeError, ValueError), match="|".join(wrong) + "|in_turn|Torus|grid"):
            grid.adjust(grid.interactions[0], **wrong)
    with pytest.raises(ValueError, match=r"adjust\(Capture\): is not in this world now; give one of world.interactions"):
        world.adjust(Capture(reach=0.2), reach=1.0)
    world.adjust(FIRST, reach=0.5)
    old = world.interactions[0]
    world.adjust(FIRST, reach=0.6)
    with pytest.raises(ValueError, match="is not in this world now"):
        world.adjust(old, reach=1.0)
    with pytest.raises(ValueError, match=r"adjust\(<class .*Capture.*must be a group or an interaction of this world"):
        world.adjust(Capture, reach=1.0)  # type: ignore[call-overload]
    with pytest.raises(TypeError, match=r"adjust\(\): sped=0.2: unknown; did you mean 'speed'"):
        world.adjust(world.groups[0], sped=0.2)
    with pytest.raises(AttributeError, match=r"adjust\(\) changes one"):
        world.interactions = ()  # type: ignore[misc]


class Plain(Interaction):
    """Has no fields."""

    roles = ("robots",)

    @staticmethod
    @kernel
    def kernel(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
        bodies.robots.reward[:] = 1.0


def test_an_interaction_without_fields_is_saved_and_cannot_be_changed() -> None:
    world = World(Torus(6.0, 6.0), rng=1)
    plain = world.interact(Plain(), robots=world.add(Robot, 2, policy="random-walk"))
    world.restore(world.state())
    with pytest.raises(TypeError, match=r"adjust\(Plain\): has no fields to change; make it a dataclass"):
        world.adjust(plain, reach=1.0)


def test_an_agent_that_fails_takes_its_changes_back() -> None:
    world = hunt(FIRST)

    class Failing(Robot):
        def __init__(self, model: Any) -> None:
            super().__init__(model)
            model.adjust(FIRST, reach=0.6)
            raise RuntimeError("broken")

    with pytest.raises(RuntimeError, match="broken"):
        world.add(Failing, 1, policy="random-walk")
    plain = hunt(FIRST)
    for one in (world, plain):
        one.run(30)
    assert world.interactions == (FIRST,)
    assert fingerprint(world) == fingerprint(plain)
