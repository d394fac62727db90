"""Mistakes in interactions: each names the interaction, the agent or the attribute, and the cure."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from interactions import Capture, fingerprint, hunt

from teamsight import Box, Circle, Disc, Interaction, Polygon, Robot, World
from teamsight.core.kernel import kernel
from teamsight.world import InteractionState


@kernel
def _spoil(bodies: Any, state: Any, parameters: Any, noise: Any, scores: Any, turn: int) -> None:
    robots = bodies.robots
    state.floats[0, 0] += 1.0
    robots.load[0] += 1
    robots.reward[2] = 1.0
    robots.speed[1] *= 0.5
    what = parameters[0]
    if state.floats[0, 0] < parameters[2]:
        return
    if what == 0.0:
        robots.position[1, 0] = parameters[1]
    elif what == 1.0:
        robots.heading[1, 0] = parameters[1]
    elif what == 2.0:
        robots.speed[1] = parameters[1]
    elif what == 3.0:
        robots.reward[1] = parameters[1]
    elif what == 4.0:
        scores[1] = parameters[1]
    elif what == 5.0:
        robots.position[0, 0] = 0.0
        raise ValueError("spoiled")


@dataclass(frozen=True)
class Spoil(Interaction):
    """Writes something wrong in the tenth step."""

    roles = ("robots",)
    scores = ("good", "bad")
    columns = (("robots", "load", 0),)
    what: float = 0.0
    value: float = 99.0
    first: float = 10.0
    kernel = _spoil

    @property
    def parameters(self) -> tuple[float, ...]:
        return self.what, self.value, self.first

    def start(self, sizes: Any) -> InteractionState:
        return InteractionState(np.zeros((1, 1)), np.zeros((0, 0), np.int64))


def spoiled(interaction: Interaction, arena: Any = None) -> World:
    world = World(arena or Disc(3.0), rng=1)
    robots = world.add(Robot, 4, policy="random-walk", speed=0.1)
    world.senses(robots, robots)
    world.interact(interaction, robots=robots)
    return world


WRONG = [
    (0.0, 99.0, r"robots.*\(99, .*outside Disc"), (0.0, np.nan, r"\(nan, .*outside"),
    (1.0, 3.0, r"heading \(3, .*unit vectors"), (2.0, -1.0, r"speed -1; .*at least 0"),
    (2.0, np.inf, r"speed inf"), (3.0, np.nan, r"reward nan; .*finite"), (4.0, np.inf, r"score 'bad' is inf"),
]  # fmt: skip


@pytest.mark.parametrize(("what", "value", "error"), WRONG, ids=str)
def test_what_a_kernel_leaves_wrong_is_named_and_undone(what: float, value: float, error: str) -> None:
    world = spoiled(Spoil())
    # NaN is refused as a constant.
    world._data.interactions[0].parameters[:] = what, value, 10.0
    reference = spoiled(Spoil())
    reference.run(9)
    with pytest.raises(ValueError, match=error) as raised:
        world.run(20)
    assert "Spoil" in str(raised.value)
    assert "check_interaction()" in str(raised.value)
    assert world.tick == 9
    assert fingerprint(world) == fingerprint(reference)
    with pytest.raises(ValueError, match=error):
        world.step()
    assert fingerprint(world) == fingerprint(reference)
    world.reset()
    world.run(9)
    assert fingerprint(world) == fingerprint(reference)


@pytest.mark.parametrize("path", ["run", "step"])
def test_a_kernel_that_raises_stops_the_run_and_the_step_is_undone(path: str, monkeypatch: Any) -> None:
    printed: list[Any] = []
    monkeypatch.setattr(sys, "unraisablehook", printed.append)
    world, reference = spoiled(Spoil(5.0)), spoiled(Spoil(5.0))
    reference.run(9)
    with pytest.raises(ValueError, match=r"Spoil: its kernel raised an exception at tick 9, .*check_interaction\(\)"):
        for _ in range(20):
            world.run(20) if path == "run" else world.step()
    assert str(printed[0].exc_value) == "spoiled"
    assert world.tick == 9
    assert fingerprint(world) == fingerprint(reference)


def test_an_error_names_the_agent() -> None:
    world = spoiled(Spoil(0.0, 99.0))
    with pytest.raises(ValueError, match=rf"<Robot {world.groups[0][1].unique_id} of 'robots'> at tick 9 at \(99, "):
        world.run(20)


@pytest.mark.parametrize(
    ("arena", "x"),
    [
        (Box(6, 6), 3.1), (Box(6, 6).with_obstacles(Circle((2.0, 0.0), 0.9)), None),
        (Polygon([(-3, -3), (3, -3), (3, 3), (0, 2.9), (-3, 3)]), -3.01),
    ],
    ids=str,
)  # fmt: skip
def test_places_outside_of_any_arena_are_refused(arena: Any, x: float | None) -> None:
    if x is None:
        world = spoiled(Spoil(0.0, 2.0), arena)
        world.groups[0][1].position = (-2.0, 0.0)
        world.groups[0].speed = 0.001
    else:
        world = spoiled(Spoil(0.0, x), arena)
    with pytest.raises(ValueError, match="outside"):
        world.run(20)
    assert world.tick == 9


class NoKernel(Interaction):
    roles = ("robots",)


class NoRoles(Interaction):
    kernel = _spoil


def declaring(**attributes: Any) -> Interaction:
    made: Interaction = type("Odd", (Spoil,), attributes)()
    return made


DECLARATIONS = [
    (Capture, TypeError, r"Capture: is a class; give an object, such as Capture\(\)"),
    ("capture", TypeError, "'capture'.*subclass of Interaction"),
    (NoKernel(), TypeError, "NoKernel: has no 'kernel'"),
    (NoRoles(), ValueError, r"NoRoles.roles=\(\): must name"),
    (declaring(roles="robots"), TypeError, r"roles='robots'.*\('robots',\)"),
    (declaring(roles=("robots", "class")), ValueError, "'class' cannot be"),
    (declaring(roles=("robots", "robots")), ValueError, "'robots' is there twice"),
    (declaring(scores=("a b",)), ValueError, "'a b' cannot be"),
    (declaring(draws=-1), ValueError, "draws=-1"),
    (declaring(in_turn=1), TypeError, "in_turn=1"),
    (declaring(columns=("load",)), TypeError, "must be tuples of role, name and value"),
    (declaring(columns=(("prey", "load", 0),)), ValueError, "'prey'.*robots"),
    (declaring(columns=(("robots", "speed", 0),)), ValueError, "bodies.robots.speed; take another"),
    (declaring(columns=(("robots", "load", "x"),)), TypeError, "load='x': must begin as a finite number"),
    (declaring(columns=(("robots", "load", np.float32(0.5)),)), TypeError, "float32; columns are float64, .*0.5"),
    (declaring(columns=(("robots", "load", np.int8(3)),)), TypeError, "int8; columns are float64, int64 or bool.*3"),
    (declaring(columns=(("robots", "load", 2**70),)), TypeError, "object; columns are float64, int64 or bool"),
    (declaring(columns=(("robots", "remove", 0),)), ValueError, "agents of 'robots' have the attribute 'remove'"),
    (declaring(scores=("observed",)), ValueError, "'observed' is already a column"),
    (declaring(start=lambda self, sizes: None), TypeError, "Odd.start: returned NoneType"),
    (declaring(start=lambda self, sizes: InteractionState(np.zeros(3), np.zeros((0, 0), np.int64))), ValueError,
     r"floats have the shape \(3,\)"),
    (declaring(start=lambda self, sizes: InteractionState(np.zeros((1, 1)), np.zeros((1, 1)))), TypeError,
     "ints have the type float64"),
    (declaring(parameters=(np.nan,)), ValueError, r"parameters=.*nan.*: must be finite"),
    (declaring(parameters="x"), TypeError, "parameters='x': must be finite numbers"),
]  # fmt: skip


@pytest.mark.parametrize(("interaction", "kind", "error"), DECLARATIONS, ids=lambda value: str(value)[:40])
def test_wrong_declarations_are_refused(interaction: Any, kind: type[Exception], error: str) -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 4, policy="random-walk")
    with pytest.raises(kind, match=error):
        world.interact(interaction, robots=robots)
    assert not world.interactions
    assert not robots.columns


def test_wrong_groups_are_refused() -> None:
    world, other = hunt(), hunt()
    hunters, prey = world.groups
    for groups, kind, error in (
        ({"hunters": hunters}, TypeError, r"no group for the role 'prey'.*interact\(Capture\(\), hunters=…, prey=…\)"),
        ({"hunters": hunters, "prey": prey, "dogs": prey}, TypeError, "no role 'dogs', but 'hunters', 'prey'"),
        ({"hunters": hunters, "prey": hunters}, ValueError, "'hunters' has the roles 'hunters' and 'prey'"),
        ({"hunters": hunters, "prey": other.groups[1]}, ValueError, "prey=.*added to this world"),
        ({"hunters": hunters, "prey": prey.agents}, TypeError, "prey=.*give a group"),
        ({"hunters": hunters, "prey": prey}, ValueError, "Capture: is already between hunters, prey"),
    ):
        with pytest.raises(kind, match=error):
            world.interact(Capture(reach=0.1), **groups)  # type: ignore[arg-type]
    more = world.add(Robot, 1, policy="random-walk", name="more")
    with pytest.raises(ValueError, match="'captures' is already a column.*another name"):
        world.interact(Capture(), hunters=more, prey=prey)
    assert world.interactions == (Capture(),)


def test_a_column_of_another_type_is_refused() -> None:
    world = World(Disc(3.0), rng=1)
    robots = world.add(Robot, 4, policy="random-walk")
    robots.add_column("load", 0.5)
    with pytest.raises(ValueError, match=r"robots have a column 'load' of float64.*add_column\('load', 0\)"):
        world.interact(Spoil(), robots=robots)


def test_a_column_that_an_interaction_keeps_stays() -> None:
    world = spoiled(Spoil())
    robots = world.groups[0]
    robots.add_column("mine", 0.0)
    with pytest.raises(ValueError, match="load: is kept by the interaction Spoil, .*build the world without it"):
        del robots.columns["load"]
    del robots.columns["mine"]
    assert list(robots.columns) == ["load"]


def test_an_interaction_is_not_declared_by_a_policy() -> None:
    world = World(Disc(3.0), rng=1)

    def rule(percept: Any, rng: Any) -> tuple[float, float]:
        world.interact(Spoil(), robots=world.groups[0])
        return 0.0, 0.0

    world.add(Robot, 1, policy=rule)
    with pytest.raises(RuntimeError, match=r"interact\(\)"):
        world.step()
