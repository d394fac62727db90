"""A model's or an agent's own `step`: one that makes no step is refused, one that does nothing or is called twice says so."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import mesa
import numpy as np
import pytest

from teamsight import CMOMMT, Box, Robot, World

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")


class Shuffling(World):
    """mesa's commonest step, which moves no robot."""

    def __init__(self, rng: int | None = None, robot: type[Robot] = Robot, passes_on: bool = False) -> None:
        super().__init__(Box(10, 10), rng=rng)
        self.scouts = self.add(robot, 3, policy="random-walk")
        self.passes_on = passes_on

    def step(self) -> None:
        self.agents.shuffle_do("step")
        if self.passes_on:
            super().step()


class Scout(Robot):
    """A robot that counts its steps."""

    def __init__(self, model: World) -> None:
        super().__init__(model)
        self.steps = 0

    def step(self) -> None:
        super().step()
        self.steps += 1


ADVANCES: dict[str, Callable[[World], Any]] = {
    "step": lambda world: world.step(), "run": lambda world: world.run(5), "run_for": lambda world: world.run_for(5),
    "run_until": lambda world: world.run_until(5), "run_model": lambda world: world.run_model(),
}  # fmt: skip


@pytest.mark.short
@pytest.mark.parametrize("way", ADVANCES)
def test_a_step_that_makes_none_is_refused_again_and_again(way: str) -> None:
    world = Shuffling(rng=1)
    before = world.scouts.position.copy()
    for _ in range(2):
        with pytest.raises(TypeError, match=r"Shuffling\.step made no step: call super\(\)\.step\(\) in it"):
            ADVANCES[way](world)
        assert (world.tick, world.steps, world.clock.now) == (0, 0, 0)
    assert np.array_equal(world.scouts.position, before)
    world.passes_on = True
    world.run(4)
    assert (world.tick, world.steps) == (4, 4)


def test_a_batch_of_models_whose_step_makes_none_is_refused() -> None:
    with pytest.raises(TypeError, match=r"call super\(\)\.step\(\) in it"):
        mesa.batch_run(Shuffling, {}, max_steps=5, display_progress=False)


def test_a_step_may_stop_its_model_in_place_of_making_one() -> None:
    class Ending(World):
        def step(self) -> None:
            if self.tick == 3:
                self.running = False
            else:
                super().step()

    world = Ending(Box(4, 4), rng=1)
    world.add(Robot, 2, policy="random-walk")
    world.run_model()
    assert (world.tick, world.steps, world.running) == (3, 3, False)


@pytest.mark.parametrize("way", ["run", "run_for", "run_until"])
def test_more_steps_than_can_ever_be_made_are_refused(way: str) -> None:
    world = CMOMMT(robots=2, targets=2, rng=1)
    world.run(2)
    for steps in (1e308, 2**34 + 1):
        with pytest.raises(ValueError, match=r"steps=.*: must be at most 17179869182; noise repeats after 17,179,869,184 ticks.*running = False"):
            getattr(world, way)(steps)
    assert world.tick == 2
    world.clock.at(5, lambda: setattr(world, "running", False))
    world.run(2**34 - 2)
    assert world.tick == 5


@pytest.mark.short
@pytest.mark.parametrize("do", ["do", "shuffle_do"])
def test_steps_of_robots_from_outside_say_once_that_they_move_nobody(do: str) -> None:
    world = CMOMMT(robots=2, targets=2, rng=1)
    before = world.robots.position.copy()
    with pytest.warns(UserWarning, match=r"(Robot|Target)\.step\(\) moves nobody: robots and targets move together, by world\.step\(\)") as met:
        getattr(world.agents, do)("step")
    assert [one.filename for one in met] == [__file__]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        getattr(world.agents, do)("step")
        world.step()
        assert world.path == "compiled"
    assert not np.array_equal(world.robots.position, before)


def test_steps_that_a_model_calls_twice_are_named_once() -> None:
    world = Shuffling(rng=1, robot=Scout, passes_on=True)
    with pytest.warns(UserWarning, match=r"Scout\.step was called, and each step of the world calls it too.*shuffle_do") as met:
        world.step()
    assert len(met) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        world.step()
    assert [scout.steps for scout in world.scouts] == [4] * 3


def test_steps_that_only_the_world_calls_say_nothing() -> None:
    world = World(Box(10, 10), rng=1)
    scouts = world.add(Scout, 3, policy="random-walk")
    # A model may shuffle agents of its own beside robots, whose step does nothing.
    mixed = Shuffling(rng=1, passes_on=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        world.step()
        mixed.step()
    assert [scout.steps for scout in scouts] == [1] * 3
    assert (world.tick, mixed.tick) == (1, 1)
