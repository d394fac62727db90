"""Events: what happens between steps, when, and what follows when it goes wrong."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np
import pytest

from teamsight import CMOMMT, Robot, World
from teamsight.policies.interface import Action, Policy

pytestmark = pytest.mark.filterwarnings("ignore:run.. makes its steps one by one")

PATHS: list[Callable[[World, int], Any]] = [
    lambda model, steps: model.run(steps),
    lambda model, steps: [model.step() for _ in range(steps)],
]
paths = pytest.mark.parametrize("advance", PATHS, ids=["run", "step"])


@pytest.mark.short
@paths
@pytest.mark.parametrize(
    ("time", "before"), [(0, 1), (0.01, 2), (2.5, 4), (3, 4), (3 - 1e-12, 4), (3 + 1e-12, 4), (3.0001, 5)]
)
def test_an_event_takes_effect_before_the_step_that_starts_at_the_next_whole_tick(
    advance: Callable[[World, int], Any], time: float, before: int
) -> None:
    model = CMOMMT(robots=1, targets=1, radius=5.0, policy="stationary", target_speed=0, rng=1)
    model.targets[0].position = (0.0, 4.0)
    model.robots[0].position = (0.0, -4.0)
    model.clock.at(time, lambda: setattr(model.robots[0], "position", (0.0, 4.0)))
    advance(model, 6)
    assert model.recording.history.observed.tolist() == [float(step >= before) for step in range(1, 7)]


@paths
def test_a_run_ends_before_the_events_of_its_last_tick(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []
    model.clock.at(300, lambda: log.append(model.tick))
    advance(model, 300)
    assert log == []
    advance(model, 1)
    assert log == [300]


@paths
def test_the_exact_time_is_known_while_it_happens(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []

    def note() -> None:
        log.append((model.clock.now, model.tick))

    model.clock.at(2.5, note)
    model.clock.at(2.5, lambda: model.clock.at(model.clock.now + 0.75, note))
    model.clock.at(7, note)
    advance(model, 10)
    assert log == [(2.5, 3), (3.25, 4), (7.0, 7)]
    assert model.clock.now == 10.0


@paths
def test_a_process_is_a_plain_generator(advance: Callable[[World, int], Any]) -> None:
    model, log = CMOMMT(rng=1), []

    def patrol(start: float) -> Generator[Any, Any, str]:
        for _ in range(3):
            yield model.clock.timeout(1.5)
            log.append((model.clock.now, model.tick))
        return "done"

    def boss() -> Generator[Any, Any, None]:
        result = yield model.clock.process(patrol(0))
        log.append((model.clock.now, result))

    advance(model, 4)
    model.clock.process(boss())
    advance(model, 10)
    assert log == [(5.5, 6), (7.0, 7), (8.5, 9), (8.5, "done")]


def test_planning_between_steps_lets_nothing_that_is_due_happen_early() -> None:
    # The event of 4.5 is due before the next step; planning another one must leave it its time.
    model, log = CMOMMT(rng=1), []
    model.clock.at(4.5, lambda: (log.append(model.clock.now), model.clock.at(model.clock.now + 1, lambda: log.append(model.clock.now))))
    model.run(5)
    model.clock.at(7, lambda: log.append(model.clock.now))
    assert log == []
    model.run(5)
    assert log == [4.5, 5.5, 7.0]


@paths
def test_events_at_one_time_happen_in_the_order_in_which_they_were_planned(
    advance: Callable[[World, int], Any],
) -> None:
    model, log = CMOMMT(rng=1), []
    for name in "abc":
        model.clock.at(2, lambda name=name: log.append(name))
    advance(model, 3)
    assert log == ["a", "b", "c"]


@paths
def test_an_event_may_stop_the_model(advance: Callable[[World, int], Any]) -> None:
    model = CMOMMT(rng=1)
    model.clock.at(4, lambda: setattr(model, "running", False))
    while model.running:
        advance(model, 10 if advance is PATHS[0] else 1)
    assert (model.tick, model.steps, len(model.recording.history), model.clock.now) == (4, 4, 4, 4.0)
    model.run(10)
    assert model.tick == 4
    model.running = True
    advance(model, 3)
    assert (model.tick, model.steps) == (7, 7)


@paths
def test_an_error_in_an_event_is_raised_and_the_world_goes_on_from_its_last_step(advance: Callable[[World, int], Any]) -> None:
    model = CMOMMT(rng=1)
    model.clock.at(4, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        advance(model, 10)
    assert (model.tick, model.steps, model.clock.now, len(model.recording.history)) == (4, 4, 4.0, 4)
    advance(model, 6)
    undisturbed = CMOMMT(rng=1)
    undisturbed.run(10)
    assert model.recording.history.equals(undisturbed.recording.history)


@paths
def test_an_error_in_a_process_is_raised_and_the_world_goes_on(advance: Callable[[World, int], Any]) -> None:
    def broken() -> Generator[Any, Any, None]:
        yield model.clock.timeout(3)
        raise KeyError("battery")

    model = CMOMMT(rng=1)
    model.clock.process(broken())
    with pytest.raises(KeyError, match="battery"):
        advance(model, 10)
    assert model.tick == 3
    advance(model, 2)
    assert model.tick == 5


class Failing(Policy):
    """A NumPy policy that fails at its fourth decision."""

    draws = 0

    def __init__(self, answer: Callable[[Any], Any]) -> None:
        self.answer = answer

    def start(self, size: int) -> np.ndarray:
        return np.zeros(size)

    def decide(self, percept: Any, memory: np.ndarray, noise: Any) -> Any:
        action = Action(percept.heading, percept.speed)
        return (self.answer(action) if memory[0] >= 3 else action), memory + 1


@paths
@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda action: 1 / 0, "division"),
        (
            lambda action: Action(action.heading * np.nan, action.distance),
            r"Failing: action\.heading of robot 0 is .*nan",
        ),
        (
            lambda action: Action(action.heading, action.distance[1:]),
            r"Failing: action\.distance has the shape \(9,\); 10 robots",
        ),
        (
            lambda action: Action(2 * action.heading, action.distance),
            r"Failing: action\.heading of robot 0 has the length 2;",
        ),
        (lambda action: None, r"Failing: returned NoneType as action; it must be Action\(heading, distance\)"),
    ],
)
def test_an_error_in_a_policy_is_raised_at_each_attempt(
    advance: Callable[[World, int], Any], answer: Callable[[Any], Any], message: str
) -> None:
    model = CMOMMT(policy=Failing(answer), rng=1)
    with pytest.raises((ValueError, TypeError, ZeroDivisionError), match=message):
        advance(model, 10)
    assert (model.tick, model.steps, len(model.recording.history)) == (3, 3, 3)
    # mesa 3.5 would from now on step without doing anything.
    with pytest.raises((ValueError, TypeError, ZeroDivisionError), match=message):
        advance(model, 1)
    assert model.tick == 3


@paths
@pytest.mark.parametrize(
    ("answer", "message"),
    [("left", r"returned 'left' for robot 0"), ((1.0, np.inf), r"both must be finite"), (None, r"returned None")],
)
def test_a_rule_for_one_robot_that_answers_nonsense_is_named(
    advance: Callable[[World, int], Any], answer: Any, message: str
) -> None:
    def nonsense(percept: Any, rng: Any) -> Any:
        return answer

    model = CMOMMT(policy=nonsense, rng=1)
    with pytest.raises((TypeError, ValueError), match=f"nonsense: .*{message}"):
        advance(model, 1)


def test_a_policy_cannot_change_what_it_perceives() -> None:
    def cheat(percept: Any, rng: Any) -> tuple[float, float]:
        percept.heading[:] = 0.0
        return 0.0, 0.0

    with pytest.raises(ValueError, match="read-only"):
        CMOMMT(policy=cheat, rng=1).step()


def test_an_agent_that_moves_in_its_own_step_is_perceived_where_it_is() -> None:
    seen: list[int] = []

    class Gathering(Robot):
        def step(self) -> None:
            self.position = (0.01 * self.unique_id, 0.0)

    def look(percept: Any, rng: Any) -> tuple[float, float]:
        seen.append(len(percept.teammates.identity))
        return 0.0, 0.0

    model = World(CMOMMT(rng=1).arena, rng=1)
    model.add(Gathering, 3, policy=look, awareness="pairwise", placement=[(4, 0), (-4, 0), (0, 4)])
    model.step()
    assert seen == [2, 2, 2]


def test_an_agent_may_leave_in_its_own_step() -> None:
    class Fading(Robot):
        def step(self) -> None:
            if self.model.tick == 2 and self.unique_id == 2:
                self.remove()

    model = World(CMOMMT(rng=1).arena, rng=1)
    group = model.add(Fading, 4, policy="random-walk", awareness="pairwise")
    for _ in range(5):
        model.step()
    assert len(group) == len(model.agents) == 3
    assert np.isfinite(group.position).all()


@paths
def test_mesas_counter_keeps_up_when_a_policy_fails(advance: Callable[[World, int], Any]) -> None:
    model = CMOMMT(rng=1)
    model.clock.at(4, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        advance(model, 10)
    assert model.steps == 4
